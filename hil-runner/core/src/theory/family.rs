//! The loops of one axis and one timing, and the margins of a case.
//!
//! L is linear in the three gains: each part is kept on a grid of frequencies, and
//! a loop costs three products a point.

use core::f64::consts::PI;

use nalgebra::Complex;
use plant::{Amplifier, AxisParameters};

use super::characteristic::{Characteristic, LoopGains, is_papers_loop};
use super::curve::{Curve, Limits, Margin, bends, refined, signed};
use super::delay::DelayedLoop;
use super::linear_axis::{JointState, LinearAxis};
use crate::case::{Case, Law};
use crate::number::seconds;

/// An axis of the paper's kind needs about a hundred points.
const LIMITS: Limits = Limits {
    most: 512,
    closest: 1e-8,
};
/// Most points below the grid.
const MOST_BELOW: usize = 320;
/// Ratio of neighbouring frequencies before anything is refined, and their
/// largest distance \[rad\], for a delay of a sample or two.
const RATIO: f64 = 1.2;
const DISTANCE: f64 = 0.12;

/// A case without a linear loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LoopError {
    /// A rigid axis has no gap that could be open.
    #[error("a rigid axis has no gap that could be open")]
    RigidHasNoGap,
    /// The sample time is 0.
    #[error("a sampled loop needs a sample time greater than 0")]
    NoSampleTime,
    /// The delay is longer than the sample time.
    #[error("a delay of {delay_ns} ns is longer than the sample time of {period_ns} ns")]
    DelayBeyondSample {
        /// The delay \[ns\].
        delay_ns: u64,
        /// The sample time \[ns\].
        period_ns: u64,
    },
}

/// All loops of one axis, kind of drive, sample time, delay and state of the joint: gains,
/// encoder, converter and the amplifier's gain are open.
///
/// ```
/// use hil_core::runfile;
/// use hil_core::theory::{JointState, LoopFamily, LoopGains};
///
/// let case = runfile::builtin("paper-2", &[])?;
/// let contact = JointState::Contact;
/// let family = LoopFamily::new(&case.axis, &case.amplifier, [1_000_000, 0], contact)?;
/// let gains = LoopGains::of(&case);
/// assert!(family.margin(&gains).stable);
/// assert!(!family.margin(&gains.times(200.0)).stable);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LoopFamily {
    characteristic: Characteristic,
    period_s: f64,
    /// Angles θ = ωΔt up to π.
    pub(super) theta: Vec<f64>,
    /// The parts of `L(e^{jθ})` for K_p, K_i and K_d.
    re: [Vec<f64>; 3],
    im: [Vec<f64>; 3],
}

/// Everything that a family depends on. b, dry and quadratic resistance, motion and
/// everything that is open have no part in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FamilyKey {
    axis: Option<LinearAxis>,
    timing_ns: [u64; 2],
}

impl LoopFamily {
    /// Works out the responses on a grid of frequencies and the characteristic
    /// polynomial: some ten microseconds to a millisecond.
    ///
    /// # Errors
    /// [`LoopError`] for a rigid axis in a gap, and for a timing that
    /// cannot be.
    pub fn new(
        axis: &AxisParameters,
        amplifier: &Amplifier,
        [period_ns, delay_ns]: [u64; 2],
        joint: JointState,
    ) -> Result<Self, LoopError> {
        let axis = LinearAxis::new(axis, amplifier, joint).ok_or(LoopError::RigidHasNoGap)?;
        if period_ns == 0 {
            return Err(LoopError::NoSampleTime);
        }
        if delay_ns > period_ns {
            return Err(LoopError::DelayBeyondSample {
                delay_ns,
                period_ns,
            });
        }
        Ok(Self::of_axis(&axis, seconds(period_ns), seconds(delay_ns)))
    }

    /// The same for an axis that is linear already.
    pub(crate) fn of_axis(axis: &LinearAxis, period_s: f64, delay_s: f64) -> Self {
        let characteristic = Characteristic::new(axis, period_s, delay_s);
        let mut family = Self {
            theta: angles(&characteristic, &axis.corners_radps(), period_s),
            characteristic,
            period_s,
            re: Default::default(),
            im: Default::default(),
        };
        for &theta in &family.theta {
            for (k, part) in family.characteristic.parts(theta).iter().enumerate() {
                family.re[k].push(part.re);
                // In the middle of the spectrum every response is real.
                family.im[k].push(if theta == PI { 0.0 } else { part.im });
            }
        }
        family
    }

    /// The family of a case; none where it has no fixed sample time and delay,
    /// or no such joint.
    pub fn of(case: &Case, joint: JointState) -> Option<Self> {
        let period_ns = case.controller.sample_time_ns?;
        let delay_ns = case.controller.computation_delay.fixed_ns()?;
        Self::new(&case.axis, &case.amplifier, [period_ns, delay_ns], joint).ok()
    }

    /// Equal for two families exactly if they are the same.
    pub fn key(
        axis: &AxisParameters,
        amplifier: &Amplifier,
        timing_ns: [u64; 2],
        joint: JointState,
    ) -> FamilyKey {
        FamilyKey {
            axis: LinearAxis::new(axis, amplifier, joint),
            timing_ns,
        }
    }

