//! Rungs `sampled` and `quantised`: the PID law at the sample time in f64, without
//! encoder and converter, or on whole counts with codes within the converter's range.

use std::ops::{Add, Div, Mul, Sub};

use plant::Dac;

use super::setpoint::Setpoint;
use crate::case::Case;
use crate::message::{Command, Measurement, Steps, whole};
use crate::time::seconds;

/// The sum of the three terms and its memory. `V` is one number, or one for each
/// of the runs that are computed side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pid<V> {
    /// `K_p`, `K_i` and `K_d`.
    gains: [V; 3],
    sample_time_s: V,
    /// `S = Σ e·Δt` \[counts·s\].
    sum: V,
    previous_error: Option<V>,
}

impl<V> Pid<V>
where
    V: Copy + Add<Output = V> + Sub<Output = V> + Mul<Output = V> + Div<Output = V>,
{
    /// `gains` are K_p, K_i and K_d, `zero` is the sum at the start.
    #[inline(always)]
    pub fn from_parts(gains: [V; 3], sample_time_s: V, zero: V) -> Self {
        Self {
            gains,
            sample_time_s,
            sum: zero,
            previous_error: None,
        }
    }

    /// `y = K_p·e + K_i·S + K_d·(e − e_prev)/Δt` \[codes\], eq. 23 sampled. The
    /// order of the operations is part of the law: decimal gains on whole
    /// counts put y + ½ exactly on integers, and another order moves codes.
    #[inline(always)]
    pub fn output(&mut self, e: V) -> V {
        let [kp, ki, kd] = self.gains;
        let e_prev = self.previous_error.replace(e).unwrap_or(e);
        self.sum = self.sum + e * self.sample_time_s;
        ((kp * e) + (ki * self.sum)) + ((kd * (e - e_prev)) / self.sample_time_s)
    }
}

/// The controller of rungs `sampled` and `quantised`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledLaw {
    setpoint: Setpoint,
    pid: Pid<f64>,
    dac: Dac,
}

impl SampledLaw {
    /// The controller of `case` before its first sample.
    pub fn new(case: &Case, period_ns: u64) -> Self {
        let gains = &case.controller.gains;
        let gains = [gains.kp, gains.ki_per_s, gains.kd_s];
        Self {
            setpoint: Setpoint::new(case, period_ns),
            pid: Pid::from_parts(gains, seconds(period_ns), 0.0),
            dac: case.dac,
        }
    }

    /// One sample: whole counts give a whole code, a real position a real one.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        let tick = measurement.tick;
        let error_counts = match measurement.position_counts {
            Steps::Real(position) => Steps::Real(self.setpoint.position_counts(tick) - position),
            Steps::Whole(count) => Steps::Whole(self.setpoint.count(tick).saturating_sub(count)),
        };
        let y = self.pid.output(error_counts.real());
        let dac_code = match error_counts {
            Steps::Real(_) => Steps::Real(y),
            // code = clamp(floor(y + ½), −2^(n−1), 2^(n−1) − 1)
            Steps::Whole(_) => {
                let (lowest, highest) = (self.dac.code_min(), self.dac.code_max());
                Steps::Whole(whole((y + 0.5).floor()).clamp(lowest.into(), highest.into()))
            }
        };
        Command::new(tick, error_counts, dac_code)
    }
}
