//! Largest magnitude of a product of two quantities along the exact solution: the power
//! where the voltage moves with the current.
//!
//! Over one of the shortest steps both are polynomials, and so is their product; in
//! Bernstein form
//!
//! ```text
//! c_k = Σ_{i+j=k} (C(n,i)·a_i)·(C(n,j)·b_j)/C(2n,k)
//! ```
//!
//! Longer steps are settled by intervals: each factor lies within its chord's bound of
//! its ends, and its slope within the slope's bound of its chord's; or both within their
//! sketches' remainders of these.

use super::crossing::{Flow, Leg, Sought, Stretch};
use super::levels::TERMS;
use crate::numerics::bernstein::{Polynomial, binomials};

/// Coefficients of a factor and of the product.
const FACTOR: usize = TERMS + 1;
const PRODUCT: usize = 2 * TERMS + 1;

/// Lowest and highest value of something.
type Range = [f64; 2];

/// The range of a factor over a step of which it strays that far from its chord.
pub(super) fn about_chord([from, to]: [f64; 2], chord: f64) -> Range {
    [from.min(to) - chord, from.max(to) + chord]
}

/// That of its slope, times the step, where that is within `slope` of the chord's.
pub(super) fn slopes_about_chord([from, to]: [f64; 2], slope: f64) -> Range {
    let rise = to - from;
    [rise - slope, rise + slope]
}

/// Those of numbers that are off by that much.
fn range_of(numbers: &[f64], off: f64) -> Range {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = numbers.iter().fold(ends, |[low, high], &number| {
        [low.min(number), high.max(number)]
    });
    [low - off, high + off]
}

/// Lowest and highest product of two numbers within these.
fn times([a, b]: Range, [c, d]: Range) -> Range {
    range_of(&[a * c, a * d, b * c, b * d], 0.0)
}

/// True if a product is nowhere larger than `peak`, the factors being within these ranges.
pub(super) fn are_below([a, b]: [Range; 2], peak: f64) -> bool {
    let size = |[low, high]: Range| low.abs().max(high.abs());
    size(a) * size(b) <= peak
}

/// True if within a step a product is nowhere larger than at the ends, the factors and their
/// slopes being within these ranges.
pub(super) fn is_monotone([a, b]: [Range; 2], [slope_a, slope_b]: [Range; 2]) -> bool {
    // A bound that is none makes products that are no numbers, and an interval of none.
    let ranges = [a, b, slope_a, slope_b];
    if !ranges.as_flattened().iter().all(|x| x.is_finite()) {
        return false;
    }
    // (a·b)' = a'·b + a·b'
    let (left, right) = (times(slope_a, b), times(a, slope_b));
    left[0] + right[0] >= 0.0 || left[1] + right[1] <= 0.0
}

