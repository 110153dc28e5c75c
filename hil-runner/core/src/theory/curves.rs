//! Curves of a case's linear loop for Bode, Nyquist and Nichols plots, and its stiffness
//! over frequency, in Hz.

use core::f64::consts::{PI, TAU};

use nalgebra::Complex;
use serde::Serialize;

use super::characteristic::LoopGains;
use super::curve::{Limits, bends, refined};
use super::family::LoopFamily;
use super::linear_axis::JointState;
use super::loops::no_loop;
use super::stiffness::Compliance;
use crate::case::Case;
use crate::number::{column, column_option};

/// Curves of the linear sampled loop of a case with one set of gains; `None` where there is no
/// such loop ([`no_loop`]).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoopCurves {
    /// In contact.
    pub contact: Option<LoopCurve>,
    /// In the gap.
    pub gap: Option<LoopCurve>,
}

/// One loop at rising frequencies, all columns of one length.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoopCurve {
    /// Frequency \[Hz\], from where |L| is about 100 up to half of the sample rate.
    #[serde(serialize_with = "column")]
    pub frequency_hz: Vec<f64>,
    /// Real part of L.
    #[serde(serialize_with = "column")]
    pub re: Vec<f64>,
    /// Imaginary part of L.
    #[serde(serialize_with = "column")]
    pub im: Vec<f64>,
    /// Dynamic stiffness against a force on the carriage \[N/µm\]; `None` in the gap, and
    /// of an unstable loop, which has no steady state.
    #[serde(serialize_with = "column_option")]
    pub stiffness_n_per_um: Option<Vec<f64>>,
}

/// |L| at the lowest frequency.
const LOUD: f64 = 100.0;
/// Frequencies in equal steps of the logarithm. The family's own are added, closer where
/// its axis bends, and what L needs besides.
const POINTS: u32 = 300;
const LIMITS: Limits = Limits {
    most: 500,
    closest: 1e-6,
};

impl LoopCurves {
    /// The curves of a case with `gains`: about a tenth of a millisecond.
    pub fn of(case: &Case, gains: &LoopGains) -> Self {
        let curve = |joint| match no_loop(case, joint) {
            None => Some(LoopCurve::new(&LoopFamily::of(case, joint)?, gains, joint)),
            Some(_) => None,
        };
        Self {
            contact: curve(JointState::Contact),
            gap: curve(JointState::Gap),
        }
    }
}

impl LoopCurve {
    fn new(family: &LoopFamily, gains: &LoopGains, joint: JointState) -> Self {
        let l = |theta: f64| family.at(gains, theta);
        let lowest = lowest(family, gains);
        let ratio = PI / lowest;
        let share = |k: u32| f64::from(k) / f64::from(POINTS);
        let base = (0..=POINTS).map(|k| match k {
            POINTS => PI,
            k => lowest * libm::pow(ratio, share(k)),
        });
        let points = refined(base.collect(), &family.theta, LIMITS, l, bends);
        let per_theta_hz = 1.0 / (TAU * family.period_s);
        let angles = points.iter().map(|(theta, _)| *theta);
        let has_stiffness = joint == JointState::Contact && family.is_stable(gains);
        let stiffness = |theta: f64| {
            let m_per_n = Compliance::at(family, gains, theta).norm_sqr().sqrt();
            1e-6 / m_per_n
        };
        let of = |part: fn(&Complex<f64>) -> f64| points.iter().map(|(_, l)| part(l)).collect();
        Self {
            frequency_hz: angles.clone().map(|theta| theta * per_theta_hz).collect(),
            re: of(|l| l.re),
            im: of(|l| l.im),
            stiffness_n_per_um: has_stiffness.then(|| angles.map(stiffness).collect()),
        }
    }
}

/// The last angle of the grid up to which |L| stays above [`LOUD`], or the first below
/// the grid; where there is none, that of the grid.
fn lowest(family: &LoopFamily, gains: &LoopGains) -> f64 {
    let is_loud = |l: Complex<f64>| l.norm_sqr() > LOUD * LOUD;
    let grid = family.theta.iter().copied();
    let loud = grid.take_while(|&theta| is_loud(family.at(gains, theta)));
    loud.last().unwrap_or_else(|| {
        let below = family.below(gains, LOUD);
        let first = below.first().filter(|(_, l)| is_loud(*l));
        first.map_or(family.theta[0], |(theta, _)| *theta)
    })
}
