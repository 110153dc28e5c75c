//! Oscillation of a simulated axis at the end of its run.

use super::super::Cycle;
use super::rows;
use crate::case::Case;
use crate::number::seconds;
use crate::trace::Row;

/// The axis at the end of a run.
pub(super) struct Swing {
    /// √2 times the rms around a mean that moves along \[µm\].
    pub(super) carriage_um: f64,
    pub(super) motor_um: f64,
    /// Of the motor; NaN if it does not swing.
    pub(super) period_s: f64,
}

/// The last `seconds_long` of a run; the mean moves along over `mean_over_s`.
pub(super) fn swing(case: &Case, seconds_long: f64, mean_over_s: f64) -> Swing {
    let rows = rows(case);
    let t = seconds(case.controller.sample_time_ns.unwrap());
    let per_rad = 1e6 * case.axis.transmission.screw_pitch_m_per_rad;
    let tail = &rows[rows.len() - (seconds_long / t) as usize..];
    let of = |of: fn(&Row) -> f64| -> (f64, f64) {
        let values: Vec<f64> = tail.iter().map(|row| per_rad * of(row)).collect();
        let window = (mean_over_s / t).round() as usize;
        let moving: Vec<f64> = (window..values.len() - window)
            .map(|i| {
                let around = &values[i - window / 2..i - window / 2 + window];
                values[i] - around.iter().sum::<f64>() / window as f64
            })
            .collect();
        let squares: f64 = moving.iter().map(|x| x * x).sum();
        let amplitude = (2.0 * squares / moving.len() as f64).sqrt();
        (amplitude, t * mean_period(&moving, 0.4 * amplitude))
    };
    let (carriage_um, _) = of(|row| row.gamma_rad);
    let (motor_um, period_s) = of(|row| row.beta_rad);
    Swing {
        carriage_um,
        motor_um,
        period_s,
    }
}

/// Samples from one rise through 0 to the next, each after a dip below −`dip`.
fn mean_period(values: &[f64], dip: f64) -> f64 {
    let (mut rises, mut armed) = (Vec::new(), false);
    for (k, pair) in values.windows(2).enumerate() {
        armed |= pair[0] < -dip;
        if armed && pair[1] >= 0.0 {
            rises.push(k as f64 + pair[0] / (pair[0] - pair[1]));
            armed = false;
        }
    }
    match rises.as_slice() {
        [first, .., last] => (last - first) / (rises.len() - 1) as f64,
        _ => f64::NAN,
    }
}

pub(super) fn off(measured: f64, predicted: f64) -> f64 {
    predicted / measured - 1.0
}

pub(super) fn report(name: &str, cycle: &Cycle, swing: &Swing) -> [f64; 3] {
    let errors = [
        off(swing.carriage_um, cycle.amplitude_um),
        off(swing.motor_um, cycle.motor_amplitude_um),
        off(swing.period_s, cycle.period_s),
    ];
    println!(
        "{name}: carriage {:.3} µm for {:.3} ({:+.0} %), motor {:.3} for {:.3} ({:+.0} %), period \
         {:.2} ms for {:.2} ({:+.0} %), distortion {:.2}",
        cycle.amplitude_um,
        swing.carriage_um,
        100.0 * errors[0],
        cycle.motor_amplitude_um,
        swing.motor_um,
        100.0 * errors[1],
        1e3 * cycle.period_s,
        1e3 * swing.period_s,
        100.0 * errors[2],
        cycle.distortion
    );
    errors
}
