//! Limit cycles predicted by describing functions.
//!
//! The nonlinearity is replaced by its gain N(A) for a sine of amplitude A;
//! where the linear sampled loop with that gain has a pole on the unit circle,
//! −1/N meets `L(e^{jωΔt})` and the sine sustains itself (Gelb and Vander
//! Velde, 3; Slotine and Li, 5.3). Unstable for smaller A and stable for larger,
//! the cycle attracts; the other way round it repels.
//!
//! That holds where what comes back to the nonlinearity is a sine: its harmonics
//! are made and filtered by the loop, so how much of them comes back is known,
//! [`Cycle::distortion`]. Where it is too much there is no prediction. An
//! attracting cycle need not be reached: the axis may come to rest beside it.
//!
//! The gains N(A) of joint and staircase stand at the end: Gelb and Vander Velde,
//! "Multiple-Input Describing Functions and Nonlinear System Design", 1968, 2.3 and
//! appendix B; Slotine and Li, "Applied Nonlinear Control", 5.

use core::f64::consts::PI;

use super::linear_axis::LinearAxis;
use crate::case::{Case, Law};

/// A predicted limit cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Amplitude of the carriage, half of peak to peak \[µm\].
    pub amplitude_um: f64,
    /// Amplitude of the motor as the carriage would move without a joint,
    /// `p·β` \[µm\].
    pub motor_amplitude_um: f64,
    /// Period \[s\].
    pub period_s: f64,
    /// Amplitude of the motor voltage \[V\]; limits are not counted with.
    pub voltage_v: f64,
    /// Stability.
    pub stability: CycleStability,
    /// Harmonics that come back to the nonlinearity, over what it sees of the
    /// fundamental: A for steps, `A − b` for a gap. The theory takes them for
    /// 0; with more than [`MOST_DISTORTION`] it says nothing.
    pub distortion: f64,
}

/// Fate of motions that are not quite the cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CycleStability {
    /// They come to it.
    Attracting,
    /// They leave it: smaller ones die away, larger ones grow.
    Repelling,
}

/// Largest distortion of a cycle that is taken for a prediction. Of the cycles
/// in a gap that were simulated those up to 6.9 were there, with a period that
/// was off by 1 % (distortion 0.01) to 38 % (0.97); those from 12 on were not.
pub const MOST_DISTORTION: f64 = 3.0;

/// Fewest samples in a period of a cycle of steps that is taken for a
/// prediction: the staircase sees nothing but them, and fewer are no sine. The
/// joint sees the axis between the samples too.
pub const FEWEST_SAMPLES: f64 = 8.0;

impl Cycle {
    /// A cycle from the amplitudes of γ, β and V.
    pub(crate) fn new(
        axis: &LinearAxis,
        [screw_rad, gear_rad, voltage_v]: [f64; 3],
        radps: f64,
        stability: CycleStability,
        distortion: f64,
    ) -> Self {
        Self {
            amplitude_um: 1e6 * axis.pitch_m_per_rad * screw_rad,
            motor_amplitude_um: 1e6 * axis.pitch_m_per_rad * gear_rad,
            period_s: 2.0 * PI / radps,
            voltage_v,
            stability,
            distortion,
        }
    }
}

/// The last of the cycles that attract, are a sine, and stay within the voltage
/// and above the period given: what decays from a motion meets it first.
pub(crate) fn prediction(cycles: &[Cycle], case: &Case, shortest_s: f64) -> Option<Cycle> {
    let amplifier = &case.amplifier;
    let range_v = match case.controller.law {
        Law::Continuous | Law::Sampled => f64::INFINITY,
        Law::Quantised | Law::Firmware => {
            amplifier.gain * case.dac.output_v(f64::from(case.dac.code_max()))
        }
    };
    let limit_v = amplifier.voltage_limit_v.min(range_v);
    let mut fitting = cycles.iter().filter(|cycle| {
        cycle.stability == CycleStability::Attracting
            && cycle.distortion <= MOST_DISTORTION
            && cycle.voltage_v <= limit_v
            && cycle.period_s >= shortest_s
    });
    fitting.next_back().copied()
}

/// A border of stability on the way to larger amplitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Border {
    pub(crate) amplitude: f64,
    pub(crate) stability: CycleStability,
}

