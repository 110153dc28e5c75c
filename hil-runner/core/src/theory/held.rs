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
//! `Φ − 1 = A·ψ(T)` is kept instead of Φ: at a short T its digits are the axis.

use nalgebra::{SMatrix, SVector};

use super::linear_axis::{Body, LinearAxis, ONE, TWO};
use super::polynomial::Polynomial;

/// One sample of a linear axis with N states, the first being β.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeldStep<const N: usize> {
    /// `Φ − 1`.
    pub(crate) change: SMatrix<f64, N, N>,
    /// `Γ0`, of the voltage of this sample.
    pub(crate) present: SVector<f64, N>,
    /// `Γ1`, of the voltage of the last one.
    pub(crate) past: SVector<f64, N>,
}

/// Halvings that a step may need; 2^60 of them no finite A does.
const MOST_HALVINGS: u32 = 60;
/// Terms of the Taylor series on a step with ‖A‖·h ≤ 1/2: the rest is below
/// 0.5^16/17! < 1e-19.
const TERMS: u32 = 16;

/// `ψ(t)` and `e^{At}`, by a Taylor series on a short step and doubling,
/// `ψ(2h) = ψ(h) + e^{Ah}·ψ(h)`.
fn integral<const N: usize>(
    a: &SMatrix<f64, N, N>,
    length_s: f64,
) -> (SMatrix<f64, N, N>, SMatrix<f64, N, N>) {
    let norm = (0..N)
        .map(|j| a.column(j).iter().map(|entry| entry.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let (mut h, mut halvings) = (length_s, 0);
    while norm * h > 0.5 && halvings < MOST_HALVINGS {
        h *= 0.5;
        halvings += 1;
    }
    let identity = SMatrix::<f64, N, N>::identity();
    // ψ(h) = h·(1 + Ah/2·(1 + Ah/3·(1 + …)))
    let mut series = identity;
    for n in (2..=TERMS).rev() {
        series = identity + (a * series) * (h / f64::from(n));
    }
    let mut psi = series * h;
    let mut transition = identity + a * psi;
    for _ in 0..halvings {
        psi += transition * psi;
        // e^{A·2h} = 1 + A·ψ(2h) keeps the digits of what decays slowly.
        transition = identity + a * psi;
    }
    (psi, transition)
}

impl<const N: usize> HeldStep<N> {
    /// The step over `period_s` with the new voltage after `delay_s`.
    pub(crate) fn new(
        a: &SMatrix<f64, N, N>,
        b: &SVector<f64, N>,
        period_s: f64,
        delay_s: f64,
    ) -> Self {
        let (whole, _) = integral(a, period_s);
        let (rest, after) = integral(a, period_s - delay_s);
        let (delayed, _) = integral(a, delay_s);
        Self {
            change: a * whole,
            present: rest * b,
            past: after * (delayed * b),
        }
    }
}

/// `β/V` of a held axis as polynomials in `w = z − 1`:
/// `(present·z + past)/(z·w·poles)`, the pole at w = 0 being β itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PulseResponse {
    /// Poles of the axis but for the angle, degree 4 or 2.
    pub(crate) poles: Polynomial,
    /// That degree.
    pub(crate) degree: usize,
    /// Zeros for the voltage of this sample.
    pub(crate) present: Polynomial,
    /// Zeros for the voltage of the last one.
    pub(crate) past: Polynomial,
}

impl PulseResponse {
    /// The response of a linear axis.
    pub(crate) fn new(axis: &LinearAxis, period_s: f64, delay_s: f64) -> Self {
        match (axis.body, axis.two()) {
            (
                Body::One {
                    inertia_kg_m2,
                    drag_nms_per_rad,
                },
                _,
            ) => {
                let a = axis.one(inertia_kg_m2, drag_nms_per_rad);
                Self::of::<ONE, { ONE - 1 }>(&HeldStep::new(
                    &a,
                    &axis.per_volt(),
                    period_s,
                    delay_s,
                ))
            }
            (Body::Two { .. }, a) => Self::of::<TWO, { TWO - 1 }>(&HeldStep::new(
                &a.unwrap_or_default(),
                &axis.per_volt(),
                period_s,
                delay_s,
            )),
        }
    }

    /// The response of a held step; M is N − 1.
    ///
    /// With v the states behind β, `v⁺ − v = W·v + g·u` and
    /// `β⁺ − β = r·v + g_β·u`, so `w·β = (r·adj(w − W)·g/det(w − W) + g_β)·u`.
    /// Adjugate and determinant by Leverrier and Faddeev's recurrence.
    fn of<const N: usize, const M: usize>(step: &HeldStep<N>) -> Self {
        let w = step.change.fixed_view::<M, M>(1, 1).into_owned();
        let row = step.change.fixed_view::<1, M>(0, 1).into_owned();
        let rest = |gamma: &SVector<f64, N>| gamma.fixed_view::<M, 1>(1, 0).into_owned();
        let (present, past) = (rest(&step.present), rest(&step.past));

        let mut poles = Polynomial::ZERO;
        let (mut through_present, mut through_past) = (Polynomial::ZERO, Polynomial::ZERO);
        poles.0[M] = 1.0;
        let mut adjugate = SMatrix::<f64, M, M>::identity();
        let mut divisor = 1.0;
        for k in (0..M).rev() {
            through_present.0[k] = (row * (adjugate * present))[0];
            through_past.0[k] = (row * (adjugate * past))[0];
            let product = w * adjugate;
            poles.0[k] = -product.trace() / divisor;
            adjugate = product + SMatrix::<f64, M, M>::identity() * poles.0[k];
            divisor += 1.0;
        }
        Self {
            poles,
            degree: M,
            present: through_present.plus(&poles.scaled(step.present[0])),
            past: through_past.plus(&poles.scaled(step.past[0])),
        }
    }
}
