//! Rung `firmware`: the `firmware` crate on the host, with the setpoint table
//! that the chip would hold.

use firmware::{CAPACITY, Controller, ControllerState, Dac, SetpointTable, counts};

use super::setpoint::Setpoint;
use crate::case::Case;
use crate::io::{IoKind, SpiIo};
use crate::message::{Command, Measurement, whole};
use crate::quantise::{FixedPointGains, QuantiseError, QuantisedGains, quantise};

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
        let setpoint = Setpoint::new(case, period_ns);
        let Parts { gains, dac } = Parts::of(case, period_ns)?;
        Ok(Self {
            controller: Controller::new(gains.pid, dac, setpoint.table()?),
            state: ControllerState::default(),
            gains: gains.fixed_point(),
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
        let status = output.status;
        Command {
            out_of_range: status.error_limited || status.error_sum_beyond_range,
            ..Command::whole(measurement.tick, output.error_counts, code)
        }
    }
}

/// The firmware's controller less its setpoints.
#[derive(Debug)]
pub struct Parts {
    /// The gains in fixed point.
    pub gains: QuantisedGains,
    /// The converter's range.
    pub dac: Dac,
}

impl Parts {
    /// The parts of the controller of `case`.
    ///
    /// # Errors
    /// As [`FirmwareLaw::new`].
    pub fn of(case: &Case, period_ns: u64) -> Result<Self, QuantiseError> {
        let setpoint = Setpoint::new(case, period_ns);
        let travel_counts = setpoint.count(setpoint.last_tick());
        let gains = quantise(&case.controller.gains, period_ns, travel_counts)?;
        setpoint.last_in_table()?;
        let dac = Dac::with_bits(case.dac.bits)?;
        Ok(Self { gains, dac })
    }
}

/// The firmware's controller on a wheel of counts that turns with the
/// setpoint: its table holds the one setpoint 0, and it is fed c − r. The
/// error r − c is that of [`FirmwareLaw`], and so is every code, without a
/// table for every run.
#[derive(Debug, Clone)]
pub struct FirmwareOnCounts {
    controller: Controller<1>,
    state: ControllerState,
}

impl FirmwareOnCounts {
    /// # Errors
    /// Those of [`FirmwareLaw::new`].
    pub fn new(case: &Case, period_ns: u64) -> Result<Self, QuantiseError> {
        let Parts { gains, dac } = Parts::of(case, period_ns)?;
        Ok(Self {
            controller: Controller::new(gains.pid, dac, SetpointTable::resting_at(0)),
            state: ControllerState::default(),
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
