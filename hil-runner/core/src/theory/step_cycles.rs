//! Limit cycles of the encoder's and of the converter's steps, each with the
//! other and the gap left out.
//!
//! `e = r − floor(K_enc·α)` and `code = floor(y + ½)` are staircases with the
//! gain of [`quantiser`]. An integrator in the loop fixes the mean of what leaves
//! it: that of the codes is the code that holds the constant resistance, that of
//! e is 0 with K_i and the holding code over K_p without. A mean between two
//! steps makes a relay of the staircase, and then there is a cycle wherever the
//! loop has a gain margin at all; a whole mean leaves room to rest.
//!
//! An axis with a gap and no weight stands with its joint open: the motor cycles
//! alone and the carriage does not move. Where the motor would reach the flanks
//! there is no prediction.

use nalgebra::Complex;
use plant::Joint;

use super::cycles::{
    Border, Cycle, FEWEST_SAMPLES, borders, decades, prediction, quantiser, quantiser_bias,
    quantiser_harmonics,
};
use super::family::LoopFamily;
use super::gains::{LoopGains, is_papers_loop};
use super::linear_axis::{JointState, LinearAxis};
use crate::case::{Case, Law};
use crate::options::Quantiser;
use crate::time::seconds;

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
    stepped.mean = if gains.ki_per_s == 0.0 {
        stepped.mean / gains.kp
    } else {
        0.0
    };
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
        let law = stepped
            .gains
            .law(radps * stepped.period_s, stepped.period_s);
        amplitude * volts_per_code / law.norm_sqr().sqrt()
    })
}

fn predicted(case: &Case, cycles: &[Cycle]) -> Option<Cycle> {
    let period_s = seconds(case.controller.sample_time_ns?);
    prediction(cycles, case, FEWEST_SAMPLES * period_s)
}

/// A loop with one staircase.
struct SteppedLoop {
    axis: LinearAxis,
    family: LoopFamily,
    gains: LoopGains,
    period_s: f64,
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
        let weight_n = resistance.constant_n;
        let room_rad = match transmission.joint {
            Joint::Elastic(joint) if joint.backlash_half_rad > 0.0 && weight_n == 0.0 => {
                Some(joint.backlash_half_rad)
            }
            _ => None,
        };
        let joint = match room_rad {
            Some(_) => JointState::Open,
            None => JointState::Closed,
        };
        // p·a0 = k_m·I/z and V = R·I hold it.
        let current_a = transmission.screw_pitch_m_per_rad * weight_n * transmission.gear_ratio
            / motor.torque_constant_nm_per_a;
        let holding_v = motor.resistance_ohm * current_a;
        Some(Self {
            axis: LinearAxis::new(&case.axis, joint)?,
            family: LoopFamily::of(case, joint)?,
            gains: LoopGains::of(case),
            period_s: seconds(case.controller.sample_time_ns?),
            mean: holding_v / (case.dac.step_v * case.amplifier.gain),
            room_rad,
        })
    }

    /// The cycles; `motor_rad` is the amplitude of α for that of the
    /// staircase's input and a frequency.
    fn cycles(&self, motor_rad: impl Fn(f64, f64) -> f64) -> Vec<Cycle> {
        let gain_at = |amplitude: f64| quantiser(amplitude, self.bias(amplitude)).1;
        let is_stable = |amplitude: f64| {
            let gain = gain_at(amplitude);
            // Below the first threshold nothing moves.
            gain == 0.0 || self.family.is_stable(&self.gains.times(gain))
        };
        let mut amplitudes = decades(1e-4, 0.1, 12);
        amplitudes.extend((11..=400).map(|n| 0.01 * f64::from(n)));
        let cycle = |border: &Border| {
            let amplitude = border.amplitude;
            let gains = self.gains.times(gain_at(amplitude));
            let radps = self.family.margin(&gains).weakest_radps;
            let motor_rad = motor_rad(amplitude, radps);
            let gear_rad = motor_rad * self.axis.gear_ratio;
            let law = gains.law(radps * self.period_s, self.period_s);
            let voltage_v = motor_rad * law.norm_sqr().sqrt();
            let screw_rad = match self.room_rad {
                Some(room_rad) if gear_rad > room_rad => return None,
                Some(_) => 0.0,
                None => {
                    let s = Complex::new(0.0, radps);
                    gear_rad * self.axis.screw_per_gear(s).norm_sqr().sqrt()
                }
            };
            Some(Cycle::new(
                &self.axis,
                [screw_rad, gear_rad, voltage_v],
                radps,
                border.stability,
                self.distortion(amplitude, radps * self.period_s),
            ))
        };
        let found = borders(&amplitudes, is_stable);
        found.iter().filter_map(cycle).collect()
    }

    fn bias(&self, amplitude: f64) -> f64 {
        quantiser_bias(amplitude, self.mean)
    }

    /// Second and third harmonic after a round through the loop, over A.
    fn distortion(&self, amplitude: f64, theta: f64) -> f64 {
        let [second, third] = quantiser_harmonics(amplitude, self.bias(amplitude));
        let back = |n: f64| self.family.at(&self.gains, n * theta).norm_sqr();
        let squares = second * second * back(2.0) + third * third * back(3.0);
        squares.sqrt() / amplitude
    }
}
