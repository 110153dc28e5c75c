//! The axis under a held voltage, from sample to sample.
//!
//! The code of `t_k` acts from `t_k + τ` to `t_(k+1) + τ`, so that over a
//! sample two voltages act one after the other (Åström and Wittenmark,
//! "Computer-Controlled Systems", 2.3 and 2.6; Franklin, Powell and Workman,
//! "Digital Control of Dynamic Systems", 4.3):
//!
//! ```text
//! x(k+1) = Φ·x(k) + Γ1·u(k−1) + Γ0·u(k)
//! Φ = e^{AT},   Γ0 = ψ(T−τ)·B,   Γ1 = e^{A(T−τ)}·ψ(τ)·B,   ψ(t) = ∫₀ᵗ e^{As} ds
//! ```
//!
//! `D = Φ − 1` is kept instead of Φ: at a short T its digits are the axis.
//!
//! The response from sample to sample is a quotient of polynomials of the delta
//! operator `w = z − 1`. At a short sample time every pole gathers at z = 1, and
//! what tells a stable loop from an unstable one is lost in the rounding of `z`.
//! In w the poles keep their digits: `w = e^{sΔt} − 1 ≈ s·Δt` (Middleton and
//! Goodwin, "Digital Control and Estimation", 1990).

use nalgebra::Complex;
use plant::Width;

use super::linear_axis::{Column, LinearAxis, Shaft, Square};

/// One sample of a linear axis with N states, the first being β.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeldStep<const N: usize> {
    /// `Φ − 1`.
    pub(crate) change: Square<N>,
    /// `Γ0`, of the voltage of this sample.
    pub(crate) present: Column<N>,
    /// `Γ1`, of the voltage of the last one.
    pub(crate) past: Column<N>,
}

/// Halvings that a step may need; 2^60 of them no finite A does.
const MOST_HALVINGS: u32 = 60;
/// Terms of the Taylor series on a step with ‖A‖·h ≤ 1/2: the rest is below
/// 0.5^16/17! < 1e-19.
const TERMS: u32 = 16;

