//! Rung `quantised`: the same law on whole encoder counts, rounded to whole
//! DAC codes within the range of the converter.

use plant::Dac;

use super::Setpoint;
use super::sampled::Pid;
use crate::case::Case;
use crate::message::{Command, Measurement};

/// The controller of rung `quantised`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuantisedLaw {
    setpoint: Setpoint,
    pid: Pid<f64>,
    dac: Dac,
}

impl QuantisedLaw {
    pub fn new(case: &Case, period_ns: u64) -> Self {
        Self {
            setpoint: Setpoint::new(case, period_ns),
            pid: Pid::new(case, period_ns),
            dac: case.dac,
        }
    }

    pub fn step(&mut self, measurement: Measurement) -> Command {
        let Measurement {
            tick,
            position_counts,
            ..
        } = measurement;
        let error_counts = self.setpoint.count(tick) - position_counts;
        let y = self.pid.output(error_counts);
        let (lowest, highest) = (self.dac.code_min(), self.dac.code_max());
        // code = clamp(floor(y + ½), −2^(n−1), 2^(n−1) − 1)
        let dac_code = (y + 0.5)
            .floor()
            .clamp(f64::from(lowest), f64::from(highest));
        Command {
            tick,
            error_counts,
            dac_code,
            out_of_range: false,
            execution: None,
            axis: None,
        }
    }
}
