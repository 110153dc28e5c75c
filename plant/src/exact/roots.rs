//! Roots and extremes of a polynomial on \[0, 1\], found for certain.
//!
//! A polynomial lies within the range of its Bernstein coefficients, and has
//! at most as many roots as they change sign (Descartes' rule in Bernstein
//! form; G. Farin, "Curves and Surfaces for CAGD", section 6). No change of
//! sign excludes a root, one proves that there is exactly one; anything else
//! is halved (de Casteljau).

use super::grid::horner;
use super::levels::{Coefficients, TERMS};
use crate::numerics::bernstein::halves;
use crate::numerics::width::One;

const N: usize = TERMS + 1;

/// Halvings after which an undecided stretch is called a touch, not a
/// crossing: its depth is then below the rounding of the coefficients.
const MAX_HALVINGS: u32 = 40;

/// `C(i,j)/C(n,j)`: Bernstein coefficients `b_i = Σ_{j≤i} C(i,j)/C(n,j)·a_j`.
const WEIGHTS: [[f64; N]; N] = weights();

const fn weights() -> [[f64; N]; N] {
    let mut weights = [[0.0; N]; N];
    let mut i = 0;
    while i < N {
        let mut weight = 1.0;
        let mut j = 0;
        while j <= i {
            weights[i][j] = weight;
            if j < i {
                weight *= (i - j) as f64 / (N - 1 - j) as f64;
            }
            j += 1;
        }
        i += 1;
    }
    weights
}

/// A polynomial in powers of θ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Polynomial(pub(crate) Coefficients);

type Bernstein = [f64; N];

impl Polynomial {
    /// `(q(θ) − q(0))/θ`: the root at the start divided out, so that rounding
    /// cannot find the crossing that began the stretch again. Its value at 0,
    /// the slope, is known to be at least 0 and is held there.
    pub(crate) fn without_root_at_start(mut self) -> Self {
        self.0.rotate_left(1);
        self.0[TERMS] = 0.0;
        self.0[0] = self.0[0].max(0.0);
        self
    }

    /// `q + by`.
    pub(crate) fn raised(mut self, by: f64) -> Self {
        self.0[0] += by;
        self
    }

    /// A zero in (0, θ), if the polynomial is positive at 0 and negative at θ.
    pub(crate) fn zero_before(&self, theta: f64) -> Option<f64> {
        let falls = self.0[0] > 0.0 && self.value_and_slope(theta).0 < 0.0;
        falls.then(|| self.root_between(0.0, theta))
    }

    fn bernstein(&self) -> Bernstein {
        let mut b = [0.0; N];
        for (j, &a) in self.0.iter().enumerate() {
            for (b, row) in b.iter_mut().zip(&WEIGHTS) {
                *b += row[j] * a;
            }
        }
        b
    }

    /// True if a stretch is nothing but rounding of the coefficients, or not a
    /// number: its signs say nothing, and halving it would go on for ever.
    fn is_rounding(&self, b: &Bernstein) -> bool {
        let terms: f64 = self.0.iter().map(|a| a.abs()).sum();
        let largest = b.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
        let told_apart = largest > 4.0 * f64::EPSILON * terms;
        !told_apart
    }

    fn value_and_slope(&self, theta: f64) -> (f64, f64) {
        horner(One, &self.0, theta)
    }

    /// The first θ in \[0, `end`\] at which the polynomial falls below zero. A
    /// zero at 0 is not such a θ by itself: what follows decides.
    pub(crate) fn first_negative(&self, end: f64) -> Option<f64> {
        // q/θⁿ has the same sign. The highest powers are those zeros then.
        let zeros = self.0.iter().take_while(|&&a| a == 0.0).count();
        let mut rest = *self;
        rest.0.rotate_left(zeros);
        if rest.is_positive() {
            return None;
        }
        let root = rest.negative_in(&rest.bernstein(), [0.0, 1.0], false, MAX_HALVINGS)?;
        (root <= end).then_some(root)
    }

    /// True if the cheapest bound of all, |q(θ) − q(0)| ≤ Σ|a_n|, excludes a root.
    fn is_positive(&self) -> bool {
        let mut sum = 0.0;
        for a in &self.0[1..] {
            sum += a.abs();
        }
        self.0[0] > sum
    }

    /// The first or the last θ in a stretch at which the polynomial is negative.
    fn negative_in(
        &self,
        b: &Bernstein,
        [from, to]: [f64; 2],
        last: bool,
        halvings: u32,
    ) -> Option<f64> {
        let (value, theta) = if last { (b[TERMS], to) } else { (b[0], from) };
        if value < 0.0 {
            return Some(theta);
        }
        match sign_changes(b) {
            0 => return None,
            1 if last => return Some(self.times(-1.0).root_between(from, to)),
            1 => return Some(self.root_between(from, to)),
            _ if halvings == 0 || self.is_rounding(b) => return (b[TERMS] < 0.0).then_some(to),
            _ => {}
        }
        let (left, right) = halves(One, b);
        let middle = 0.5 * (from + to);
        let mut parts = [(left, [from, middle]), (right, [middle, to])];
        if last {
            parts.reverse();
        }
        let mut parts = parts.iter();
        parts.find_map(|(b, ends)| self.negative_in(b, *ends, last, halvings - 1))
    }