/// `ψ(t)` and `D(t) = e^{At} − 1`, by a Taylor series on a short step and doubling,
///
/// ```text
/// ψ(2h) = ψ(h) + e^{Ah}·ψ(h) = (2 + D)·ψ(h),   D(2h) = (2 + D)·D(h)
/// ```
///
/// Rounding that mixes a fast mode with a slow one is multiplied with `2 + d_fast + d_slow`, about
/// one. With `D = A·ψ` in the place of its own doubling that would be `1 + λ_fast·h`, once for
/// each doubling.
fn integral<const N: usize>(a: &Square<N>, length_s: f64) -> (Square<N>, Square<N>) {
    let norm = (0..N)
        .map(|j| a.column(j).iter().map(|entry| entry.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let (mut h, mut halvings) = (length_s, 0);
    while norm * h > 0.5 && halvings < MOST_HALVINGS {
        h *= 0.5;
        halvings += 1;
    }
    let identity = Square::<N>::identity();
    // ψ(h) = h·(1 + Ah/2·(1 + Ah/3·(1 + …)))
    let mut series = identity;
    for n in (2..=TERMS).rev() {
        series = identity + (a * series) * (h / f64::from(n));
    }
    let mut psi = series * h;
    let mut change = a * psi;
    for _ in 0..halvings {
        let further = psi + change * psi;
        psi += further;
        let further = change + change * change;
        change += further;
    }
    (psi, change)
}

impl<const N: usize> HeldStep<N> {
    /// The step of `ẋ = A·x + B·u` over `period_s` with the new voltage after `delay_s`; of
    /// a current drive the commanded current.
    pub(crate) fn new((a, b): &(Square<N>, Column<N>), period_s: f64, delay_s: f64) -> Self {
        let (_, change) = integral(a, period_s);
        let (rest, after) = integral(a, period_s - delay_s);
        let (delayed, _) = integral(a, delay_s);
        let past = delayed * b;
        Self {
            change,
            present: rest * b,
            past: past + after * past,
        }
    }
}

/// `β/V` of a held axis, or `γ/V`, as polynomials in `w = z − 1`:
/// `(present·z + past)/(z·w·poles)`, the pole at w = 0 being the angle itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PulseResponse {
    /// Poles of the axis but for the angle, of degree 1 to 5: one less than it has states.
    pub(crate) poles: Polynomial,
    /// Zeros for the voltage of this sample.
    pub(crate) present: Polynomial,
    /// Zeros for the voltage of the last one.
    pub(crate) past: Polynomial,
}

impl PulseResponse {
    /// The response of a linear axis at a shaft; at the screw's, of two bodies.
    pub(crate) fn new(axis: &LinearAxis, shaft: Shaft, period_s: f64, delay_s: f64) -> Self {
        let timing_s = [period_s, delay_s];
        match axis.states() {
            2 => Self::of::<2, 1>(axis, shaft, timing_s),
            3 => Self::of::<3, 2>(axis, shaft, timing_s),
            4 => Self::of::<4, 3>(axis, shaft, timing_s),
            5 => Self::of::<5, 4>(axis, shaft, timing_s),
            _ => Self::of::<6, 5>(axis, shaft, timing_s),
        }
    }

    /// The response of an axis of N states; M is N − 1.
    ///
    /// With v the states behind β, `v⁺ − v = W·v + g·u` and
    /// `β⁺ − β = r·v + g_β·u`, so `w·β = (r·adj(w − W)·g/det(w − W) + g_β)·u`.
    /// Adjugate and determinant by Leverrier and Faddeev's recurrence.
    fn of<const N: usize, const M: usize>(
        axis: &LinearAxis,
        shaft: Shaft,
        [period_s, delay_s]: [f64; 2],
    ) -> Self {
        let system = match shaft {
            Shaft::Motor => axis.system(),
            Shaft::Screw => axis.system_of_screw(),
        };
        let step = HeldStep::<N>::new(&system, period_s, delay_s);
        let w = step.change.fixed_view::<M, M>(1, 1).into_owned();
        let row = step.change.fixed_view::<1, M>(0, 1).into_owned();
        let rest = |gamma: &Column<N>| gamma.fixed_view::<M, 1>(1, 0).into_owned();
        let (present, past) = (rest(&step.present), rest(&step.past));

        let mut poles = Polynomial::ZERO;
        let (mut through_present, mut through_past) = (Polynomial::ZERO, Polynomial::ZERO);
        poles.0[M] = 1.0;
        let mut adjugate = Square::<M>::identity();
        let mut divisor = 1.0;
        for k in (0..M).rev() {
            through_present.0[k] = (row * (adjugate * present))[0];
            through_past.0[k] = (row * (adjugate * past))[0];
            let product = w * adjugate;
            poles.0[k] = -product.trace() / divisor;
            adjugate = product + Square::<M>::identity() * poles.0[k];
            divisor += 1.0;
        }
        Self {
            poles,
            present: through_present.plus(&poles.scaled(step.present[0])),
            past: through_past.plus(&poles.scaled(step.past[0])),
        }
    }
}

/// Highest degree: six states of the axis, the voltage of the last sample, the
/// integrator and the last error.
pub(crate) const DEGREE: usize = 9;

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

    /// The value at a complex x of a polynomial of degree D at most, by
    /// Horner's rule.
    #[inline(always)]
    pub(crate) fn at<const D: usize, W: Width>(
        &self,
        w: W,
        x: Complex<W::Vector>,
    ) -> Complex<W::Vector> {
        let mut value = Complex::new(w.splat(self.0[D]), w.splat(0.0));
        for c in self.0[..D].iter().rev() {
            value = Complex::new(
                value.re * x.re - value.im * x.im + w.splat(*c),
                value.re * x.im + value.im * x.re,
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
