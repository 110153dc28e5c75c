//! The limit cycle in the gap of the joint.
//!
//! `Ψ = (k + c·d/dt) dz(ε)` becomes `ν(A)·(k·ε + c·ε̇)`, [`joint_share`], and the
//! axis a linear one whose joint grows stiffer with the amplitude. It predicts
//! a motor that hunts between the flanks because it is not stable alone. A load
//! that drifts through the gap and is thrown back is no sine, and the distortion
//! says so.

use nalgebra::Complex;
use plant::Joint;

use super::characteristic::Characteristic;
use super::cycles::{Border, Cycle, borders, decades, deflection_third, joint_share, prediction};
use super::delay::DelayedLoop;
use super::family::LoopFamily;
use super::gains::{LoopGains, is_papers_loop};
use super::linear_axis::{JointState, LinearAxis};
use crate::case::{Case, Law};
use crate::time::seconds;

/// The predicted cycle in the gap: of [`gap_cycles`] the largest that attracts
/// and fulfils its conditions. About a millisecond; 20 on rung
/// `continuous`.
pub fn gap_cycle(case: &Case) -> Option<Cycle> {
    prediction(&gap_cycles(case), case, 0.0)
}

/// All cycles in the gap, by rising amplitude in the joint; with `no_pull` as if
/// a separating flank could pull. Empty without a gap, with a constant or
/// quadratic resistance (the joint then rests on a flank, or sticks), and where
/// the loop is not the paper's ([`is_papers_loop`]). Encoder and converter count
/// as without steps.
pub fn gap_cycles(case: &Case) -> Vec<Cycle> {
    let resistance = &case.axis.carriage.resistance;
    let odd = resistance.constant_n == 0.0 && resistance.quadratic_ns2_per_rad2 == 0.0;
    let (Joint::Elastic(joint), Some(axis), Some(closed), true) = (
        case.axis.transmission.joint,
        LinearAxis::new(&case.axis, JointState::Closed),
        GapLoop::of(case),
        odd && is_papers_loop(case),
    ) else {
        return Vec::new();
    };
    let b = joint.backlash_half_rad;
    if b <= 0.0 {
        return Vec::new();
    }
    // The amplitude as A/b − 1, which resolves a contact of any depth.
    let softened = |depth: f64| axis.with_share_of_joint(joint_share(1.0 / (1.0 + depth)));
    let depths = decades(1e-4, 1e4, 12);
    let found = borders(&depths, |depth| closed.is_stable(&softened(depth)));
    let cycle = |border: &Border| {
        let depth = border.amplitude;
        let soft = softened(depth);
        let radps = closed.weakest_radps(&soft);
        let s = Complex::new(0.0, radps);
        let screw_rad = b * (1.0 + depth) * soft.screw_per_joint(s)?.norm_sqr().sqrt();
        let gear_rad = screw_rad / soft.screw_per_gear(s).norm_sqr().sqrt();
        // What the third harmonic of the deflection makes of ε, over A − b.
        let third = deflection_third(1.0 / (1.0 + depth)) * (1.0 + depth) / depth;
        let delayed = closed.delayed(&axis);
        let back = delayed.joint_response(3.0 * radps)?;
        let volts_per_rad = delayed.law(radps).norm_sqr().sqrt() / axis.gear_ratio;
        Some(Cycle::new(
            &axis,
            [screw_rad, gear_rad, gear_rad * volts_per_rad],
            radps,
            border.stability,
            third * back.norm_sqr().sqrt(),
        ))
    };
    found.iter().filter_map(cycle).collect()
}

/// The loop around an axis whose joint is softened: sampled, or on rung
/// `continuous` the paper's own.
struct GapLoop {
    gains: LoopGains,
    /// Sample time and delay \[s\].
    timing: Option<[f64; 2]>,
}

impl GapLoop {
    fn of(case: &Case) -> Option<Self> {
        let timing = match case.controller.law {
            Law::Continuous => None,
            _ => Some([
                seconds(case.controller.sample_time_ns.filter(|&ns| ns > 0)?),
                seconds(case.controller.computation_delay.fixed_ns()?),
            ]),
        };
        Some(Self {
            gains: LoopGains::of(case),
            timing,
        })
    }

    fn delayed(&self, axis: &LinearAxis) -> DelayedLoop {
        let [period_s, delay_s] = self.timing.unwrap_or_default();
        DelayedLoop {
            axis: *axis,
            gains: self.gains,
            period_s,
            delay_s,
        }
    }

    fn is_stable(&self, axis: &LinearAxis) -> bool {
        match self.timing {
            None => self.delayed(axis).margin().stable,
            Some([period_s, delay_s]) => {
                Characteristic::new(axis, period_s, delay_s).is_stable(&self.gains)
            }
        }
    }

    /// The frequency at which L comes closest to −1.
    fn weakest_radps(&self, axis: &LinearAxis) -> f64 {
        let margin = match self.timing {
            None => self.delayed(axis).margin(),
            Some([period_s, delay_s]) => {
                LoopFamily::of_axis(axis, period_s, delay_s).margin(&self.gains)
            }
        };
        margin.weakest_radps
    }
}
