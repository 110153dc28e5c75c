//! Gains to start from, by rules of the books.

use plant::{Control, PidGains};

use super::relay::{Oscillation, oscillation, timing_ns};
use crate::case::{CascadeGains, Case};
use crate::number::seconds;
use crate::theory::{JointState, LoopFamily, LoopGains, no_loop};

/// A start of a search: the gains of a rule, or all values.
#[derive(Debug, Clone, PartialEq)]
pub struct Start<T> {
    /// Its name.
    pub name: String,
    /// Who gave it; empty of the file's own.
    pub source: &'static str,
    /// What it begins with, or the sentence that says why it has none for this axis.
    pub with: Result<T, String>,
}

impl<T> Start<T> {
    /// The same with something made of what it begins with.
    pub(super) fn map<U>(self, make: impl FnOnce(T) -> U) -> Start<U> {
        Start {
            name: self.name,
            source: self.source,
            with: self.with.map(make),
        }
    }
}

/// The rules for a case with a sample time, each with gains in codes per count; `least` are
/// the modulus margins that are required in contact and in the gap.
pub fn starts(case: &Case, least: [Option<f64>; 2]) -> Vec<Start<PidGains>> {
    let start = |name: &str, source, with| Start {
        name: name.to_owned(),
        source,
        with,
    };
    let [astrom, kessler, ziegler] = [
        "Åström, Panagopoulos and Hägglund 1998",
        "Kessler 1958",
        "Åström and Hägglund 1984, Ziegler and Nichols 1942",
    ];
    vec![
        start("largest K_i", astrom, largest_ki(case, least)),
        start("symmetric optimum", kessler, symmetric_optimum(case)),
        start("relay", ziegler, oscillation(case).map(ziegler_nichols)),
    ]
}

/// Gains per radian of the motor in codes per count.
fn in_codes(case: &Case, per_rad: [f64; 3]) -> PidGains {
    let [kp, ki_per_s, kd_s] = per_rad.map(|gain| gain / case.output_per_rad());
    PidGains { kp, ki_per_s, kd_s }
}

/// A loop by its crossover ω_c, and times of lead and reset in 1/ω_c.
type Shape = [f64; 3];

/// Ratio of neighbours on the first grid, and the one at which the search ends.
const COARSE: f64 = 1.5;
const FINE: f64 = 1.001;
/// Crossovers that are tried, in 1/(half a sample + delay), and times of lead and reset.
const CROSSOVERS: [f64; 2] = [1e-3, 1.5];
const LEADS: [f64; 2] = [0.1, 10.0];
const RESETS: [f64; 2] = [1.0, 60.0];

