//! Whether an axis at rest swings regularly and goes on doing so.
//!
//! A ripple is a limit cycle if all of this holds:
//!
//! 1. It is an oscillation: it crosses the middle between its extremes upwards
//!    at least four times, three periods. A crossing counts once the residual
//!    has been below the middle by a quarter of the half swing and is above it
//!    by as much, so that neither noise nor the steps of an encoder count twice.
//! 2. It is sustained: the second half of the window swings at least half as
//!    far as the first.
//! 3. It is regular: nine periods of ten are within a quarter of their median,
//!    and the mean of the later half of them is within 15 % of the earlier's. A
//!    step that rings out fails rule 2, noise the first part and a chirp the
//!    second part of this one.
//! 4. It is larger than rounding: 1e-6 µm.
//!
//! The extremes' middle and not the line: an axis that sticks for most of the
//! period and slips in the rest keeps close to the line for nearly all of it.

use super::ripple::{Residual, count};

/// Share of the half swing that a crossing goes beyond the middle, on both sides.
const HYSTERESIS: f64 = 0.25;

/// Upward crossings of three periods.
const FEWEST_CROSSINGS: usize = 4;

/// Swing of the second half in units of the first's, at least.
const SUSTAINED: f64 = 0.5;

/// How far a regular period is from the median, at most, and of ten periods how
/// many are regular.
const REGULAR: f64 = 0.25;
const REGULAR_OF_TEN: usize = 9;

/// Change of the mean period from the earlier half of the periods to the later.
const DRIFT: f64 = 0.15;

/// Half swing of rounding \[m\]: 10⁴ times that of a position of a metre.
const ROUNDING_M: f64 = 1e-12;

/// The period of a limit cycle \[samples\]; `None` if it is none.
pub(super) fn period_samples(residual: &Residual) -> Option<f64> {
    // A residual that is not a number has no crossings.
    if residual.half_swing_m() <= ROUNDING_M {
        return None;
    }
    let crossings = upward_crossings(residual);
    if crossings.len() < FEWEST_CROSSINGS || !is_sustained(&residual.values_m) {
        return None;
    }
    let periods: Vec<f64> = crossings.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let cycles = count(periods.len());
    let whole = crossings[crossings.len() - 1] - crossings[0];
    is_regular(&periods).then_some(whole / cycles)
}

/// When the residual crosses the middle upwards \[samples\], between samples by a
/// straight line.
fn upward_crossings(residual: &Residual) -> Vec<f64> {
    let middle = residual.middle_m();
    let threshold = HYSTERESIS * residual.half_swing_m();
    let mut crossings = Vec::new();
    let (mut below, mut last) = (false, None);
    let values = residual.values_m.iter().map(|value| value - middle);
    let mut before = f64::INFINITY;
    for (place, value) in values.enumerate() {
        if before <= 0.0 && value > 0.0 {
            last = Some(count(place) - value / (value - before));
        }
        if value < -threshold {
            below = true;
        } else if value > threshold && below {
            crossings.extend(last);
            below = false;
        }
        before = value;
    }
    crossings
}

fn is_sustained(values: &[f64]) -> bool {
    let swing = |values: &[f64]| {
        let highest = values.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
        let lowest = values.iter().fold(f64::INFINITY, |a, &b| a.min(b));
        highest - lowest
    };
    let (first, second) = values.split_at(values.len() / 2);
    swing(second) >= SUSTAINED * swing(first)
}

fn is_regular(periods: &[f64]) -> bool {
    let mut sorted = periods.to_vec();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let near = |period: &&f64| (**period - median).abs() <= REGULAR * median;
    let regular = periods.iter().filter(near).count();
    // Of an odd number the middle one belongs to neither half.
    let half = periods.len() / 2;
    let mean = |periods: &[f64]| periods.iter().sum::<f64>() / count(periods.len());
    let (earlier, later) = (
        mean(&periods[..half]),
        mean(&periods[periods.len() - half..]),
    );
    10 * regular >= REGULAR_OF_TEN * periods.len()
        && (later - earlier).abs() <= DRIFT * earlier.min(later)
}
