//! The sampled control laws, one per rung (`sampled`, `quantised`,
//! `firmware`).

mod firmware_law;
mod quantised;
mod sampled;

use crate::case::{Case, Law};
use crate::message::{Command, Measurement};
use crate::quantise::QuantiseError;
use plant::{Encoder, Motion};

pub use firmware_law::FirmwareLaw;
pub(crate) use firmware_law::FirmwareOnCounts;
use quantised::QuantisedLaw;
pub(crate) use sampled::Pid;
use sampled::SampledLaw;

/// The controller of a sampled rung with its memory.
#[derive(Debug, Clone)]
pub enum Controller {
    /// Real numbers, sampled.
    Sampled(SampledLaw),
    /// Whole counts and codes, in f64.
    Quantised(QuantisedLaw),
    /// The `firmware` crate.
    Firmware(Box<FirmwareLaw>),
}

impl Controller {
    /// The controller of `case`; `None` on rung `continuous` or without a
    /// sample time.
    ///
    /// # Errors
    /// [`QuantiseError`] on rung `firmware`, if a gain fits no word or the
    /// motion is longer than the setpoint table.
    pub fn new(case: &Case) -> Result<Option<Self>, QuantiseError> {
        let Some(period_ns) = case.controller.sample_time_ns else {
            return Ok(None);
        };
        Ok(match case.controller.law {
            Law::Continuous => None,
            Law::Sampled => Some(Self::Sampled(SampledLaw::new(case, period_ns))),
            Law::Quantised => Some(Self::Quantised(QuantisedLaw::new(case, period_ns))),
            Law::Firmware => Some(Self::Firmware(Box::new(FirmwareLaw::new(case, period_ns)?))),
        })
    }

    /// One sample.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        match self {
            Self::Sampled(law) => law.step(measurement),
            Self::Quantised(law) => law.step(measurement),
            Self::Firmware(law) => law.step(measurement),
        }
    }
}

/// The motor angle that the motion asks for, in counts as a real number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Setpoint {
    motion: Motion,
    encoder: Encoder,
    period_ns: u64,
    /// Carriage displacement per motor angle, `p·z` \[m/rad\].
    metres_per_rad: f64,
}

impl Setpoint {
    pub(crate) fn new(case: &Case, period_ns: u64) -> Self {
        let transmission = &case.axis.transmission;
        Self {
            motion: case.motion,
            encoder: case.encoder,
            period_ns,
            metres_per_rad: transmission.screw_pitch_m_per_rad * transmission.gear_ratio,
        }
    }

    /// `α_ref(t_k)` \[rad\].
    fn alpha_rad(&self, tick: u64) -> f64 {
        let time_s = crate::time::seconds(tick.saturating_mul(self.period_ns));
        self.motion.at(time_s).displacement_m / self.metres_per_rad
    }

    /// `K_enc·α_ref(t_k)`, a real number of counts.
    pub(crate) fn position_counts(&self, tick: u64) -> f64 {
        self.encoder.position_counts(self.alpha_rad(tick))
    }

    /// `floor(K_enc·α_ref(t_k) + ½)`, a whole number of counts.
    pub(crate) fn count(&self, tick: u64) -> f64 {
        self.encoder.setpoint_count(self.alpha_rad(tick))
    }
}
