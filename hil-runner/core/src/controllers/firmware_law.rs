//! Rung `firmware`: the `firmware` crate on the host, with the setpoint table
//! that the chip would hold.

use firmware::{CAPACITY, Controller, ControllerState, Dac, SetpointTable, counts};

use super::axis_controller::{BenchBoard, IoKind};
use super::{Setpoint, fits_table, last_tick, whole};
use crate::case::Case;
use crate::message::{Command, Measurement};
use crate::quantise::{QuantiseError, QuantisedGains, quantise, setpoint_table};

/// The firmware's controller with its memory.
#[derive(Debug, Clone)]
pub struct FirmwareLaw {
    controller: Controller<CAPACITY>,
    state: ControllerState,
    gains: QuantisedGains,
    /// Where count and code go through the drivers.
    board: Option<BenchBoard>,
}

impl FirmwareLaw {
    /// The controller of `case` before its first sample.
    ///
    /// # Errors
    /// [`QuantiseError`] if a gain fits no word or the motion is longer than the
    /// setpoint table.
    pub fn new(case: &Case, period_ns: u64, io: IoKind) -> Result<Self, QuantiseError> {
        let setpoint = Setpoint::new(case, period_ns);
        let Parts { gains, dac, last } = Parts::of(case, &setpoint)?;
        let positions = (0..=last).map(|tick| whole(setpoint.count(tick)));
        Ok(Self {
            controller: Controller::new(gains.pid, dac, setpoint_table(positions)?),
            state: ControllerState::default(),
            gains,
            board: match io {
                IoKind::Direct => None,
                IoKind::Spi => Some(BenchBoard::new(case, io)?),
            },
        })
    }

    /// The words that the gains became, with their rounding.
    pub fn gains(&self) -> &QuantisedGains {
        &self.gains
    }

    /// One sample.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        let mut count = counts::wrap(whole(measurement.position_counts));
        if let Some(board) = &mut self.board {
            count = board.count(whole(measurement.position_counts));
        }
        let mut output = self.controller.tick(&mut self.state, count);
        if let Some(board) = &mut self.board {
            output.code = board.drive(output.code);
        }
        let status = output.status;
        Command {
            tick: measurement.tick,
            error_counts: f64::from(output.error_counts),
            dac_code: f64::from(output.code),
            out_of_range: status.error_limited || status.error_sum_beyond_range,
            execution: None,
            axis: None,
        }
    }
}

/// What the firmware is made of, less its setpoints.
#[derive(Debug)]
pub struct Parts {
    /// The gains in words.
    pub gains: QuantisedGains,
    /// The converter's range.
    pub dac: Dac,
    /// The sample of the last setpoint.
    pub last: u64,
}

impl Parts {
    /// The parts of the controller of `case`.
    ///
    /// # Errors
    /// As [`FirmwareLaw::new`].
    pub fn of(case: &Case, setpoint: &Setpoint) -> Result<Self, QuantiseError> {
        let last = last_tick(case, setpoint.period_ns);
        let travel_counts = whole(setpoint.count(last));
        let gains = quantise(&case.controller.gains, setpoint.period_ns, travel_counts)?;
        let last = fits_table(last)?;
        let dac = Dac::with_bits(case.dac.bits).map_err(QuantiseError::Dac)?;
        Ok(Self { gains, dac, last })
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
        let Parts { gains, dac, .. } = Parts::of(case, &Setpoint::new(case, period_ns))?;
        Ok(Self {
            controller: Controller::new(gains.pid, dac, SetpointTable::starting_at(0)),
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
