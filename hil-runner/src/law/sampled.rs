//! Rung `sampled`: the PID law at the sample time in real numbers, without
//! encoder steps, DAC steps or DAC range.

use plant::PidGains;

use super::Setpoint;
use crate::case::Case;
use crate::message::{Command, Measurement};

/// The sum of the three terms and its memory, shared by the rungs in f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pid {
    gains: PidGains,
    sample_time_s: f64,
    /// `S = Σ e·Δt` \[counts·s\].
    sum: f64,
    previous_error: Option<f64>,
}

impl Pid {
    pub(crate) fn new(case: &Case, period_ns: u64) -> Self {
        Self {
            gains: case.controller.gains,
            sample_time_s: crate::time::seconds(period_ns),
            sum: 0.0,
            previous_error: None,
        }
    }

    /// `y = K_p·e + K_i·S + K_d·(e − e_prev)/Δt` \[codes\], eq. 23 sampled. The
    /// order of the operations is part of the law: decimal gains on whole
    /// counts put y + ½ exactly on integers, and another order moves codes.
    pub(crate) fn output(&mut self, e: f64) -> f64 {
        let (kp, ki, kd) = (self.gains.kp, self.gains.ki_per_s, self.gains.kd_s);
        let e_prev = self.previous_error.replace(e).unwrap_or(e);
        self.sum += e * self.sample_time_s;
        ((kp * e) + (ki * self.sum)) + ((kd * (e - e_prev)) / self.sample_time_s)
    }
}

/// The controller of rung `sampled`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledLaw {
    setpoint: Setpoint,
    pid: Pid,
}

impl SampledLaw {
    pub(crate) fn new(case: &Case, period_ns: u64) -> Self {
        Self {
            setpoint: Setpoint::new(case, period_ns),
            pid: Pid::new(case, period_ns),
        }
    }

    pub(crate) fn step(&mut self, measurement: Measurement) -> Command {
        let Measurement {
            tick,
            position_counts,
        } = measurement;
        let error_counts = self.setpoint.position_counts(tick) - position_counts;
        Command {
            tick,
            error_counts,
            dac_code: self.pid.output(error_counts),
            out_of_range: false,
        }
    }
}
