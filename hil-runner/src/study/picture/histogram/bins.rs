//! The intervals of a histogram.

use crate::study::picture::Histogram;
use crate::study::picture::power::{decade_below, power_of_ten};

/// Intervals that are still to be told apart.
const MOST_BINS: f64 = 80.0;

/// One interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bin {
    pub(super) from: f64,
    pub(super) to: f64,
    /// Runs that keep the limit, or all if there is none.
    pub(super) within: usize,
    /// Runs that do not.
    pub(super) beyond: usize,
}

/// Intervals of equal width (of equal ratio where the axis is logarithmic)
/// whose edges are round.
pub(super) fn bins(sorted: &[f64], histogram: &Histogram, log: bool) -> Vec<Bin> {
    let measure = |value: f64| if log { libm::log10(value) } else { value };
    let places: Vec<f64> = sorted.iter().map(|&value| measure(value)).collect();
    let (Some(&low), Some(&high)) = (places.first(), places.last()) else {
        return Vec::new();
    };
    let size = low.abs().max(high.abs());
    let span = high - low;
    let step = if span <= 1e-12 * size {
        // All equal: one interval about them.
        if size > 0.0 { 0.1 * size } else { 0.1 }
    } else {
        round_step(wanted_step(&places, span, histogram.bins))
    };
    let first = if span <= 1e-12 * size {
        low - 0.5 * step
    } else {
        (low / step).floor() * step
    };
    // What an edge stands for; multiples are formed anew, not summed.
    let edge = |count: f64| {
        let place = first + count * step;
        if log { libm::pow(10.0, place) } else { place }
    };
    let within = |value: f64| {
        let limit = histogram.limit.as_ref();
        limit.is_none_or(|limit| value.abs() <= limit.value)
    };
    let mut found: Vec<Bin> = Vec::new();
    for (&value, &place) in sorted.iter().zip(&places) {
        let at = ((place - first) / step).floor().max(0.0);
        let from = edge(at);
        if found.last().is_none_or(|bin| bin.from < from) {
            found.push(Bin {
                from,
                to: edge(at + 1.0),
                within: 0,
                beyond: 0,
            });
        }
        if let Some(bin) = found.last_mut() {
            if within(value) {
                bin.within += 1;
            } else {
                bin.beyond += 1;
            }
        }
    }
    found
}

/// Width after Freedman and Diaconis (1981), 2·IQR/∛n, within what can be
/// drawn; where the quartiles coincide, a share of the whole.
fn wanted_step(sorted: &[f64], span: f64, wanted: Option<usize>) -> f64 {
    if let Some(bins) = wanted {
        return span / bins as f64;
    }
    let count = sorted.len();
    let quartiles = sorted[(3 * (count - 1)) / 4] - sorted[(count - 1) / 4];
    let step = 2.0 * quartiles / libm::cbrt(count as f64);
    step.clamp(span / (0.5 * MOST_BINS), span / 5.0)
}

/// The nearest of 1, 2 and 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = power_of_ten(decade_below(step));
    let digit = match step / power {
        digit if digit < 1.5 => 1.0,
        digit if digit < 3.5 => 2.0,
        digit if digit < 7.5 => 5.0,
        _ => 10.0,
    };
    digit * power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::picture::Limit;
    use crate::study::picture::axis::AxisKeys;

    fn of(values: &[f64], limit: Option<f64>, log: bool) -> Vec<Bin> {
        let histogram = Histogram {
            x: "x".into(),
            x_axis: AxisKeys::default(),
            bins: Some(10),
            limit: limit.map(|value| Limit {
                value,
                label: String::new(),
                of_budget: false,
            }),
        };
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        bins(&values, &histogram, log)
    }

    #[test]
    fn every_value_is_in_one_interval_that_holds_it() {
        let values: Vec<f64> = (0..500).map(|i| libm::sin(f64::from(i)) + 1.5).collect();
        for log in [false, true] {
            let bins = of(&values, Some(1.7), log);
            let sum: usize = bins.iter().map(|bin| bin.within + bin.beyond).sum();
            assert_eq!(sum, 500);
            for bin in &bins {
                let rounding = 1e-9 * bin.to;
                let inside = values
                    .iter()
                    .filter(|&&v| v >= bin.from - rounding && v < bin.to - rounding);
                let inside = inside.count();
                assert!(
                    inside.abs_diff(bin.within + bin.beyond) <= 1,
                    "{bin:?} {inside}"
                );
            }
            let within: usize = bins.iter().map(|bin| bin.within).sum();
            assert_eq!(within, values.iter().filter(|&&v| v <= 1.7).count());
            assert!(within < 500, "the limit must part the values");
        }
    }

    #[test]
    fn one_value_has_one_interval() {
        for value in [0.0, 3.0, -7e5] {
            let bins = of(&[value, value], None, false);
            assert_eq!(bins.len(), 1);
            assert!(bins[0].from <= value && value <= bins[0].to);
        }
        assert!(of(&[], None, false).is_empty());
    }
}
