//! Rung `firmware`: the `firmware` crate on the host, with the setpoints of the run.

use firmware::law::Law;
use firmware::{Controller, ControllerOutput, ControllerState, SetpointTable, counts};

use super::setpoint::Setpoint;
use super::setup::Setup;
use crate::case::Case;
use crate::io::{IoKind, SpiIo};
use crate::message::{Command, Measurement, whole};
use crate::quantise::{FixedPointGains, QuantiseError};
use crate::scaling::ScaledLaw;

/// The firmware's controller with its memory.
#[derive(Debug, Clone)]
pub struct FirmwareLaw {
    on_counts: FirmwareOnCounts,
    /// Setpoints of the samples from 0 on, the last of which is held \[counts modulo 2^32\].
    setpoints: Vec<i32>,
    /// The gains in fixed point, with their rounding.
    pub(super) gains: FixedPointGains,
    /// Chips and drivers that count and code go through.
    io: Option<Box<SpiIo>>,
}

impl FirmwareLaw {
    /// The controller of `case` before its first sample.
    ///
    /// # Errors
    /// [`QuantiseError`] if a gain has no fixed-point form.
    pub fn new(case: &Case, period_ns: u64, io: IoKind) -> Result<Self, QuantiseError> {
        let scaled = papers_law(case, period_ns)?;
        Ok(Self {
            on_counts: FirmwareOnCounts::of(scaled.law),
            setpoints: Setpoint::new(case, period_ns).positions(),
            gains: scaled.fixed_point(),
            io: io.chips(case)?,
        })
    }

    /// One sample.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        let counts = measurement.position_counts.whole();
        let count = match &mut self.io {
            None => counts::wrap(counts),
            Some(io) => io.read(counts),
        };
        let tick = usize::try_from(measurement.tick).ok();
        let setpoint = tick.and_then(|tick| self.setpoints.get(tick));
        let setpoint = setpoint.or(self.setpoints.last()).copied().unwrap_or(0);
        let output = self.on_counts.tick(setpoint, count);
        let code = match &mut self.io {
            None => output.code,
            Some(io) => io.drive(output.code),
        };
        Command {
            out_of_range: output.out_of_range,
            ..Command::whole(measurement.tick, output.error_counts, code)
        }
    }
}

/// The law of a case that asks for no more than the paper's.
///
/// # Errors
/// [`QuantiseError`] if a gain has no fixed-point form.
pub fn papers_law(case: &Case, period_ns: u64) -> Result<ScaledLaw, QuantiseError> {
    Setup::of(case, period_ns)?.law()
}

/// The firmware's controller behind setpoints that come with the samples: it rests at 0,
/// and counts from the setpoint on, which changes no code ([`firmware::counts`]).
#[derive(Debug, Clone)]
pub struct FirmwareOnCounts {
    controller: Controller<1>,
    state: ControllerState,
}

impl FirmwareOnCounts {
    /// # Errors
    /// Those of [`FirmwareLaw::new`].
    pub fn new(case: &Case, period_ns: u64) -> Result<Self, QuantiseError> {
        Ok(Self::of(papers_law(case, period_ns)?.law))
    }

    fn of(law: Law) -> Self {
        let controller = Controller::new(law, SetpointTable::resting_at(0));
        Self {
            state: ControllerState::start(&controller),
            controller,
        }
    }

    #[inline]
    fn tick(&mut self, setpoint: i32, count: i32) -> ControllerOutput {
        let relative = counts::difference(count, setpoint);
        self.controller.tick(&mut self.state, relative)
    }

    /// The code for setpoint and position in whole counts.
    #[inline]
    pub fn code(&mut self, setpoint_counts: f64, position_counts: f64) -> f64 {
        let [setpoint, count] = [setpoint_counts, position_counts].map(|n| counts::wrap(whole(n)));
        f64::from(self.tick(setpoint, count).code)
    }
}
