//! Rung `firmware`: the `firmware` crate on the host, with the setpoint table
//! that the chip would hold.

use firmware::{CAPACITY, Controller, ControllerState, SetpointTable, counts};

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
    controller: Controller<CAPACITY>,
    state: ControllerState,
    /// The gains in fixed point, with their rounding.
    pub(super) gains: FixedPointGains,
    /// Chips and drivers that count and code go through.
    io: Option<Box<SpiIo>>,
}

impl FirmwareLaw {
    /// The controller of `case` before its first sample.
    ///
    /// # Errors
    /// [`QuantiseError`] if a gain has no fixed-point form or the motion is longer
    /// than the setpoint table.
    pub fn new(case: &Case, period_ns: u64, io: IoKind) -> Result<Self, QuantiseError> {
        let scaled = papers_law(case, period_ns)?;
        let table = Setpoint::new(case, period_ns).table()?;
        let controller = Controller::new(scaled.law, table);
        Ok(Self {
            state: ControllerState::start(&controller),
            controller,
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
        let output = self.controller.tick(&mut self.state, count);
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
/// [`QuantiseError`] if a gain has no fixed-point form or the motion is longer
/// than the setpoint table.
pub fn papers_law(case: &Case, period_ns: u64) -> Result<ScaledLaw, QuantiseError> {
    Setpoint::new(case, period_ns).last_in_table()?;
    Setup::of(case, period_ns)?.law()
}

/// The firmware's law on errors `r − c`: every code is that of [`FirmwareLaw`],
/// without a table for every run.
#[derive(Debug, Clone)]
pub struct FirmwareOnCounts {
    controller: Controller<1>,
    state: ControllerState,
}

impl FirmwareOnCounts {
    /// # Errors
    /// Those of [`FirmwareLaw::new`].
    pub fn new(case: &Case, period_ns: u64) -> Result<Self, QuantiseError> {
        let law = papers_law(case, period_ns)?.law;
        let controller = Controller::new(law, SetpointTable::resting_at(0));
        Ok(Self {
            state: ControllerState::start(&controller),
            controller,
        })
    }

    /// The code for setpoint and position in whole counts.
    #[inline]
    pub fn code(&mut self, setpoint_counts: f64, position_counts: f64) -> f64 {
        let [setpoint, count] = [setpoint_counts, position_counts].map(|n| counts::wrap(whole(n)));
        let relative = counts::difference(count, setpoint);
        f64::from(self.controller.tick(&mut self.state, relative).code)
    }
}
