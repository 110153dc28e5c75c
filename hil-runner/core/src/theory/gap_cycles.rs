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
    let (Joint::Elastic(joint), Some(axis), Some(timing), true) = (
        case.axis.transmission.joint,
        LinearAxis::new(&case.axis, JointState::Closed),
        Timing::of(case),
        odd && is_papers_loop(case),
    ) else {
        return Vec::new();
    };
    let b = joint.backlash_half_rad;
    if b <= 0.0 {
        return Vec::new();
    }
    let gains = LoopGains::of(case);
    // The amplitude as A/b − 1, which resolves a contact of any depth.
    let softened = |depth: f64| axis.with_share_of_joint(joint_share(1.0 / (1.0 + depth)));
    let depths = decades(1e-4, 1e4, 12);
    let found = borders(&depths, |depth| timing.is_stable(&softened(depth), &gains));
    let cycle = |border: &Border| {
        let depth = border.amplitude;
        let soft = softened(depth);
        let radps = timing.weakest_radps(&soft, &gains);
        let s = Complex::new(0.0, radps);
        let screw_rad = b * (1.0 + depth) * soft.screw_per_joint(s)?.norm_sqr().sqrt();
        let gear_rad = screw_rad / soft.screw_per_gear(s).norm_sqr().sqrt();
        // What the third harmonic of the deflection makes of ε, over A − b.
        let third = deflection_third(1.0 / (1.0 + depth)) * (1.0 + depth) / depth;
        let delayed = timing.delayed(&axis, &gains);
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

/// When the law sees the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Timing {
    Continuous,
    Sampled { period_s: f64, delay_s: f64 },
}

impl Timing {
    fn of(case: &Case) -> Option<Self> {
        if case.controller.law == Law::Continuous {
            return Some(Self::Continuous);
        }
        Some(Self::Sampled {
            period_s: seconds(case.controller.sample_time_ns.filter(|&ns| ns > 0)?),
            delay_s: seconds(case.controller.computation_delay.fixed_ns()?),
        })
    }

    fn delayed(self, axis: &LinearAxis, gains: &LoopGains) -> DelayedLoop {
        let continuous = DelayedLoop::continuous(axis, gains);
        match self {
            Self::Continuous => continuous,
            Self::Sampled { period_s, delay_s } => DelayedLoop {
                period_s,
                delay_s,
                ..continuous
            },
        }
    }

    fn is_stable(self, axis: &LinearAxis, gains: &LoopGains) -> bool {
        match self {
            Self::Continuous => self.delayed(axis, gains).margin().stable,
            Self::Sampled { period_s, delay_s } => {
                Characteristic::new(axis, period_s, delay_s).is_stable(gains)
            }
        }
    }

    /// The frequency at which L comes closest to −1.
    fn weakest_radps(self, axis: &LinearAxis, gains: &LoopGains) -> f64 {
        match self {
            Self::Continuous => self.delayed(axis, gains).margin().weakest_radps,
            Self::Sampled { period_s, delay_s } => {
                let family = LoopFamily::of_axis(axis, period_s, delay_s);
                family.margin(gains).weakest_radps
            }
        }
    }
}
