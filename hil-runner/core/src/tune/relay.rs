//! A relay in the place of the law, simulated: its oscillation tells the gain and the period
//! at which the loop would oscillate by itself (Åström and Hägglund, "Automatic tuning of
//! simple regulators with specifications on phase and amplitude margins", Automatica 20,
//! 1984).
//!
//! ```text
//! code = d where e > h, −d where e < −h, else as it was
//! K_u = 4·d/(π·√(a² − h²)),   a the amplitude of e
//! ```

use core::f64::consts::PI;

use plant::{Drive, Plant, Solver};

use crate::case::Case;
use crate::message::Measurement;
use crate::number::seconds;

/// Gain and period of the border of stability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// `K_u` \[codes/count\].
    pub gain: f64,
    /// `T_u` \[s\].
    pub period_s: f64,
}

/// Part of the code's and the amplifier's range that the relay uses: enough to cross a gap,
/// far from any limit.
const PART: f64 = 0.1;
/// Hysteresis \[counts\]: above the encoder's own steps.
const HYSTERESIS: f64 = 2.0;
/// Samples after which there is no lasting oscillation.
const MOST_SAMPLES: u64 = 20_000;
/// Periods that have to agree, and by how much.
const PERIODS: usize = 4;
const ALIKE: f64 = 0.05;

/// The oscillation of a case under a relay, from rest.
///
/// # Errors
/// The sentence that says why there is none.
pub fn oscillation(case: &Case) -> Result<Oscillation, String> {
    let none = || "a relay makes no lasting oscillation of this axis".to_owned();
    let [period_ns, delay_ns] = timing_ns(case).ok_or_else(none)?;
    let limit_a = case.amplifier.current_limit_a().unwrap_or(f64::INFINITY);
    let limit = case.amplifier.voltage_limit_v.min(limit_a);
    let of_amplifier = limit / (case.amplifier.gain * case.dac.step_v);
    let size = (PART * of_amplifier.min(f64::from(case.dac.code_max())))
        .max(1.0)
        .floor();
    let solver = match case.axis.is_affine() {
        true => Solver::Exact,
        false => case.solver(),
    };
    let mut plant = Plant::within(&case.axis, &case.surroundings(), solver);
    let command = |code: f64| case.amplifier.command(case.dac.output_v(code));
    let (mut code, mut in_force) = (size, 0.0);
    // Each half period: the sample at its start, and its largest |e|.
    let mut halves: Vec<(u64, f64)> = vec![(0, 0.0)];
    for tick in 0..MOST_SAMPLES {
        let time_ns = tick * period_ns;
        let error = -Measurement::new(case, tick, &plant.state())
            .position_counts
            .real();
        if (code > 0.0 && error < -HYSTERESIS) || (code < 0.0 && error > HYSTERESIS) {
            code = -code;
            halves.push((tick, 0.0));
            if let Some(oscillation) = lasting(&halves, period_ns, size) {
                return Ok(oscillation);
            }
        }
        if let Some((_, largest)) = halves.last_mut() {
            *largest = largest.max(error.abs());
        }
        for (held, until_ns) in [(in_force, time_ns + delay_ns), (code, time_ns + period_ns)] {
            plant
                .advance(&Drive::Held(command(held)), until_ns, &mut ())
                .map_err(|_| none())?;
        }
        in_force = code;
    }
    Err(none())
}

/// The sample time and the delay, a whole sample where it is not known \[ns\].
pub(super) fn timing_ns(case: &Case) -> Option<[u64; 2]> {
    let period_ns = case.controller.sample_time_ns?;
    let delay_ns = case.controller.computation_delay.fixed_ns();
    Some([period_ns, delay_ns.unwrap_or(period_ns)])
}

/// The oscillation, once the last periods agree.
fn lasting(halves: &[(u64, f64)], period_ns: u64, size: f64) -> Option<Oscillation> {
    // The last half has only begun.
    let last = halves.len().checked_sub(1 + 2 * PERIODS)?;
    let halves = &halves[last..];
    let periods = halves
        .windows(3)
        .step_by(2)
        .map(|of| (of[2].0 - of[0].0) as f64);
    let periods: Vec<f64> = periods.collect();
    let amplitudes: Vec<f64> = halves[..2 * PERIODS].iter().map(|half| half.1).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let agree = |values: &[f64]| {
        let mean = mean(values);
        values
            .iter()
            .all(|value| (value - mean).abs() <= ALIKE * mean)
    };
    let amplitude = mean(&amplitudes);
    // Steps of the encoder and the sample are no measure of an oscillation.
    let is_told = amplitude > 2.0 * HYSTERESIS && mean(&periods) >= 6.0;
    (agree(&periods) && agree(&amplitudes) && is_told).then(|| Oscillation {
        gain: 4.0 * size / (PI * (amplitude * amplitude - HYSTERESIS * HYSTERESIS).sqrt()),
        period_s: mean(&periods) * seconds(period_ns),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runfile;
    use crate::theory::{JointState, LoopFamily, LoopGains};
    use plant::PidGains;

    /// The describing function's gain and period: L(jω) = −1 for K_p alone.
    fn border(case: &Case) -> [f64; 2] {
        let family = LoopFamily::of(case, JointState::Contact).unwrap();
        let gains = PidGains {
            kp: 1.0,
            ki_per_s: 0.0,
            kd_s: 0.0,
        };
        let unit = LoopGains::new(&gains, case.output_per_rad());
        let (mut low, mut high) = (1e-3, 1e4);
        while high / low > 1.0 + 1e-9 {
            let middle = f64::sqrt(low * high);
            if family.is_stable(&unit.times(middle)) {
                low = middle
            } else {
                high = middle
            }
        }
        let period_s = seconds(case.controller.sample_time_ns.unwrap());
        // Where L is real and −1.
        let distance = |theta: f64| (family.at(&unit.times(low), theta) + 1.0).norm_sqr();
        let theta = (1..31_000)
            .map(|k| f64::from(k) * 1e-4)
            .min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        [low, 2.0 * PI / theta.unwrap() * period_s]
    }

    /// Without a gap the relay finds the border of theory, to what the describing function
    /// is worth; with another delay that is another one.
    #[test]
    fn a_relay_finds_the_border_of_stability() {
        let sets = |delay: &str| {
            [
                "transmission.joint=rigid",
                "encoder.counts_per_rad=1e5",
                "controller.computation_delay_s=0.002",
                "controller.sample_time_s=0.002",
                delay,
            ]
            .map(str::to_owned)
        };
        let case = runfile::builtin("paper-2", &sets("drive.dac_bits=20")).unwrap();
        let found = oscillation(&case).unwrap();
        let [gain, period_s] = border(&case);
        assert!((found.gain / gain - 1.0).abs() < 0.15, "{found:?} {gain}");
        assert!(
            (found.period_s / period_s - 1.0).abs() < 0.1,
            "{found:?} {period_s}"
        );
        let other = runfile::builtin("paper-2", &sets("controller.computation_delay_s=0")).unwrap();
        let [gain, period_s] = border(&other);
        assert!(
            (found.gain / gain - 1.0).abs() > 0.3 && (found.period_s / period_s - 1.0).abs() > 0.2
        );
    }
}
