//! What the loops of one axis and one timing have in common, made once.

use plant::AxisParameters;

use super::characteristic::Characteristic;
use super::gains::LoopGains;
use super::grid::Grid;
use super::linear_axis::{JointState, LinearAxis};
use super::margin::Margin;
use crate::case::Case;
use crate::time::seconds;

/// Why there is no linear loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LoopError {
    /// A rigid axis has no gap that could be open.
    RigidHasNoGap,
    /// The sample time is 0.
    NoSampleTime,
    /// The delay is longer than the sample time.
    DelayBeyondSample {
        /// The delay \[ns\].
        delay_ns: u64,
        /// The sample time \[ns\].
        period_ns: u64,
    },
}

impl core::fmt::Display for LoopError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::RigidHasNoGap => write!(f, "a rigid axis has no gap that could be open"),
            Self::NoSampleTime => write!(f, "a sampled loop needs a sample time greater than 0"),
            Self::DelayBeyondSample {
                delay_ns,
                period_ns,
            } => write!(
                f,
                "a delay of {delay_ns} ns is longer than the sample time of {period_ns} ns"
            ),
        }
    }
}

impl core::error::Error for LoopError {}

/// All loops of one axis, sample time, delay and state of the joint: gains,
/// encoder, converter and amplifier are open.
///
/// ```
/// use hil_core::runfile;
/// use hil_core::theory::{JointState, LoopFamily, LoopGains};
///
/// let case = runfile::builtin("paper-2", &[])?;
/// let family = LoopFamily::new(&case.axis, 1_000_000, 0, JointState::Closed)?;
/// let gains = LoopGains::of(&case);
/// assert!(family.margin(&gains).stable);
/// assert!(!family.margin(&gains.times(200.0)).stable);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LoopFamily {
    characteristic: Characteristic,
    grid: Grid,
    period_s: f64,
}

/// Numbers that a family depends on.
const KEY: usize = 15;

/// A family as plain bits, to be looked up. b, dry and quadratic resistance,
/// motion and everything that is open have no part in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FamilyKey([u64; KEY]);

impl LoopFamily {
    /// Works out the responses on a grid of frequencies and the characteristic
    /// polynomial: some ten microseconds to a millisecond.
    ///
    /// # Errors
    /// [`LoopError`] for a rigid axis with an open joint, and for a timing that
    /// cannot be.
    pub fn new(
        axis: &AxisParameters,
        period_ns: u64,
        delay_ns: u64,
        joint: JointState,
    ) -> Result<Self, LoopError> {
        let axis = LinearAxis::new(axis, joint).ok_or(LoopError::RigidHasNoGap)?;
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
        Self {
            grid: Grid::new(&characteristic, &axis.corners_radps(), period_s),
            characteristic,
            period_s,
        }
    }

    /// The family of a case; none where it has no fixed sample time and delay,
    /// or no such joint.
    pub fn of(case: &Case, joint: JointState) -> Option<Self> {
        let period_ns = case.controller.sample_time_ns?;
        let delay_ns = case.controller.computation_delay.fixed_ns()?;
        Self::new(&case.axis, period_ns, delay_ns, joint).ok()
    }

    /// Equal for two families exactly if they are the same.
    pub fn key(
        axis: &AxisParameters,
        period_ns: u64,
        delay_ns: u64,
        joint: JointState,
    ) -> FamilyKey {
        let (motor, transmission) = (&axis.motor, &axis.transmission);
        let (stiffness, damping, coupling) = match transmission.joint {
            plant::Joint::Rigid => (0.0, 0.0, 0),
            plant::Joint::Elastic(joint) => {
                (joint.stiffness_nm_per_rad, joint.damping_nms_per_rad, 1)
            }
        };
        let bits = |value: f64| (value + 0.0).to_bits();
        FamilyKey([
            bits(motor.inertia_kg_m2),
            bits(motor.torque_constant_nm_per_a),
            bits(motor.resistance_ohm),
            bits(motor.inductance_h),
            bits(transmission.gear_ratio),
            bits(stiffness),
            bits(damping),
            bits(transmission.screw_inertia_kg_m2),
            bits(transmission.screw_pitch_m_per_rad),
            bits(axis.carriage.mass_kg),
            bits(axis.carriage.resistance.linear_ns_per_rad),
            coupling,
            period_ns,
            delay_ns,
            match joint {
                JointState::Closed => 0,
                JointState::Open => 1,
            },
        ])
    }

    /// How far the closed loop is from instability: a microsecond or two.
    pub fn margin(&self, gains: &LoopGains) -> Margin {
        let stable = self.characteristic.is_stable(gains);
        let at = |theta: f64| self.characteristic.at(gains, theta);
        self.grid.margin(gains, &at, stable, self.period_s)
    }

    /// [`Margin::signed`] alone, without a look at phase and gain.
    pub fn signed_modulus(&self, gains: &LoopGains) -> f64 {
        let at = |theta: f64| self.characteristic.at(gains, theta);
        let modulus = self.grid.modulus(gains, &at);
        if self.is_stable(gains) {
            modulus
        } else {
            -modulus
        }
    }

    /// Whether the closed loop is stable: a twentieth of the time of
    /// [`Self::margin`].
    pub fn is_stable(&self, gains: &LoopGains) -> bool {
        self.characteristic.is_stable(gains)
    }

    /// `L(e^{jθ})`.
    pub(crate) fn at(&self, gains: &LoopGains, theta: f64) -> nalgebra::Complex<f64> {
        self.characteristic.at(gains, theta)
    }
}

#[cfg(test)]
impl LoopFamily {
    pub(crate) fn points(&self) -> usize {
        self.grid.points()
    }
}