    /// The root between a value that is not negative and one that is: Newton,
    /// held within the bracket.
    fn root_between(&self, from: f64, to: f64) -> f64 {
        let (mut low, mut high) = (from, to);
        let (at_low, at_high) = (self.value_and_slope(low).0, self.value_and_slope(high).0);
        let mut theta = low + (high - low) * (at_low / (at_low - at_high)).clamp(0.0, 1.0);
        for _ in 0..100 {
            let (value, slope) = self.value_and_slope(theta);
            if value == 0.0 {
                return theta;
            }
            if value > 0.0 {
                low = theta;
            } else {
                high = theta;
            }
            let newton = theta - value / slope;
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            // The last bits of θ are decided by the rounding of the value.
            if (next - theta).abs() <= 4.0 * f64::EPSILON * next || next <= low || next >= high {
                return next;
            }
            theta = next;
        }
        theta
    }

    /// The supremum of |q| on \[0, `end`\].
    pub(crate) fn peak(&self, end: f64) -> f64 {
        let stretched = self.stretched(end);
        let b = stretched.bernstein();
        stretched.peak_in(&b, 0.0, 1.0, b[0].abs().max(b[TERMS].abs()), MAX_HALVINGS)
    }

    /// The Bernstein coefficients on \[0, `end`\].
    pub(super) fn bernstein_until(&self, end: f64) -> [f64; N] {
        self.stretched(end).bernstein()
    }

    /// `q(end·θ)`.
    fn stretched(mut self, end: f64) -> Self {
        let mut power = 1.0;
        if end < 1.0 {
            for a in &mut self.0 {
                *a *= power;
                power *= end;
            }
        }
        self
    }

    /// `factor·q`.
    fn times(&self, factor: f64) -> Self {
        Self(self.0.map(|a| a * factor))
    }

    fn peak_in(&self, b: &Bernstein, from: f64, to: f64, floor: f64, halvings: u32) -> f64 {
        let bound = b.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
        // Rounding of the coefficients themselves is not worth halving for.
        if bound <= floor * (1.0 + 2e-15) || halvings == 0 || self.is_rounding(b) {
            return floor;
        }
        // Bent one way throughout: one extreme, where the slope changes sign.
        let mut bends = [0.0; N];
        for (bend, three) in bends.iter_mut().zip(b.windows(3)) {
            *bend = (three[2] - three[1]) - (three[1] - three[0]);
        }
        let one_way = bends.iter().all(|&c| c <= 0.0) || bends.iter().all(|&c| c >= 0.0);
        if one_way {
            return floor.max(self.size_between(b, from, to));
        }
        let (left, right) = halves(One, b);
        let middle = 0.5 * (from + to);
        let floor = floor.max(right[0].abs());
        let floor = self.peak_in(&left, from, middle, floor, halvings - 1);
        self.peak_in(&right, middle, to, floor, halvings - 1)
    }

    /// The magnitude where the slope is zero, or at the end beyond which it would be.
    fn size_between(&self, b: &Bernstein, from: f64, to: f64) -> f64 {
        let (first, last) = (b[1] - b[0], b[TERMS] - b[TERMS - 1]);
        if first == 0.0 || first * last >= 0.0 {
            return b[0].abs().max(b[TERMS].abs());
        }
        let mut slope = [0.0; N];
        for (n, (s, &a)) in (1_u32..).zip(slope.iter_mut().zip(&self.0[1..])) {
            *s = f64::from(n) * a * first.signum();
        }
        let theta = Self(slope).root_between(from, to);
        self.value_and_slope(theta).0.abs()
    }

    /// The last θ in \[0, `end`\] at which |q| exceeds `band`, if any.
    pub(crate) fn last_outside(&self, band: f64, end: f64) -> Option<f64> {
        let q = self.stretched(end);
        let theta = [1.0, -1.0]
            .into_iter()
            .filter_map(|sign| {
                // Negative where ±q exceeds the band.
                let inside = q.times(-sign).raised(band);
                if inside.is_positive() {
                    return None;
                }
                inside.negative_in(&inside.bernstein(), [0.0, 1.0], true, MAX_HALVINGS)
            })
            .fold(None, |last: Option<f64>, t| {
                Some(last.map_or(t, |l| l.max(t)))
            })?;
        Some(theta * end)
    }
}

/// Changes of sign along the coefficients, zeros left out.
fn sign_changes(b: &Bernstein) -> u32 {
    let (mut changes, mut negative) = (0, b[0] < 0.0);
    for &b in &b[1..] {
        if b != 0.0 && (b < 0.0) != negative {
            changes += 1;
            negative = !negative;
        }
    }
    changes
}
