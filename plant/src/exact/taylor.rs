//! The solution of an affine system over a short stretch as its Taylor series.
//!
//! With `v = A·x + u` the solution is `x(t) = x(0) + Σ_{n≥1} A^(n−1)·v·tⁿ/n!`.
//! The stretch is so short that the series converges at once: with
//!
//! ```text
//! λ = max_i (|A|·w)_i / w_i     for a positive w
//! ```
//!
//! the norm `|v|_w = max_i |v_i|/w_i` of `A^n·v` is at most `λ^n·|v|_w`, and
//! with `λ·h ≤ 1` what [`TERMS`] terms leave out is at most
//! `h·|v|_w·(λh)^16/17!·(1 + 1/17) < 4e-15·h·|v|_w`: what rounding leaves too.

use super::system::{Column, Matrix};

/// Terms after the constant one.
pub(crate) const TERMS: usize = 16;

/// Coefficients of a polynomial in θ = t/h.
pub(crate) type Coefficients = [f64; TERMS + 1];

/// `x(θ·h) = Σ c_n·θⁿ`, 0 ≤ θ ≤ 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Taylor<const D: usize> {
    terms: [Column<D>; TERMS + 1],
}

impl<const D: usize> Taylor<D> {
    /// The series from `x` with `rate = A·x + u`, over `length_s`.
    pub(crate) fn new(a: &Matrix<D>, x: &Column<D>, rate: &Column<D>, length_s: f64) -> Self {
        let mut terms = [*x; TERMS + 1];
        let mut term = rate * length_s;
        for (n, slot) in (1_u32..).zip(terms.iter_mut().skip(1)) {
            *slot = term;
            term = (a * term) * (length_s / f64::from(n + 1));
        }
        Self { terms }
    }

    /// The state at θ, by Horner's rule.
    pub(crate) fn at(&self, theta: f64) -> Column<D> {
        let mut x = self.terms[TERMS];
        for term in self.terms.iter().rev().skip(1) {
            x = x * theta + term;
        }
        x
    }

    /// `row·x` as a polynomial in θ.
    pub(crate) fn quantity(&self, row: &Column<D>) -> Coefficients {
        let mut coefficients = [0.0; TERMS + 1];
        for (c, term) in coefficients.iter_mut().zip(&self.terms) {
            *c = row.dot(term);
        }
        coefficients
    }
}

/// Value and slope of `Σ c_n·θⁿ`, by Horner's rule.
pub(crate) fn value_and_slope<const N: usize>(coefficients: &[f64; N], theta: f64) -> (f64, f64) {
    let (mut value, mut slope) = (0.0, 0.0);
    for c in coefficients.iter().rev() {
        slope = slope * theta + value;
        value = value * theta + c;
    }
    (value, slope)
}

/// `ψ(h) = Σ_{n≥1} A^(n−1)·hⁿ/n!` by its series, for a short h.
pub(crate) fn integral<const D: usize>(a: &Matrix<D>, length_s: f64) -> Matrix<D> {
    // ψ = h·(1 + Ah/2·(1 + Ah/3·(…))): Horner's rule from the smallest term.
    let scaled = a * length_s;
    let mut sum = Matrix::<D>::identity();
    for n in (2..=20_u32).rev() {
        sum = Matrix::<D>::identity() + (scaled * sum) / f64::from(n);
    }
    sum * length_s
}

/// `λ` of the bound above: an upper bound of the spectral radius of |A| that
/// no scaling of the states can spoil. The weights come from iterating
/// `w ← |A|·w + small`, which turns w towards the Perron vector of |A|; any
/// positive w gives a bound.
pub(crate) fn growth_rate<const D: usize>(a: &Matrix<D>) -> f64 {
    let magnitude = a.abs();
    let mut w = Column::<D>::repeat(1.0);
    let mut bound = f64::INFINITY;
    for _ in 0..64 {
        let next = magnitude * w;
        let mut lambda = 0.0_f64;
        for (grown, weight) in next.iter().zip(w.iter()) {
            lambda = lambda.max(grown / weight);
        }
        bound = bound.min(lambda);
        // Half of the old keeps cyclic matrices from swinging to and fro and
        // every weight above zero.
        let scale = lambda.max(f64::MIN_POSITIVE);
        w = next / scale + w * 0.5;
        w /= w.max();
        w.apply(|weight| *weight = weight.max(1e-250));
    }
    bound
}