/// Borders at which `is_stable` changes between neighbours of `amplitudes`, by halving.
pub(crate) fn borders(amplitudes: &[f64], is_stable: impl Fn(f64) -> bool) -> Vec<Border> {
    let mut found = Vec::new();
    let states: Vec<bool> = amplitudes.iter().map(|&at| is_stable(at)).collect();
    for (pair, state) in amplitudes.windows(2).zip(states.windows(2)) {
        let (&[mut low, mut high], &[before, after]) = (pair, state) else {
            continue;
        };
        if before == after {
            continue;
        }
        for _ in 0..45 {
            let middle = 0.5 * (low + high);
            if is_stable(middle) == before {
                low = middle;
            } else {
                high = middle;
            }
        }
        found.push(Border {
            amplitude: 0.5 * (low + high),
            stability: if after {
                CycleStability::Attracting
            } else {
                CycleStability::Repelling
            },
        });
    }
    found
}

/// Points from `low` to `high`, `per_decade` of them to each.
pub(crate) fn decades(low: f64, high: f64, per_decade: u32) -> Vec<f64> {
    let ratio = libm::exp10(1.0 / f64::from(per_decade));
    core::iter::successors(Some(low), |at| Some(at * ratio))
        .take_while(|at| *at < high * (1.0 + 1e-9))
        .collect()
}

/// Share of a joint's stiffness and damping that acts on the fundamental of
/// `ε = A·sin φ` with a gap of ±b, `ratio = r = b/A`:
///
/// ```text
/// ν = 1 − 2/π·(asin r + r·√(1 − r²)),   0 for r ≥ 1
/// ```
///
/// It is the dead zone's. The damper acts while the flanks touch, so that the
/// torque of eq. 8-10 is `Ψ = (k + c·d/dt) dz(ε)` with the flanks' deflection
/// `dz(ε) = max(|ε| − b, 0)·sign ε`: one share serves both.
pub fn joint_share(ratio: f64) -> f64 {
    if ratio >= 1.0 {
        return 0.0;
    }
    let cosine = (1.0 - ratio * ratio).sqrt();
    1.0 - 2.0 / PI * (libm::asin(ratio) + ratio * cosine)
}

/// Third harmonic of `dz(A·sin φ)` over A: `4/(3π)·r·(1 − r²)^(3/2)`.
pub(crate) fn deflection_third(ratio: f64) -> f64 {
    let inside = (1.0 - ratio * ratio).max(0.0);
    4.0 / (3.0 * PI) * ratio * inside * inside.sqrt()
}

/// Mean of `floor(B + A·sin φ + ½)`, steps of 1, and its gain for the
/// fundamental: its amplitude over A. The gain is 4/π at most around a whole B;
/// between two it grows without bound as A falls, as that of a relay.
///
/// A threshold t is passed for the share `½ − asin(h)/π` of the period,
/// `h = (t − B)/A`, and adds `2/π·√(1 − h²)` to the fundamental.
pub fn quantiser(amplitude: f64, bias: f64) -> (f64, f64) {
    let mut mean = (bias - amplitude + 0.5).floor();
    let mut fundamental = 0.0;
    each_threshold(amplitude, bias, |height, phase| {
        mean += 0.5 - phase / PI;
        fundamental += 2.0 / PI * (1.0 - height * height).sqrt();
    });
    if fundamental == 0.0 {
        return (mean, 0.0);
    }
    (mean, fundamental / amplitude)
}

/// Amplitudes of the second and third harmonic of `floor(B + A·sin φ + ½)`.
pub(crate) fn quantiser_harmonics(amplitude: f64, bias: f64) -> [f64; 2] {
    let (mut second, mut third) = (0.0, 0.0);
    each_threshold(amplitude, bias, |_, phase| {
        second += libm::sin(2.0 * phase) / PI;
        third += 2.0 / (3.0 * PI) * libm::cos(3.0 * phase);
    });
    [second.abs(), third.abs()]
}

/// Every threshold in reach: `h` and the phase `asin h` at which it is passed.
fn each_threshold(amplitude: f64, bias: f64, mut found: impl FnMut(f64, f64)) {
    let mut threshold = (bias - amplitude + 0.5).floor() + 0.5;
    while threshold < bias + amplitude {
        let height = ((threshold - bias) / amplitude).clamp(-1.0, 1.0);
        found(height, libm::asin(height));
        threshold += 1.0;
    }
}

/// The bias B at which the mean of the quantiser is `mean`, for an amplitude
/// above 0: the mean rises with B without a jump, and is B where 2·B is whole.
pub fn quantiser_bias(amplitude: f64, mean: f64) -> f64 {
    if 2.0 * mean == (2.0 * mean).floor() {
        return mean;
    }
    let (mut low, mut high) = (mean - 1.0, mean + 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if quantiser(amplitude, middle).0 < mean {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
