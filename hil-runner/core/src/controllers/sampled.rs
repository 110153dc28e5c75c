//! Rung `sampled`: the PID law at the sample time in real numbers, without
//! encoder steps, DAC steps or DAC range.

use std::ops::{Add, Div, Mul, Sub};

use super::Setpoint;
use crate::case::Case;
use crate::message::{Command, Measurement};

/// The sum of the three terms and its memory, shared by the rungs in f64. `V`
/// is one number, or one for each of the runs that are computed side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pid<V> {
    /// `K_p`, `K_i` and `K_d`.
    gains: [V; 3],
    sample_time_s: V,
    /// `S = Σ e·Δt` \[counts·s\].
    sum: V,
    previous_error: Option<V>,
}

impl Pid<f64> {
    /// The law with the gains of `case`.
    pub fn new(case: &Case, period_ns: u64) -> Self {
        let gains = &case.controller.gains;
        Self::from_parts(
            [gains.kp, gains.ki_per_s, gains.kd_s],
            crate::time::seconds(period_ns),
            0.0,
        )
    }
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

/// The controller of rung `sampled`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledLaw {
    setpoint: Setpoint,
    pid: Pid<f64>,
}

impl SampledLaw {
    pub fn new(case: &Case, period_ns: u64) -> Self {
        Self {
            setpoint: Setpoint::new(case, period_ns),
            pid: Pid::new(case, period_ns),
        }
    }

    pub fn step(&mut self, measurement: Measurement) -> Command {
        let Measurement {
            tick,
            position_counts,
            ..
        } = measurement;
        let error_counts = self.setpoint.position_counts(tick) - position_counts;
        Command {
            tick,
            error_counts,
            dac_code: self.pid.output(error_counts),
            out_of_range: false,
            execution: None,
            axis: None,
        }
    }
}
