//! The sampled control laws, one per rung (`sampled`, `quantised`,
//! `firmware`).

mod chip_law;
mod firmware_law;
mod quantised;
mod sampled;
mod servo_law;

use crate::case::{Case, Law};
use crate::message::{Command, Measurement};
use crate::quantise::QuantiseError;
use crate::time::seconds;
use firmware::CAPACITY;
use plant::{Encoder, Motion};

pub use chip_law::{ChipLaw, ChipLawError, Meter};
pub use firmware_law::FirmwareLaw;
pub(crate) use firmware_law::FirmwareOnCounts;
use quantised::QuantisedLaw;
pub(crate) use sampled::Pid;
use sampled::SampledLaw;
pub use servo_law::{
    GapMeasurement, IoKind, ServoLaw, ServoStatus, accepted, measure_gap, smallest_sample_time_ns,
    word_request,
};

/// The controller of a sampled rung with its memory.
#[derive(Debug, Clone)]
pub enum Controller {
    /// Real numbers, sampled.
    Sampled(SampledLaw),
    /// Whole counts and codes, in f64.
    Quantised(QuantisedLaw),
    /// The `firmware` crate: the paper's law alone.
    Firmware(Box<FirmwareLaw>),
    /// The `firmware` crate: an axis with what a product needs.
    Servo(Box<ServoLaw>),
}

impl Controller {
    /// The controller of `case`; `None` on rung `continuous` or without a
    /// sample time.
    ///
    /// # Errors
    /// [`QuantiseError`] on rung `firmware`, if a gain fits no word or the
    /// motion is longer than the setpoint table.
    pub fn new(case: &Case, io: IoKind) -> Result<Option<Self>, QuantiseError> {
        let Some(period_ns) = case.controller.sample_time_ns else {
            return Ok(None);
        };
        Ok(match case.controller.law {
            Law::Continuous => None,
            Law::Sampled => Some(Self::Sampled(SampledLaw::new(case, period_ns))),
            Law::Quantised => Some(Self::Quantised(QuantisedLaw::new(case, period_ns))),
            Law::Firmware if case.servo.is_off() => Some(Self::Firmware(Box::new(
                FirmwareLaw::new(case, period_ns, io)?,
            ))),
            Law::Firmware => Some(Self::Servo(Box::new(ServoLaw::new(case, period_ns, io)?))),
        })
    }

    /// One sample.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        match self {
            Self::Sampled(law) => law.step(measurement),
            Self::Quantised(law) => law.step(measurement),
            Self::Firmware(law) => law.step(measurement),
            Self::Servo(law) => law.step(measurement),
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

    /// The same at the load: the screw's angle, in counts of the encoder there.
    pub(crate) fn of_load(case: &Case, period_ns: u64, load: Encoder) -> Self {
        Self {
            encoder: load,
            metres_per_rad: case.axis.transmission.screw_pitch_m_per_rad,
            ..Self::new(case, period_ns)
        }
    }

    /// Counts per displacement of the carriage \[counts/m\].
    pub(crate) fn counts_per_m(&self) -> f64 {
        self.encoder.counts_per_rad / self.metres_per_rad
    }

    /// The whole travel, a real number of counts.
    pub(crate) fn travel_counts(&self) -> f64 {
        let travel_rad = self.motion.travel_m() / self.metres_per_rad;
        self.encoder.position_counts(travel_rad)
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

/// The first sample at or after the motion's end.
pub(crate) fn last_tick(case: &Case, period_ns: u64) -> u64 {
    let end_s = case.motion.end_s();
    let estimate = whole((end_s / seconds(period_ns)).floor());
    let mut tick = u64::try_from(estimate).unwrap_or(0).saturating_sub(1);
    while seconds(tick.saturating_mul(period_ns)) < end_s {
        tick += 1;
    }
    tick
}

/// A whole number of counts as an integer.
#[expect(
    clippy::cast_possible_truncation,
    reason = "whole by construction; beyond 2^63, far past any travel, `as` saturates"
)]
pub(crate) fn whole(counts: f64) -> i64 {
    counts as i64
}

/// `last`, if a table holds the setpoints of the samples up to it: refused
/// before 10^9 samples of a motion are computed for it.
fn fits_table(last: u64) -> Result<u64, QuantiseError> {
    let needed = last.saturating_add(1);
    if needed > CAPACITY as u64 {
        return Err(QuantiseError::too_long(needed, CAPACITY));
    }
    Ok(last)
}