/// The largest K_i with which the modulus margins are kept: a load's step costs
/// `∫e dt = 1/K_i`.
///
/// ```text
/// C = K·(1 + ω_c/(b·s) + a·s/ω_c),   |L(jω_c)| = 1 in contact
/// ```
fn largest_ki(case: &Case, least: [Option<f64>; 2]) -> Result<PidGains, String> {
    let none = || "no gains keep the required margins".to_owned();
    let contact = LoopFamily::of(case, JointState::Contact).ok_or_else(none)?;
    let has_gap = no_loop(case, JointState::Gap).is_none();
    let gap = LoopFamily::of(case, JointState::Gap).filter(|_| has_gap);
    let [period_s, delay_s] = timing_ns(case).ok_or_else(none)?.map(seconds);
    let gains = |[crossover, lead, reset]: Shape| {
        let unit = LoopGains {
            kp_v_per_rad: 1.0,
            ki_v_per_rads: crossover / reset,
            kd_vs_per_rad: lead / crossover,
            ..LoopGains::of(case)
        };
        unit.times(1.0 / contact.at(&unit, crossover * period_s).norm_sqr().sqrt())
    };
    let [least_contact, least_gap] = least.map(|least| least.unwrap_or(0.0));
    // The K_i of a shape that keeps the margins.
    let worth = |shape: Shape| -> Option<(f64, Shape)> {
        let gains = gains(shape);
        let kept = |family: &LoopFamily, least| family.signed_modulus(&gains) >= least;
        let ki = gains.ki_v_per_rads;
        let is_kept =
            kept(&contact, least_contact) && gap.as_ref().is_none_or(|gap| kept(gap, least_gap));
        (is_kept && ki.is_finite()).then_some((ki, shape))
    };
    // Of equal ones the first.
    let best_of = |shapes: &mut dyn Iterator<Item = Shape>| {
        let known = shapes.filter_map(worth);
        known.reduce(|best, other| if best.0 < other.0 { other } else { best })
    };
    let steps = |[low, high]: [f64; 2]| {
        let count = libm::ceil(libm::log(high / low) / libm::log(COARSE)) as i32;
        (0..=count).map(move |k| low * libm::pow(COARSE, f64::from(k)))
    };
    let fastest = 1.0 / (0.5 * period_s + delay_s);
    let crossovers = steps(CROSSOVERS).map(|share| share * fastest);
    let mut grid = crossovers.flat_map(|crossover| {
        let leads = steps(LEADS);
        leads.flat_map(move |lead| steps(RESETS).map(move |reset| [crossover, lead, reset]))
    });
    let mut best = best_of(&mut grid).ok_or_else(none)?;
    let mut ratio = libm::sqrt(COARSE);
    while ratio > FINE {
        let (ki, at) = best;
        let mut around = (0..27).map(|direction: i32| {
            let step = |k: u32| libm::pow(ratio, f64::from(direction / 3_i32.pow(k) % 3 - 1));
            [at[0] * step(0), at[1] * step(1), at[2] * step(2)]
        });
        match best_of(&mut around).filter(|(other, _)| *other > ki) {
            Some(better) => best = better,
            None => ratio = libm::sqrt(ratio),
        }
    }
    let gains = gains(best.1);
    Ok(in_codes(
        case,
        [gains.kp_v_per_rad, gains.ki_v_per_rads, gains.kd_vs_per_rad],
    ))
}

/// The symmetric optimum: phase as large as it gets at the crossover of
/// `K·(1 + T_n·s)/(T_n·s)·k/(s·(1 + T_Σ·s))`, with `T_n = 4·T_Σ` and `K·k = 1/(2·T_Σ)` (Kessler;
/// Schröder, "Elektrische Antriebe – Regelung von Antriebssystemen", 3.2).
///
/// ```text
/// J_m + z²·(J_v + M·p²) = J       T_Σ = T/2 (hold) + τ + T/2 (difference) + L/R or 1/ω_c
/// voltage drive   α/V = 1/k_m/(s·(1 + T_m·s)·(1 + T_Σ·s)),   T_m = R·J/k_m² is cancelled
///                 C = K·(1 + T_n·s)/(T_n·s)·(1 + T_m·s)
/// current drive   the velocity loop's k = J/(2·k_m·T_Σ), k_v = 1/(8·T_Σ) around it
/// ```
fn symmetric_optimum(case: &Case) -> Result<PidGains, String> {
    let [period_s, delay_s] = timing_ns(case)
        .ok_or("there is no sample time")?
        .map(seconds);
    let (motor, gear) = (&case.axis.motor, &case.axis.transmission);
    let (z, p) = (gear.gear_ratio, gear.screw_pitch_m_per_rad);
    let (r, km) = (motor.resistance_ohm, motor.torque_constant_nm_per_a);
    let load = gear.screw_inertia_kg_m2 + case.axis.carriage.mass_kg * p * p;
    let inertia = motor.inertia_kg_m2 + z * z * load;
    let small_s = |electrical_s: f64| period_s + delay_s + electrical_s;
    Ok(in_codes(
        case,
        match case.amplifier.control {
            Control::Voltage { .. } => {
                let sum_s = small_s(motor.inductance_h / r);
                let (reset_s, lead_s) = (4.0 * sum_s, r * inertia / (km * km));
                let k = km / (2.0 * sum_s);
                [k * (1.0 + lead_s / reset_s), k / reset_s, k * lead_s]
            }
            Control::Current {
                bandwidth_radps, ..
            } => {
                let sum_s = small_s(bandwidth_radps.map_or(0.0, |omega| 1.0 / omega));
                let cascade = CascadeGains {
                    kv_per_s: 1.0 / (8.0 * sum_s),
                    velocity_gain_vs_per_rad: inertia / (2.0 * km * sum_s),
                    velocity_reset_s: 4.0 * sum_s,
                };
                cascade.gains()
            }
        },
    ))
}

