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
//!
//! # In the gap of the joint
//!
//! `Ψ = (k + c·d/dt) dz(ε)` becomes `ν(A)·(k·ε + c·ε̇)`, [`joint_share`], and the
//! axis a linear one whose joint grows stiffer with the amplitude. It predicts
//! a motor that hunts between the flanks because it is not stable alone. A load
//! that drifts through the gap and is thrown back is no sine, and the distortion
//! says so.
//!
//! # By steps of encoder or converter
//!
//! Each is looked at with the other and the gap left out.
//!
//! `e = r − floor(K_enc·α)` and `code = floor(y + ½)` are staircases with the
//! gain of [`quantiser`]. An integrator in the loop fixes the mean of what leaves
//! it: that of the codes is the code that holds the constant resistance, that of
//! e is 0 with K_i and the holding code over K_p without. A mean between two
//! steps makes a relay of the staircase, and then there is a cycle wherever the
//! loop has a gain margin at all; a whole mean leaves room to rest.
//!
//! An axis with a gap and no weight stands in the gap: the motor cycles
//! alone and the carriage does not move. Where the motor would reach the flanks
//! there is no prediction.

use core::f64::consts::PI;

use nalgebra::Complex;

use super::characteristic::{Characteristic, LoopGains, is_papers_loop};
use super::delay::DelayedLoop;
use super::family::LoopFamily;
use super::linear_axis::{JointState, LinearAxis};
use crate::case::{Case, Law};
use crate::number::seconds;
use crate::options::Quantiser;

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
    fn new(
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
fn prediction(cycles: &[Cycle], case: &Case, shortest_s: f64) -> Option<Cycle> {
    let amplifier = &case.amplifier;
    let range_v = match case.controller.law {
        Law::Continuous | Law::Sampled => f64::INFINITY,
        Law::Quantised | Law::Firmware => {
            amplifier.gain * case.dac.output_v(f64::from(case.dac.code_max()))
        }
    };
    let limit_v = amplifier.limit().min(range_v);
    let mut fitting = cycles.iter().filter(|cycle| {
        cycle.stability == CycleStability::Attracting
            && cycle.distortion <= MOST_DISTORTION
            && cycle.voltage_v <= limit_v
            && cycle.period_s >= shortest_s
    });
    fitting.next_back().copied()
}

/// The cycles at the borders of stability on the way to larger amplitudes: where it
/// changes between neighbours of `amplitudes`, found by halving.
fn at_borders(
    amplitudes: &[f64],
    is_stable: impl Fn(f64) -> bool,
    cycle: impl Fn(f64, CycleStability) -> Option<Cycle>,
) -> Vec<Cycle> {
    let mut found = Vec::new();
    let states: Vec<bool> = amplitudes.iter().map(|&at| is_stable(at)).collect();
    for (pair, state) in amplitudes.windows(2).zip(states.windows(2)) {
        let stability = match state {
            [false, true] => CycleStability::Attracting,
            [true, false] => CycleStability::Repelling,
            _ => continue,
        };
        let border = halved([pair[0], pair[1]], 45, |at| is_stable(at) == state[0]);
        found.extend(cycle(border, stability));
    }
    found
}

/// The place, after so many halvings, up to which `is_before` holds.
fn halved([mut low, mut high]: [f64; 2], times: u32, is_before: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..times {
        let middle = 0.5 * (low + high);
        match is_before(middle) {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

/// Points from `low` to `high`, `per_decade` of them to each.
fn decades(low: f64, high: f64, per_decade: u32) -> Vec<f64> {
    let ratio = libm::exp10(1.0 / f64::from(per_decade));
    core::iter::successors(Some(low), |at| Some(at * ratio))
        .take_while(|at| *at < high * (1.0 + 1e-9))
        .collect()
}

/// The predicted cycle in the gap: of [`gap_cycles`] the largest that attracts
/// and fulfils its conditions. About a millisecond; 20 on rung
/// `continuous`.
pub fn gap_cycle(case: &Case) -> Option<Cycle> {
    prediction(&gap_cycles(case), case, 0.0)
}

/// All cycles in the gap, by rising amplitude in the joint; with `no_pull` as if
/// a separating flank could pull. Empty without a gap, with a constant or
/// quadratic resistance (the joint then rests on a flank, or sticks), and where
/// the loop is not the paper's ([`is_papers_loop`]). Encoder and converter count
/// as without steps.
pub fn gap_cycles(case: &Case) -> Vec<Cycle> {
    let resistance = &case.axis.carriage.resistance;
    let odd = resistance.constant_n == 0.0
        && resistance.quadratic_ns2_per_rad2 == 0.0
        && case.resting_force_n() == 0.0;
    let b = case.axis.transmission.joint.backlash_half_rad();
    let delayed = DelayedLoop::of(case, JointState::Contact);
    let Some(delayed) = delayed.filter(|_| b > 0.0 && odd && is_papers_loop(case)) else {
        return Vec::new();
    };
    let axis = delayed.axis;
    // The amplitude as A/b − 1, which resolves a contact of any depth.
    let softened = |depth: f64| DelayedLoop {
        axis: axis.with_share_of_joint(joint_share(1.0 / (1.0 + depth))),
        ..delayed
    };
    let sampled = case.controller.law != Law::Continuous;
    let is_stable = |depth: f64| {
        let soft = softened(depth);
        if !sampled {
            return soft.margin().stable;
        }
        Characteristic::new(&soft.axis, soft.period_s, soft.delay_s).is_stable(&soft.gains)
    };
    let cycle = |depth: f64, stability: CycleStability| {
        let soft = softened(depth);
        let margin = if sampled {
            LoopFamily::of_axis(&soft.axis, soft.period_s, soft.delay_s).margin(&soft.gains)
        } else {
            soft.margin()
        };
        let radps = margin.weakest_radps;
        let s = Complex::new(0.0, radps);
        let screw_rad = b * (1.0 + depth) * soft.axis.screw_per_joint(s)?.norm_sqr().sqrt();
        let gear_rad = screw_rad / soft.axis.screw_per_gear(s).norm_sqr().sqrt();
        // What the third harmonic of the deflection makes of ε, over A − b.
        let third = deflection_third(1.0 / (1.0 + depth)) * (1.0 + depth) / depth;
        let law = delayed.law(3.0 * radps) / axis.gear_ratio;
        let back = axis.joint_response(Complex::new(0.0, 3.0 * radps), law)?;
        let volts_per_rad = delayed.law(radps).norm_sqr().sqrt() / axis.gear_ratio;
        Some(Cycle::new(
            &axis,
            [screw_rad, gear_rad, gear_rad * volts_per_rad],
            radps,
            stability,
            third * back.norm_sqr().sqrt(),
        ))
    };
    at_borders(&decades(1e-4, 1e4, 12), is_stable, cycle)
}

/// The predicted cycle of the encoder's steps: of [`encoder_cycles`] the
/// largest that attracts and fulfils its conditions.
pub fn encoder_cycle(case: &Case) -> Option<Cycle> {
    predicted(case, &encoder_cycles(case))
}

/// The predicted cycle of the converter's steps: of [`dac_cycles`] the largest
/// that attracts and fulfils its conditions.
pub fn dac_cycle(case: &Case) -> Option<Cycle> {
    predicted(case, &dac_cycles(case))
}

/// All cycles of the encoder's steps up to four counts, the smallest first. Empty
/// on rungs without steps, with dry friction (the axis sticks), and where the
/// loop is not the paper's ([`is_papers_loop`]). A tenth of
/// a millisecond; up to two with a weight.
pub fn encoder_cycles(case: &Case) -> Vec<Cycle> {
    let Some(mut stepped) = SteppedLoop::of(case) else {
        return Vec::new();
    };
    let gains = &case.controller.gains;
    let holds = gains.ki_per_s == 0.0;
    stepped.mean = if holds { stepped.mean / gains.kp } else { 0.0 };
    let rad_per_count = 1.0 / case.encoder.counts_per_rad;
    stepped.cycles(|amplitude, _| amplitude * rad_per_count)
}

/// All cycles of the converter's steps up to four codes, the smallest first.
/// Empty as [`encoder_cycles`], and with a quantiser that rounds to other than
/// the nearest code.
pub fn dac_cycles(case: &Case) -> Vec<Cycle> {
    let nearest =
        case.controller.law != Law::Firmware || case.options.law.quantiser == Quantiser::Nearest;
    let Some(stepped) = SteppedLoop::of(case).filter(|_| nearest) else {
        return Vec::new();
    };
    let volts_per_code = case.dac.step_v * case.amplifier.gain;
    stepped.cycles(|amplitude, radps| {
        // y = −C·α, and A is the amplitude of y.
        let period_s = stepped.family.period_s;
        let law = stepped.gains.law(radps * period_s, period_s);
        amplitude * volts_per_code / law.norm_sqr().sqrt()
    })
}

fn predicted(case: &Case, cycles: &[Cycle]) -> Option<Cycle> {
    let period_s = seconds(case.controller.sample_time_ns?);
    prediction(cycles, case, FEWEST_SAMPLES * period_s)
}

/// A loop with one staircase.
struct SteppedLoop {
    family: LoopFamily,
    gains: LoopGains,
    /// Mean of what leaves the staircase, in its steps; at first that of the
    /// codes.
    mean: f64,
    /// Half the gap that the motor has for itself; `None` where the joint is
    /// closed.
    room_rad: Option<f64>,
}

impl SteppedLoop {
    /// The loop around the axis at rest.
    fn of(case: &Case) -> Option<Self> {
        let resistance = &case.axis.carriage.resistance;
        let sticks = resistance.opposes_motion && resistance.constant_n != 0.0;
        let whole = matches!(case.controller.law, Law::Quantised | Law::Firmware);
        if sticks || !whole || !is_papers_loop(case) {
            return None;
        }
        let (transmission, motor) = (&case.axis.transmission, &case.axis.motor);
        let weight_n = resistance.constant_n + case.resting_force_n();
        let b = transmission.joint.backlash_half_rad();
        let room_rad = (b > 0.0 && weight_n == 0.0).then_some(b);
        let joint = match room_rad {
            Some(_) => JointState::Gap,
            None => JointState::Contact,
        };
        // p·F = k_m·I/z holds it, and V = R·I.
        let current_a = transmission.screw_pitch_m_per_rad * weight_n * transmission.gear_ratio
            / motor.torque_constant_nm_per_a;
        let holding = match case.amplifier.is_current_drive() {
            true => current_a,
            false => motor.resistance_ohm * current_a,
        };
        Some(Self {
            family: LoopFamily::of(case, joint)?,
            gains: LoopGains::of(case),
            mean: holding / (case.dac.step_v * case.amplifier.gain),
            room_rad,
        })
    }

    /// The cycles; `motor_rad` is the amplitude of α for that of the
    /// staircase's input and a frequency.
    fn cycles(&self, motor_rad: impl Fn(f64, f64) -> f64) -> Vec<Cycle> {
        let bias = |amplitude: f64| quantiser_bias(amplitude, self.mean);
        let gain_at = |amplitude: f64| quantiser(amplitude, bias(amplitude)).1;
        let is_stable = |amplitude: f64| {
            let gain = gain_at(amplitude);
            // Below the first threshold nothing moves.
            gain == 0.0 || self.family.is_stable(&self.gains.times(gain))
        };
        let (axis, period_s) = (&self.family.axis, self.family.period_s);
        let mut amplitudes = decades(1e-4, 0.1, 12);
        amplitudes.extend((11..=400).map(|n| 0.01 * f64::from(n)));
        let cycle = |amplitude: f64, stability: CycleStability| {
            let gains = self.gains.times(gain_at(amplitude));
            let radps = self.family.margin(&gains).weakest_radps;
            let motor_rad = motor_rad(amplitude, radps);
            let gear_rad = motor_rad * axis.gear_ratio;
            let law = gains.law(radps * period_s, period_s);
            let voltage_v = motor_rad * law.norm_sqr().sqrt();
            let screw_rad = match self.room_rad {
                Some(room_rad) if gear_rad > room_rad => return None,
                Some(_) => 0.0,
                None => {
                    let s = Complex::new(0.0, radps);
                    gear_rad * axis.screw_per_gear(s).norm_sqr().sqrt()
                }
            };
            Some(Cycle::new(
                axis,
                [screw_rad, gear_rad, voltage_v],
                radps,
                stability,
                self.distortion(amplitude, radps * period_s),
            ))
        };
        at_borders(&amplitudes, is_stable, cycle)
    }

    /// Second and third harmonic after a round through the loop, over A.
    fn distortion(&self, amplitude: f64, theta: f64) -> f64 {
        let bias = quantiser_bias(amplitude, self.mean);
        let [second, third] = quantiser_harmonics(amplitude, bias);
        let back = |n: f64| self.family.at(&self.gains, n * theta).norm_sqr();
        let squares = second * second * back(2.0) + third * third * back(3.0);
        squares.sqrt() / amplitude
    }
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
    let is_before = |bias| quantiser(amplitude, bias).0 < mean;
    halved([mean - 1.0, mean + 1.0], 50, is_before)
}
