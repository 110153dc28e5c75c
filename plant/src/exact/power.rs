//! Largest magnitude of a product of two quantities along the exact solution: the power
//! where the voltage moves with the current.
//!
//! Over one of the shortest steps both are polynomials, and so is their product; in
//! Bernstein form
//!
//! ```text
//! c_k = Σ_{i+j=k} C(n,i)·C(n,j)/C(2n,k)·a_i·b_j
//! ```
//!
//! Longer steps are settled by intervals: each factor lies within its chord's bound of
//! its ends, and its slope within the slope's bound of its chord's.

use super::crossing::{Flow, Leg, Stretch};
use super::curve::binomials;
use super::levels::TERMS;
use super::peak::Sought;
use super::system::Column;
use crate::numerics::bernstein::Polynomial;

/// Coefficients of a factor and of the product.
const FACTOR: usize = TERMS + 1;
const PRODUCT: usize = 2 * TERMS + 1;

/// A factor over a step: its values at both ends, and how far it may stray from its chord.
#[derive(Debug, Clone, Copy)]
pub(super) struct Factor {
    pub(super) ends: [f64; 2],
    pub(super) chord: f64,
}

impl Factor {
    fn size(&self) -> f64 {
        let [from, to] = self.ends.map(f64::abs);
        from.max(to) + self.chord
    }

    fn range(&self) -> [f64; 2] {
        let [from, to] = self.ends;
        [from.min(to) - self.chord, from.max(to) + self.chord]
    }

    /// Lowest and highest slope, times the step, where it is within `slope` of the chord's.
    fn slopes(&self, slope: f64) -> [f64; 2] {
        let rise = self.ends[1] - self.ends[0];
        [rise - slope, rise + slope]
    }
}

/// Lowest and highest product of two numbers within these.
fn times([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    let products = [a * c, a * d, b * c, b * d];
    [
        products.iter().copied().fold(f64::INFINITY, f64::min),
        products.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// True if within a step a product is nowhere larger than `peak` or than at the ends; the
/// factors' slopes are within `slopes` of their chords'.
pub(super) fn stays_below(
    [a, b]: &[Factor; 2],
    slopes: impl FnOnce() -> [f64; 2],
    peak: f64,
) -> bool {
    let (size_a, size_b) = (a.size(), b.size());
    if size_a * size_b <= peak {
        return true;
    }
    let [slope_a, slope_b] = slopes();
    // A bound that is none makes products that are no numbers, and an interval of none.
    if ![size_a, size_b, slope_a, slope_b]
        .iter()
        .all(|x| x.is_finite())
    {
        return false;
    }
    // (a·b)' = a'·b + a·b'
    let left = times(a.slopes(slope_a), b.range());
    let right = times(a.range(), b.slopes(slope_b));
    left[0] + right[0] >= 0.0 || left[1] + right[1] <= 0.0
}

/// True if the bounds of the table's step show that a product, whose factors are known at
/// both ends, is nowhere larger than `peak` within the whole of it.
pub(super) fn stays_below_over_step<const D: usize>(
    flow: &Flow<'_, D>,
    (factors, ends): (&[Sought<'_, D>; 2], [[f64; 2]; 2]),
    length_s: f64,
    peak: f64,
) -> bool {
    flow.table.levels.steps[0].length_s == length_s
        && stays_below_over(factors, ends, (0, &flow.rate, length_s), peak)
}

/// The same over a step of a level that begins with a rate.
fn stays_below_over<const D: usize>(
    factors: &[Sought<'_, D>; 2],
    [a, b]: [[f64; 2]; 2],
    (level, rate, length_s): (usize, &Column<D>, f64),
    peak: f64,
) -> bool {
    let [chord_a, chord_b] = factors
        .each_ref()
        .map(|sought| sought.chord_bound(level, rate, length_s));
    let over = [(a, chord_a), (b, chord_b)].map(|(ends, chord)| Factor { ends, chord });
    let slopes = || {
        factors
            .each_ref()
            .map(|sought| sought.slope_bound(level, rate, length_s))
    };
    stays_below(&over, slopes, peak)
}

/// Raises `peak` to the supremum of `|a·b|` over `length_s`, which at the ends is known.
pub(super) fn raise_product<const D: usize>(
    flow: &Flow<'_, D>,
    factors: &[Sought<'_, D>; 2],
    length_s: f64,
    peak: &mut f64,
    work: &mut u64,
) {
    let mut walk = flow.walk(length_s, 0);
    let known = |leg: &Leg<D>, peak: f64| {
        let ends = |sought: &Sought<'_, D>| [&leg.from, &leg.to].map(|x| sought.value(x, 0.0));
        let over = (leg.level, &leg.rate, leg.length_s);
        stays_below_over(factors, factors.each_ref().map(ends), over, peak)
    };
    // A walk that the mode's guards took too, so it ends.
    while let Ok(Some(stretch)) = walk.next(|leg| known(leg, *peak)) {
        match stretch {
            Stretch::Settled(leg) => {
                let [a, b] = factors.each_ref().map(|sought| sought.value(&leg.to, 0.0));
                *peak = peak.max((a * b).abs());
            }
            Stretch::Leaf { leg, series, end } => {
                let [a, b] = factors
                    .each_ref()
                    .map(|sought| sought.polynomial(&leg, &series, end).bernstein_until(end));
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
    let mut bernstein = [0.0; PRODUCT];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            let weight = of_factor[i] * of_factor[j] / of_product[i + j];
            bernstein[i + j] += weight * (a * b);
        }
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
        let straight = || [0.0; 2];
        let factors = ends.map(|ends| Factor { ends, chord: 0.0 });
        assert!(!stays_below(&factors, straight, 0.2));
        assert!(stays_below(&factors, straight, 1.0));
        // Where both grow, the product does.
        assert!(stays_below(&[factors[0]; 2], straight, 0.2));
    }

    /// Of a factor without a bound nothing is known, even where the other is zero.
    #[test]
    fn no_bound_excludes_nothing() {
        let with = |chord: f64| Factor {
            ends: [0.0, 1.0],
            chord,
        };
        let zero = Factor {
            ends: [0.0; 2],
            chord: 0.0,
        };
        assert!(stays_below(&[with(0.0), zero], || [0.0; 2], 0.2));
        for none in [f64::NAN, f64::INFINITY] {
            assert!(!stays_below(&[with(none), zero], || [0.0; 2], 0.2));
            assert!(!stays_below(&[zero, with(none)], || [0.0; 2], 0.2));
            let falling = Factor {
                ends: [1.0, 0.0],
                chord: 0.0,
            };
            assert!(!stays_below(&[with(0.0), falling], || [none, 0.0], 0.2));
            assert!(!stays_below(&[with(0.0), falling], || [0.0, none], 0.2));
        }
    }
}