/// `K_p = 0.6·K_u, T_i = T_u/2, T_d = T_u/8` (Ziegler and Nichols).
fn ziegler_nichols(at: Oscillation) -> PidGains {
    let kp = 0.6 * at.gain;
    PidGains {
        kp,
        ki_per_s: kp / (0.5 * at.period_s),
        kd_s: kp * 0.125 * at.period_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runfile;
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    fn case(name: &str, sets: &[&str]) -> Case {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        runfile::builtin(name, &sets).unwrap()
    }

    fn margins(case: &Case, gains: &PidGains) -> [f64; 2] {
        let gains = LoopGains::new(gains, case.output_per_rad());
        [JointState::Contact, JointState::Gap].map(|joint| {
            LoopFamily::of(case, joint).map_or(f64::INFINITY, |of| of.signed_modulus(&gains))
        })
    }

    /// A requirement binds, and no gains drawn at random keep both with a larger K_i; with
    /// less required there are such.
    #[test]
    fn no_larger_ki_keeps_the_margins() {
        for name in ["paper-1", "paper-2"] {
            let case = case(name, &[]);
            let best = largest_ki(&case, [Some(0.5), Some(0.3)]).unwrap();
            let [contact, gap] = margins(&case, &best);
            assert!(contact >= 0.5 && gap >= 0.3, "{contact} {gap}");
            assert!(contact < 0.502 || gap < 0.302, "{contact} {gap}");
            let mut random = Pcg64Mcg::seed_from_u64(1);
            let mut factor = || {
                let unit = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
                libm::pow(3.0, 2.0 * unit - 1.0)
            };
            let (mut larger, mut of_less) = (0, 0);
            for _ in 0..4_000 {
                let gains = PidGains {
                    kp: best.kp * factor(),
                    ki_per_s: best.ki_per_s * 1.02 * factor().max(1.0),
                    kd_s: best.kd_s * factor(),
                };
                let [contact, gap] = margins(&case, &gains);
                larger += u32::from(contact >= 0.5 && gap >= 0.3);
                of_less += u32::from(contact >= 0.3 && gap >= 0.2);
            }
            assert_eq!(larger, 0, "{name}");
            assert!(of_less > 10, "{name}: {of_less}");
        }
    }

    #[test]
    fn every_kind_of_axis_has_gains_or_a_reason() {
        let current = [
            "drive.kind=current",
            "drive.amplifier_gain_a_per_v=1",
            "drive.current_limit_a=20",
        ];
        let slow = [&current[..], &["drive.current_bandwidth_hz=500"]].concat();
        for sets in [
            &[][..],
            &["transmission.joint=rigid"],
            &["controller.computation_delay_s=1e-3"],
            &current,
            &slow,
        ] {
            let case = case("paper-2", sets);
            for start in starts(&case, [Some(0.5), Some(0.3)]) {
                match start.with {
                    Ok(gains) => {
                        let all = [gains.kp, gains.ki_per_s, gains.kd_s];
                        assert!(
                            all.iter().all(|gain| gain.is_finite() && *gain > 0.0),
                            "{sets:?} {start:?}"
                        );
                    }
                    Err(why) => assert!(
                        start.name == "relay" && why.contains("oscillation"),
                        "{sets:?} {why}"
                    ),
                }
            }
        }
    }
}