/// True if the sketches of the factors show that the product is nowhere larger than `peak` or
/// than at the ends.
fn sketches_stay_below<const D: usize>(
    flow: &Flow<'_, D>,
    factors: &[Sought<'_, D>; 2],
    length_s: f64,
    peak: f64,
) -> bool {
    let [Some(a), Some(b)] = factors.each_ref().map(|of| flow.curve(of, length_s)) else {
        return false;
    };
    let values = [&a, &b].map(|curve| range_of(&curve.values, curve.stray));
    let slopes = || [&a, &b].map(|curve| range_of(&curve.slopes, curve.stray));
    are_below(values, peak) || is_monotone(values, slopes())
}

/// True if the chords' bounds show it over a leg.
fn stays_below_over<const D: usize>(factors: &[Sought<'_, D>; 2], leg: &Leg<D>, peak: f64) -> bool {
    let (level, rate, length_s) = (leg.level, &leg.rate, leg.length_s);
    let of = |sought: &Sought<'_, D>| {
        let ends = [&leg.from, &leg.to].map(|x| sought.value(x, 0.0));
        let slope = sought.slope_bound(level, rate, length_s);
        let values = about_chord(ends, sought.chord_bound(level, rate, length_s));
        (values, slopes_about_chord(ends, slope))
    };
    let [a, b] = factors.each_ref().map(of);
    are_below([a.0, b.0], peak) || is_monotone([a.0, b.0], [a.1, b.1])
}

/// Raises `peak` to the supremum of `|a·b|` over `length_s`, which at the ends is known.
pub(super) fn raise_product<const D: usize>(
    flow: &Flow<'_, D>,
    factors: &[Sought<'_, D>; 2],
    length_s: f64,
    peak: &mut f64,
    work: &mut u64,
) {
    if sketches_stay_below(flow, factors, length_s, *peak) {
        return;
    }
    let mut walk = flow.walk(length_s, 0);
    // A walk that the mode's guards took too, so it ends.
    while let Some(stretch) = walk.next(|leg| stays_below_over(factors, leg, *peak)) {
        match stretch {
            Stretch::Settled(leg) => {
                let [a, b] = factors.each_ref().map(|sought| sought.value(&leg.to, 0.0));
                *peak = peak.max((a * b).abs());
            }
            Stretch::Leaf { leg, series, end } => {
                let [a, b] = factors
                    .each_ref()
                    .map(|sought| sought.polynomial(&leg, &series, end).bernstein);
                *peak = product(&a, &b).peak_above(*peak);
            }
        }
    }
    *work += walk.work();
}

/// The product of two polynomials in Bernstein form.
fn product(a: &[f64; FACTOR], b: &[f64; FACTOR]) -> Polynomial<PRODUCT> {
    let of_factor = const { binomials::<FACTOR>(TERMS) };
    let of_product = const { binomials::<PRODUCT>(2 * TERMS) };
    let [a, b] = [a, b].map(|factor| {
        let mut scaled = *factor;
        for (b, choices) in scaled.iter_mut().zip(&of_factor) {
            *b *= choices;
        }
        scaled
    });
    let mut bernstein = [0.0; PRODUCT];
    for (i, a) in a.iter().enumerate() {
        for (sum, b) in bernstein[i..].iter_mut().zip(&b) {
            *sum += a * b;
        }
    }
    for (sum, choices) in bernstein.iter_mut().zip(&of_product) {
        *sum /= choices;
    }
    Polynomial { bernstein }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `θ·(1 − θ)` is largest in the middle and zero at the ends.
    #[test]
    fn a_product_has_its_peak_within() {
        let linear = |from: f64, to: f64| {
            core::array::from_fn(|i| from + (to - from) * i as f64 / TERMS as f64)
        };
        let (rising, falling) = (linear(0.0, 1.0), linear(1.0, 0.0));
        let peak = product(&rising, &falling).peak_above(0.0);
        assert!((peak - 0.25).abs() < 1e-14, "{peak}");
        let ends = [[0.0, 1.0], [1.0, 0.0]];
        let values = ends.map(|ends| about_chord(ends, 0.0));
        let slopes = |places: [usize; 2]| places.map(|place| slopes_about_chord(ends[place], 0.0));
        assert!(!are_below(values, 0.2) && are_below(values, 1.0));
        assert!(!is_monotone(values, slopes([0, 1])));
        // Where both grow, the product does.
        assert!(is_monotone([values[0]; 2], slopes([0, 0])));
    }

    /// Of a factor without a bound nothing is known, even where the other is zero.
    #[test]
    fn no_bound_excludes_nothing() {
        let with = |chord: f64| about_chord([0.0, 1.0], chord);
        let (zero, straight) = ([0.0; 2], [[0.0; 2]; 2]);
        assert!(are_below([with(0.0), zero], 0.2));
        for none in [f64::NAN, f64::INFINITY] {
            for factors in [[with(none), zero], [zero, with(none)]] {
                assert!(!are_below(factors, 0.2) && !is_monotone(factors, straight));
            }
            let falling = [0.0, 1.0];
            let steep = slopes_about_chord([0.0, 1.0], none);
            assert!(!is_monotone([with(0.0), falling], [steep, zero]));
            assert!(!is_monotone([with(0.0), falling], [zero, steep]));
        }
    }
}
