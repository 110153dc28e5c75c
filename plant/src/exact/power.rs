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
use super::levels::TERMS;
use super::peak::Sought;
use super::sketch::binomials;
use crate::numerics::bernstein::Polynomial;

/// Coefficients of a factor and of the product.
const FACTOR: usize = TERMS + 1;
const PRODUCT: usize = 2 * TERMS + 1;

/// A factor over a step: its values at both ends, how far it may stray from its chord,
/// and its slope from that of the chord, times the step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Factor {
    pub(super) ends: [f64; 2],
    pub(super) chord: f64,
    pub(super) slope: f64,
}

impl Factor {
    fn of<const D: usize>(sought: &Sought<'_, D>, leg: &Leg<D>) -> Self {
        let (level, rate, length_s) = (leg.level, &leg.rate, leg.length_s);
        Self {
            ends: [&leg.from, &leg.to].map(|x| sought.value(x, 0.0)),
            chord: sought.chord_bound(level, rate, length_s),
            slope: sought.slope_bound(level, rate, length_s),
        }
    }

    fn range(&self) -> [f64; 2] {
        let [from, to] = self.ends;
        [from.min(to) - self.chord, from.max(to) + self.chord]
    }

    fn slopes(&self) -> [f64; 2] {
        let rise = self.ends[1] - self.ends[0];
        [rise - self.slope, rise + self.slope]
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

/// True if within a step a product is nowhere larger than `peak` or than at the ends.
pub(super) fn stays_below([a, b]: &[Factor; 2], peak: f64) -> bool {
    let [low, high] = times(a.range(), b.range());
    if high.max(-low) <= peak {
        return true;
    }
    // (a·b)' = a'·b + a·b'
    let (left, right) = (times(a.slopes(), b.range()), times(a.range(), b.slopes()));
    left[0] + right[0] >= 0.0 || left[1] + right[1] <= 0.0
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
        let over = factors.each_ref().map(|sought| Factor::of(sought, leg));
        stays_below(&over, peak)
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
        let factors = ends.map(|ends| Factor {
            ends,
            chord: 0.0,
            slope: 0.0,
        });
        assert!(!stays_below(&factors, 0.2));
        assert!(stays_below(&factors, 1.0));
        // Where both grow, the product does.
        assert!(stays_below(&[factors[0]; 2], 0.2));
    }
}
