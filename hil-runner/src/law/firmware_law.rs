//! Rung `firmware`: the `firmware` crate on the host, with the setpoint table
//! that the chip would hold.

use firmware::{CAPACITY, Controller, ControllerState, Dac, SetpointError, counts};

use super::Setpoint;
use crate::case::Case;
use crate::message::{Command, Measurement};
use crate::quantise::{QuantiseError, QuantisedGains, quantise, setpoint_table};
use crate::time::seconds;

/// The firmware's controller with its memory.
#[derive(Debug, Clone)]
pub struct FirmwareLaw {
    controller: Controller<CAPACITY>,
    state: ControllerState,
    gains: QuantisedGains,
}

impl FirmwareLaw {
    pub(crate) fn new(case: &Case, period_ns: u64) -> Result<Self, QuantiseError> {
        let setpoint = Setpoint::new(case, period_ns);
        let last = last_tick(case, period_ns);
        let travel_counts = whole(setpoint.count(last));
        let gains = quantise(&case.controller.gains, period_ns, travel_counts)?;
        // Refused before 10^9 samples of a motion are computed for it.
        let needed = usize::try_from(last)
            .unwrap_or(usize::MAX)
            .saturating_add(1);
        if needed > CAPACITY {
            let too_long = SetpointError::TooLong {
                needed,
                capacity: CAPACITY,
            };
            return Err(QuantiseError::Setpoints(too_long));
        }
        let positions = (0..=last).map(|tick| whole(setpoint.count(tick)));
        let setpoints = setpoint_table(positions)?;
        let dac = Dac::with_bits(case.dac.bits).map_err(QuantiseError::Dac)?;
        Ok(Self {
            controller: Controller::new(gains.pid, dac, setpoints),
            state: ControllerState::default(),
            gains,
        })
    }

    /// The words that the gains became, with their rounding.
    pub fn gains(&self) -> &QuantisedGains {
        &self.gains
    }

    pub(crate) fn step(&mut self, measurement: Measurement) -> Command {
        let count = counts::wrap(whole(measurement.position_counts));
        let output = self.controller.tick(&mut self.state, count);
        let status = output.status;
        Command {
            tick: measurement.tick,
            error_counts: f64::from(output.error_counts),
            dac_code: f64::from(output.code),
            out_of_range: status.error_limited || status.error_sum_beyond_range,
        }
    }
}

/// The first sample at or after the motion's end.
fn last_tick(case: &Case, period_ns: u64) -> u64 {
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
fn whole(counts: f64) -> i64 {
    counts as i64
}
