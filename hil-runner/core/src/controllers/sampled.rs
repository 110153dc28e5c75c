//! Rungs `sampled` and `quantised`: the PID law at the sample time in f64, without
//! encoder and converter, or on whole counts with codes within the converter's range.

use std::ops::{Add, Div, Mul, Sub};

use plant::Dac;

use super::setpoint::Setpoint;
use crate::case::Case;
use crate::message::{Command, Measurement, Steps, whole};
use crate::number::seconds;

/// The sum of the three terms. `V` is one number, or one for each of the runs that
/// are computed side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pid<V> {
    /// `K_p`, `K_i` and `K_d`.
    gains: [V; 3],
    /// `Δt` \[s\].
    sample_time_s: V,
    /// `k₁ = (K_p + K_i·Δt) + K_d/Δt` and `K_d/Δt`.
    folded: [V; 2],
}

/// Memory of the sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PidState<V> {
    /// `S = Σ e·Δt` \[counts·s\].
    sum: V,
    previous_error: Option<V>,
}

impl<V> PidState<V> {
    /// Before the first sample, where the sum is `zero`.
    #[inline(always)]
    pub fn new(zero: V) -> Self {
        Self {
            sum: zero,
            previous_error: None,
        }
    }
}

impl<V> Pid<V>
where
    V: Copy + Add<Output = V> + Sub<Output = V> + Mul<Output = V> + Div<Output = V>,
{
    /// With `K_p`, `K_i` \[1/s\] and `K_d` \[s\], and Δt \[s\].
    #[inline(always)]
    pub fn new(gains: [V; 3], sample_time_s: V) -> Self {
        let [kp, ki, kd] = gains;
        let kd_per_sample = kd / sample_time_s;
        Self {
            gains,
            sample_time_s,
            folded: [(kp + ki * sample_time_s) + kd_per_sample, kd_per_sample],
        }
    }

    /// `y = K_p·e + K_i·S + K_d·(e − e_prev)/Δt` \[codes\], eq. 23 sampled. The
    /// order of the operations is part of the law: decimal gains on whole
    /// counts put y + ½ exactly on integers, and another order moves codes.
    #[inline(always)]
    pub fn output(&self, state: &mut PidState<V>, e: V) -> V {
        let [kp, ki, kd] = self.gains;
        let e_prev = self.take(state, e);
        ((kp * e) + (ki * state.sum)) + ((kd * (e - e_prev)) / self.sample_time_s)
    }

    /// Takes an error into the sum; returns the one before it.
    #[inline(always)]
    pub(crate) fn take(&self, state: &mut PidState<V>, e: V) -> V {
        state.sum = state.sum + e * self.sample_time_s;
        state.previous_error.replace(e).unwrap_or(e)
    }

    /// `y = k₁·e + (K_i·S − K_d/Δt·e_prev)` with the sum S before this sample: the same
    /// but for rounding, with one product and one sum after the error.
    #[inline(always)]
    pub fn folded(&self, state: &PidState<V>, e: V) -> Folded<V> {
        let [_, ki, _] = self.gains;
        let [k1, kd_per_sample] = self.folded;
        let e_prev = state.previous_error.unwrap_or(e);
        Folded {
            proportional: k1 * e,
            integral: ki * state.sum,
            derivative: kd_per_sample * e_prev,
        }
    }
}

/// The terms of the folded sum.
#[derive(Debug, Clone, Copy)]
pub struct Folded<V> {
    /// `k₁·e`.
    pub proportional: V,
    /// `K_i·S`.
    pub integral: V,
    /// `K_d/Δt·e_prev`.
    pub derivative: V,
}

/// The controller of rungs `sampled` and `quantised`.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledLaw {
    setpoint: Setpoint,
    pid: Pid<f64>,
    dac: Dac,
    state: PidState<f64>,
}

impl SampledLaw {
    /// The controller of `case` before its first sample.
    pub fn new(case: &Case, period_ns: u64) -> Self {
        let gains = &case.controller.gains;
        Self {
            setpoint: Setpoint::new(case, period_ns),
            pid: Pid::new([gains.kp, gains.ki_per_s, gains.kd_s], seconds(period_ns)),
            dac: case.dac,
            state: PidState::new(0.0),
        }
    }

    /// One sample: whole counts give a whole code, a real position a real one.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        let tick = measurement.tick;
        let error_counts = match measurement.position_counts {
            Steps::Real(position) => Steps::Real(self.setpoint.position_counts(tick) - position),
            Steps::Whole(count) => Steps::Whole(self.setpoint.count(tick).saturating_sub(count)),
        };
        let y = self.pid.output(&mut self.state, error_counts.real());
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
