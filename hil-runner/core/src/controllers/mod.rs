//! The sampled control laws, one per rung (`sampled`, `quantised`,
//! `firmware`).
//!
//! ```text
//! setpoint               the motion in counts, sample by sample
//! sampled                rungs sampled and quantised
//! firmware_law           rung firmware: the paper's law alone
//! axis_controller        rung firmware: the axis with everything beyond it
//!   setup                  from a case to the axis in fixed point
//!   backlash               how the reference crosses the gap, and its width, measured
//!   board                  the electronics
//!   world                  setpoints, requests and faults of a run
//! ```

mod axis_controller;
mod backlash;
mod board;
mod firmware_law;
mod sampled;
mod setpoint;
mod setup;
mod world;

use crate::case::{Case, Law};
use crate::message::{Command, Link, LinkError, Measurement};
use crate::quantise::{FixedPointGains, QuantiseError};

pub use crate::io::IoKind;
pub use axis_controller::{AxisController, accepted, smallest_sample_time_ns};
pub use backlash::{GapMeasurement, compensated, measure_gap};
pub use firmware_law::{FirmwareLaw, FirmwareOnCounts, papers_law};
pub use sampled::{Pid, PidState, SampledLaw};
pub use setpoint::{LastTable, Setpoint};
pub use setup::{FROM_REST, Setup, scaling_request};
pub use world::{Arrivals, Reported, Shown, Source, StreamedQueue, World};

/// The controller of a sampled rung with its memory.
#[derive(Debug, Clone)]
pub enum Controller {
    /// In f64: rungs `sampled` and `quantised`.
    Sampled(Box<SampledLaw>),
    /// The `firmware` crate: the paper's law alone.
    Firmware(Box<FirmwareLaw>),
    /// The `firmware` crate: the axis with everything beyond it.
    Axis(Box<AxisController>),
}

impl Controller {
    /// The controller of `case`; `None` on rung `continuous` or without a
    /// sample time.
    ///
    /// # Errors
    /// [`QuantiseError`] on rung `firmware`, if a gain has no fixed-point form.
    pub fn new(case: &Case, io: IoKind) -> Result<Option<Self>, QuantiseError> {
        let Some(period_ns) = case.controller.sample_time_ns else {
            return Ok(None);
        };
        Ok(Some(match case.controller.law {
            Law::Continuous => return Ok(None),
            Law::Sampled | Law::Quantised => {
                Self::Sampled(Box::new(SampledLaw::new(case, period_ns)))
            }
            Law::Firmware if case.options.is_off() => {
                Self::Firmware(Box::new(FirmwareLaw::new(case, period_ns, io)?))
            }
            Law::Firmware => Self::Axis(Box::new(AxisController::new(case, period_ns, io)?)),
        }))
    }

    /// One sample.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        match self {
            Self::Sampled(law) => law.step(measurement),
            Self::Firmware(law) => law.step(measurement),
            Self::Axis(law) => law.step(measurement),
        }
    }
}

/// The controller in the same thread.
impl Link for Controller {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        Ok(self.step(measurement))
    }

    fn gains(&self) -> Option<FixedPointGains> {
        match self {
            Self::Sampled(_) => None,
            Self::Firmware(law) => Some(law.gains.clone()),
            Self::Axis(law) => Some(law.gains.clone()),
        }
    }
}
