//! The theory against methods that share nothing with it, and against the
//! simulation.

mod delay;
mod describing;
mod gap_cycles;
mod linear;
mod loops;
mod margins;
mod matrices;
mod noise;
mod simulated;
mod step_cycles;
mod stiffness;
mod swing;

use plant::{
    Amplifier, AxisParameters, Carriage, Control, ElasticJoint, Joint, Motor, PidGains, Resistance,
    Transmission,
};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::characteristic::LoopGains;
use crate::case::Case;
use crate::run::{RunOptions, run};
use crate::runfile;
use crate::trace::Row;

/// A case with overrides.
fn case(name: &str, sets: &[&str]) -> Case {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    runfile::builtin(name, &sets).unwrap()
}

/// The rows of a run.
fn rows(case: &Case) -> Vec<Row> {
    let mut rows = Vec::new();
    run(case, RunOptions::default(), &mut |row| {
        rows.push(*row);
        Ok(())
    })
    .unwrap();
    rows
}

/// All gains times a factor.
fn scale(gains: &mut PidGains, factor: f64) {
    for gain in [&mut gains.kp, &mut gains.ki_per_s, &mut gains.kd_s] {
        *gain *= factor;
    }
}

/// Random numbers, the same in every run.
struct Draw(Pcg64Mcg);

impl Draw {
    fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// Uniform in [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Between `low` and `high`, every decade as likely.
    fn decades(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.uniform())
    }

    /// An axis around the paper's, two decades to each side in stiffness.
    fn axis(&mut self) -> AxisParameters {
        AxisParameters {
            motor: Motor {
                inertia_kg_m2: 2e-4 * self.decades(0.2, 5.0),
                torque_constant_nm_per_a: 0.25 * self.decades(0.3, 3.0),
                resistance_ohm: 1.5 * self.decades(0.2, 5.0),
                inductance_h: 6.5e-3 * self.decades(0.05, 5.0),
            },
            transmission: Transmission {
                gear_ratio: self.decades(0.2, 5.0),
                joint: Joint::Elastic(ElasticJoint {
                    stiffness_nm_per_rad: 350.0 * self.decades(0.01, 100.0),
                    damping_nms_per_rad: if self.uniform() < 0.2 {
                        0.0
                    } else {
                        0.2 * self.decades(0.01, 5.0)
                    },
                    backlash_half_rad: 0.0,
                    no_pull: false,
                }),
                screw_inertia_kg_m2: 8.5e-4 * self.decades(0.2, 5.0),
                screw_pitch_m_per_rad: 8e-4,
            },
            carriage: Carriage {
                mass_kg: 50.0 * self.decades(0.1, 10.0),
                resistance: Resistance {
                    linear_ns_per_rad: if self.uniform() < 0.5 {
                        0.0
                    } else {
                        self.decades(0.01, 10.0)
                    },
                    ..Resistance::default()
                },
            },
        }
    }

    /// A voltage drive, a current drive with a loop, an ideal one.
    fn amplifier(&mut self, kind: usize) -> Amplifier {
        let bandwidth_radps = (kind == 1).then(|| self.decades(300.0, 3e4));
        let mut amplifier = Amplifier::default();
        if kind > 0 {
            amplifier.control = Control::Current {
                current_limit_a: 1.0,
                bandwidth_radps,
            };
        }
        amplifier
    }

    fn gains(&mut self) -> LoopGains {
        let kp = self.decades(1.0, 1000.0);
        LoopGains {
            kp_v_per_rad: kp,
            ki_v_per_rads: if self.uniform() < 0.2 {
                0.0
            } else {
                kp * self.decades(0.1, 30.0)
            },
            kd_vs_per_rad: if self.uniform() < 0.2 {
                0.0
            } else {
                kp * self.decades(1e-4, 0.1)
            },
            smoothing: 1.0,
        }
    }
}
