//! Polynomials of the delta operator `w = z − 1`, and where their roots lie.
//!
//! At a short sample time every pole gathers at z = 1, and what tells a stable
//! loop from an unstable one is lost in the rounding of `z`. In w the poles
//! keep their digits: `w = e^{sΔt} − 1 ≈ s·Δt` (Middleton and Goodwin, "Digital
//! Control and Estimation", 1990).

use nalgebra::Complex;

/// Highest degree: five states of the axis, the voltage of the last sample, the
/// integrator and the last error.
pub(crate) const DEGREE: usize = 8;

/// `Σ c_k·w^k` with real coefficients, the constant one first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Polynomial(pub(crate) [f64; DEGREE + 1]);

impl Polynomial {
    pub(crate) const ZERO: Self = Self([0.0; DEGREE + 1]);

    /// From the coefficients, the constant one first; those above
    /// [`DEGREE`] are left out.
    pub(crate) fn new(coefficients: &[f64]) -> Self {
        let mut polynomial = Self::ZERO;
        for (slot, c) in polynomial.0.iter_mut().zip(coefficients) {
            *slot = *c;
        }
        polynomial
    }

    /// The product; terms above [`DEGREE`] are left out.
    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut product = Self::ZERO;
        for (i, a) in self.0.iter().enumerate() {
            for (slot, b) in product.0[i..].iter_mut().zip(&other.0) {
                *slot += a * b;
            }
        }
        product
    }

    /// The sum.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self(core::array::from_fn(|k| self.0[k] + other.0[k]))
    }

    /// `factor` times the polynomial.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self(self.0.map(|c| factor * c))
    }

    /// The value at a complex w of a polynomial of degree D at most, by
    /// Horner's rule.
    #[inline]
    pub(crate) fn at<const D: usize>(&self, w: Complex<f64>) -> Complex<f64> {
        let mut value = Complex::new(self.0[D], 0.0);
        for c in self.0[..D].iter().rev() {
            value = Complex::new(
                value.re * w.re - value.im * w.im + c,
                value.re * w.im + value.im * w.re,
            );
        }
        value
    }
}

/// `w = e^{jθ} − 1` on the unit circle of z, without loss at small θ:
/// `−2·sin²(θ/2) + j·sin θ`.
#[inline]
pub(crate) fn on_circle(theta: f64) -> Complex<f64> {
    let (sin, cos) = libm::sincos(0.5 * theta);
    Complex::new(-2.0 * sin * sin, 2.0 * sin * cos)
}

/// True if all roots of `Σ c_k·w^k`, `c` of exact degree `c.len() − 1` and at
/// most [`DEGREE`], lie within the unit circle of `z = 1 + w`.
///
/// The bilinear map `z = (1 + s)/(1 − s)`, so `w = 2s/(1 − s)`, takes the disc
/// to the left half plane, and Routh's scheme decides there (Åström and
/// Wittenmark, "Computer-Controlled Systems", 3.3; Gantmacher). With `u = 1/s`
/// it is `w = 2/(u − 1)`: the coefficients are doubled k times, read backwards
/// and shifted by one (Taylor). A root on the circle is not within it.
pub(crate) fn all_roots_within_circle(c: &[f64]) -> bool {
    let n = c.len() - 1;
    let mut shifted = [0.0; DEGREE + 1];
    let mut power = 1.0;
    for (k, c) in c.iter().enumerate() {
        shifted[n - k] = power * c;
        power *= 2.0;
    }
    // q(u − 1) by repeated synthetic division.
    for start in 0..n {
        for j in (start..n).rev() {
            shifted[j] -= shifted[j + 1];
        }
    }
    // Here `shifted[j]` is the coefficient of s^(n−j).
    routh(&shifted[..=n])
}

/// True if all roots of a real polynomial, the highest power first, have
/// negative real parts: every entry of the first column of Routh's scheme has
/// the sign of the first.
fn routh(c: &[f64]) -> bool {
    const ROW: usize = DEGREE / 2 + 2;
    let sign = if c[0] < 0.0 { -1.0 } else { 1.0 };
    let (mut upper, mut lower) = ([0.0; ROW], [0.0; ROW]);
    for (i, pair) in c.chunks(2).enumerate() {
        upper[i] = sign * pair[0];
        lower[i] = pair.get(1).map_or(0.0, |c| sign * c);
    }
    if upper[0].is_nan() || upper[0] <= 0.0 {
        return false;
    }
    for _ in 1..c.len() {
        if lower[0].is_nan() || lower[0] <= 0.0 {
            return false;
        }
        let ratio = upper[0] / lower[0];
        let mut next = [0.0; ROW];
        for i in 0..ROW - 1 {
            next[i] = upper[i + 1] - ratio * lower[i + 1];
        }
        upper = lower;
        lower = next;
    }
    true
}