    /// The margins of the closed loop: a microsecond or two.
    pub fn margin(&self, gains: &LoopGains) -> Margin {
        let stable = self.is_stable(gains);
        let at = |theta: f64| self.at(gains, theta);
        let mut margin = self.with_curve(gains, &at, |curve| Margin::of(curve, stable));
        margin.weakest_radps /= self.period_s;
        margin.crossover_radps = margin.crossover_radps.map(|theta| theta / self.period_s);
        margin
    }

    /// [`Margin::signed`] alone, without a look at phase and gain.
    pub fn signed_modulus(&self, gains: &LoopGains) -> f64 {
        let at = |theta: f64| self.at(gains, theta);
        let distance = self.with_curve(gains, &at, |curve| curve.modulus());
        signed(self.is_stable(gains), distance)
    }

    /// True if the closed loop is stable: a twentieth of the time of
    /// [`Self::margin`].
    pub fn is_stable(&self, gains: &LoopGains) -> bool {
        self.characteristic.is_stable(gains)
    }

    /// `L(e^{jθ})`.
    pub(crate) fn at(&self, gains: &LoopGains, theta: f64) -> Complex<f64> {
        self.characteristic.at(gains, theta)
    }

    /// L on the grid, carried on below it until |L| is above 2: a loop with
    /// very small gains crosses over below the axis' own frequencies.
    fn with_curve<F: Fn(f64) -> Complex<f64>, T>(
        &self,
        gains: &LoopGains,
        at: &F,
        use_curve: impl FnOnce(&Curve<'_, F>) -> T,
    ) -> T {
        let (re, im) = (combine(&self.re, gains), combine(&self.im, gains));
        if re[0] * re[0] + im[0] * im[0] > 4.0 {
            return use_curve(&Curve {
                frequency: &self.theta,
                re: &re,
                im: &im,
                at,
                ends_real: true,
            });
        }
        let mut below = Vec::new();
        let mut theta = self.theta[0];
        for _ in 0..MOST_BELOW {
            theta /= RATIO;
            let value = at(theta);
            below.push((theta, value));
            if value.norm_sqr() > 4.0 {
                break;
            }
        }
        below.reverse();
        let chain = |of: fn(&(f64, Complex<f64>)) -> f64, rest: &[f64]| -> Vec<f64> {
            below.iter().map(of).chain(rest.iter().copied()).collect()
        };
        use_curve(&Curve {
            frequency: &chain(|(theta, _)| *theta, &self.theta),
            re: &chain(|(_, value)| value.re, &re),
            im: &chain(|(_, value)| value.im, &im),
            at,
            ends_real: true,
        })
    }
}

/// `kp·P + ki·I + kd·D`, point by point.
fn combine(parts: &[Vec<f64>; 3], gains: &LoopGains) -> Vec<f64> {
    let (kp, ki, kd) = (gains.kp_v_per_rad, gains.ki_v_per_rads, gains.kd_vs_per_rad);
    let [p, i, d] = parts;
    let points = p.iter().zip(i).zip(d);
    points.map(|((p, i), d)| kp * p + ki * i + kd * d).collect()
}

/// Angles from far below the lowest corner to π, closer where the response
/// bends.
fn angles(characteristic: &Characteristic, corners_radps: &[f64; 4], period_s: f64) -> Vec<f64> {
    let slowest = corners_radps.iter().copied().fold(f64::INFINITY, f64::min);
    let mut theta = (slowest * period_s / 30.0).clamp(1e-12, 0.01);
    let mut base = Vec::new();
    while theta < PI {
        base.push(theta);
        theta = (theta * RATIO).min(theta + DISTANCE);
    }
    base.push(PI);
    // A frequency beyond the middle of the spectrum appears folded.
    let folded = corners_radps.map(|corner| {
        let turns = corner * period_s / (2.0 * PI);
        (turns - (turns + 0.5).floor()).abs() * 2.0 * PI
    });
    // The axis with K_p alone: K_i and K_d add a slope that is as smooth.
    let response = |theta: f64| characteristic.parts(theta)[0];
    let points = refined(base, &folded, LIMITS, response, bends);
    points.iter().map(|&(theta, _)| theta).collect()
}

/// The margins of a case's linear loop: sampled, with hold and delay as they
/// are, or on rung `continuous` the paper's own. `None` where the loop is not
/// the paper's ([`is_papers_loop`]), its sample time or delay is not known, or
/// a rigid axis is asked for its gap.
///
/// Works out a family for one case; whoever has many of one axis and timing
/// keeps the [`LoopFamily`].
pub fn margin(case: &Case, joint: JointState) -> Option<Margin> {
    if !is_papers_loop(case) {
        return None;
    }
    if case.controller.law == Law::Continuous {
        return Some(DelayedLoop::of(case, joint)?.margin());
    }
    Some(LoopFamily::of(case, joint)?.margin(&LoopGains::of(case)))
}
