//! A quantity over a whole step as one polynomial, with a proven remainder.
//!
//! `q = f·x` has the slope `q̇(t) = f·e^{At}·v`. Its interpolant of degree 10 at
//! eleven points of the step, divided as in [`super::grid`], misses it by at
//! most (the usual remainder of interpolation)
//!
//! ```text
//! |T·q̇(θT) − s(θ)| ≤ w/11!·T¹²·sup_t |f·A¹¹·e^{At}·v|,   w = sup_θ ∏|θ − θ_i| < 8.65e-7
//! ```
//!
//! and the supremum, with |e^{At}| ≤ e^{|A|h} within a cell of length h, by
//! `max_j |f·A¹¹·e^{Ajh}|·e^{|A|h}·|v|`, entry by entry. The integral of s is q
//! to within the same number times θ. Both are kept as Bernstein coefficients,
//! which are linear in v: a look at a step costs one small product, and tells
//! whether the step crosses a guard or turns, and where. The places themselves
//! then come from the solution ([`super::grid`]), not from the polynomial.

use fearless_simd::Simd;

use super::curve::{Curve, SLOPES};
use super::grid::{CELLS, Grid, LocalCoefficients, MOST_LEVELS, TERMS, Window, sum};
use super::levels::Levels;
use super::sums::{times, weighted};
use super::system::{Column, Matrix};
use crate::numerics::vectors::{in_fours, widest};
use crate::numerics::width::{One, Width};

/// The points of interpolation, in cells: near those of Lobatto and Chebyshev.
pub(crate) const NODES: [usize; SLOPES] = [0, 1, 3, 7, 11, 16, 21, 25, 29, 31, 32];

/// `w/11!`; w is checked by a test.
const REMAINDER: f64 = NODE_PRODUCT / 39_916_800.0;
pub(crate) const NODE_PRODUCT: f64 = 8.65e-7;

/// Bernstein coefficients of the polynomial that is 1 at one node and 0 at the
/// others: row i, node j.
const FIT: [[f64; SLOPES]; SLOPES] = fit();

const fn fit() -> [[f64; SLOPES]; SLOPES] {
    let mut rows = [[0.0; SLOPES]; SLOPES];
    let mut node = 0;
    while node < SLOPES {
        let here = NODES[node] as f64 / CELLS as f64;
        // ∏ (θ − θ_k)/(θ_node − θ_k), one factor after the other.
        let mut b = [0.0; SLOPES];
        b[0] = 1.0;
        let (mut degree, mut k) = (0, 0);
        while k < SLOPES {
            if k != node {
                let there = NODES[k] as f64 / CELLS as f64;
                let (low, high) = (-there / (here - there), (1.0 - there) / (here - there));
                degree += 1;
                let mut i = degree;
                while i > 0 {
                    b[i] = ((degree - i) as f64 * low * b[i] + i as f64 * high * b[i - 1])
                        / degree as f64;
                    i -= 1;
                }
                b[0] = degree as f64 * low * b[0] / degree as f64;
            }
            k += 1;
        }
        let mut i = 0;
        while i < SLOPES {
            rows[i][node] = b[i];
            i += 1;
        }
        node += 1;
    }
    rows
}

/// The largest magnitudes, entry by entry.
fn largest<const D: usize>(rows: impl Iterator<Item = Column<D>>) -> Column<D> {
    rows.fold(Column::zeros(), |most, row| most.sup(&row.abs()))
}

/// `sup_t |f·(TA)ⁿ·e^{At}|`, entry by entry, from `f·e^{At}` at every point of the grid and the
/// transpose of `(TA)ⁿ`: functions of A commute.
fn largest_derivative<const D: usize>(
    grid: &Grid<D>,
    rows: &[Column<D>],
    power: &Matrix<D>,
) -> Column<D> {
    grid.grown * largest(rows.iter().map(|row| power * row))
}

/// How far the quantity `row·x` is from the cubic with its values and slopes at both ends of
/// the step that has this grid, per rate at its start: `T⁴/384·sup_t |f·A³·e^{At}·v|`
/// (Hermite's remainder).
pub(super) fn cubic_strays<const D: usize>(
    grid: &Grid<D>,
    a: &Matrix<D>,
    row: &Column<D>,
) -> Column<D> {
    largest_derivative(grid, &along(grid, a, row), &grid.third) * (grid.length_s / 384.0)
}

/// `f·e^{At} = f + (f·ψ(t))·A` at the points of a grid.
fn along<const D: usize>(grid: &Grid<D>, a: &Matrix<D>, row: &Column<D>) -> Vec<Column<D>> {
    let points = grid.integrals.iter();
    points
        .map(|psi| row + a.transpose() * (psi.transpose() * row))
        .collect()
}

/// Rounding of the coefficients, relative to the largest of them: the
/// rows of [`FIT`] sum up to less than 800.
const ROUNDING: f64 = 800.0 * 16.0 * f64::EPSILON;

/// Powers of the series about the middle of a step: over `λt ≤ 4`, as `λT` is at most 8.
/// In the norm of [`super::levels`] what they leave out is some `4³³/33! = 8.5e-18` of the
/// first. That norm says nothing about fewer: of states that only integrate one another λ
/// is zero, whereas the last of them takes as many powers as there are states.
const POWERS: usize = 33;

/// τⁿ with τ = 2θ − 1, by its values at the points of interpolation, and the error of
/// that: the eleventh derivative by θ is at most `2¹¹·n!/(n − 11)!`, which makes it
/// `w·2¹¹·C(n, 11)`.
const POWERS_FIT: [[f64; POWERS]; SLOPES] = powers_fit();
const POWERS_STRAY: [f64; POWERS] = powers_stray();

const fn powers_fit() -> [[f64; POWERS]; SLOPES] {
    let mut powers = [[0.0; POWERS]; SLOPES];
    let mut node = 0;
    while node < SLOPES {
        let tau = 2.0 * NODES[node] as f64 / CELLS as f64 - 1.0;
        let (mut n, mut value) = (0, 1.0);
        while n < POWERS {
            let mut i = 0;
            while i < SLOPES {
                powers[i][n] += FIT[i][node] * value;
                i += 1;
            }
            value *= tau;
            n += 1;
        }
        node += 1;
    }
    powers
}

const fn powers_stray() -> [f64; POWERS] {
    let mut strays = [0.0; POWERS];
    let (mut n, mut binomial) = (SLOPES, 1.0);
    while n < POWERS {
        strays[n] = NODE_PRODUCT * 2048.0 * binomial;
        n += 1;
        binomial *= n as f64 / (n - SLOPES) as f64;
    }
    strays
}

/// A quantity over a step for any rate at its start.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sketch<const D: usize> {
    /// Bernstein coefficients of `T·q̇`, per rate.
    pub(crate) slopes: [Column<D>; SLOPES],
    /// Error of `T·q̇`, per |rate|.
    pub(crate) stray: Column<D>,
    /// Without a grid: `T·q̇` as the series about the middle, per rate.
    series: Vec<Column<D>>,
}

impl<const D: usize> Sketch<D> {
    /// The quantity `row·x` over the step that has this grid.
    pub(crate) fn over(grid: &Grid<D>, a: &Matrix<D>, row: &Column<D>) -> Self {
        let (rows, length_s) = (along(grid, a, row), grid.length_s);
        let slopes = FIT.map(|weights| {
            let mut sum = Column::<D>::zeros();
            for (weight, node) in weights.iter().zip(NODES) {
                sum += rows[node] * (*weight * length_s);
            }
            sum
        });
        let rounding = largest(rows.iter().copied());
        let remainder = largest_derivative(grid, &rows, &grid.eleventh) * REMAINDER;
        Self {
            slopes,
            stray: (remainder + rounding * ROUNDING) * length_s,
            series: Vec::new(),
        }
    }

    /// The quantity `row·x` over the longest step without its grid; `None` if that is
    /// too long.
    pub(crate) fn about_middle(levels: &Levels<D>, row: &Column<D>) -> Option<Self> {
        if levels.steps.len() > MOST_LEVELS {
            return None;
        }
        Some(in_fours!(widest(), simd => Self::of_series(simd, levels, row)))
    }

    /// The same of a step that is not.
    #[inline(always)]
    fn of_series(simd: impl Simd, levels: &Levels<D>, row: &Column<D>) -> Self {
        let length_s = levels.steps[0].length_s;
        let [half, scaled] = levels.middle();
        let mut term = times(simd, half, row) * length_s;
        let mut series = [[0.0; D]; POWERS];
        let mut stray = Column::zeros();
        for ((n, slot), error) in (1_u32..).zip(&mut series).zip(POWERS_STRAY) {
            *slot = term.into();
            stray += term.abs() * (error + ROUNDING);
            term = times(simd, scaled, &term) / f64::from(n);
        }
        let mut slopes = [Column::zeros(); SLOPES];
        for (slope, weights) in slopes.iter_mut().zip(&POWERS_FIT) {
            *slope = weighted(simd, &series, weights).into();
        }
        Self {
            slopes,
            stray,
            series: series.map(Column::from).to_vec(),
        }
    }

    /// The quantity, which is `start` at the start, around `time_s`: by the series about
    /// the middle.
    pub(crate) fn around(
        &self,
        rate: &Column<D>,
        start: f64,
        (time_s, length_s): (f64, f64),
    ) -> (Window<One>, LocalCoefficients<One>) {
        let mut slope = [0.0; POWERS];
        for (slope, row) in slope.iter_mut().zip(&self.series) {
            *slope = row.dot(rate);
        }
        let tau = 2.0 * (time_s / length_s) - 1.0;
        // q(t) − q(0) is half the integral of T·q̇ over τ from −1 on.
        let (mut here, mut there) = (0.0, 0.0);
        for (n, c) in slope.iter().enumerate().rev() {
            let c = c / (n + 1) as f64;
            (here, there) = (here * tau + c, c - there);
        }
        let mut q = [start + 0.5 * (here * tau + there); TERMS + 1];
        let mut scale = 0.5;
        for (n, k) in (1_u32..).zip(0..TERMS) {
            // Horner's rule leaves the coefficient of (τ − there)ᵏ.
            for n in (k..POWERS - 1).rev() {
                slope[n] += tau * slope[n + 1];
            }
            scale /= 32.0;
            q[k + 1] = slope[k] * scale / f64::from(n);
        }
        let window = Window {
            centre_s: time_s,
            half_s: length_s / 64.0,
        };
        (window, q)
    }

    /// The slopes over the step that begins with `rate`, and what they may be off by.
    #[inline(always)]
    pub(crate) fn slopes<W: Width>(
        &self,
        w: W,
        rate: &[W::Vector; D],
    ) -> ([W::Vector; SLOPES], W::Vector) {
        let (mut slopes, mut sizes) = ([rate[0]; SLOPES], *rate);
        for (slope, row) in slopes.iter_mut().zip(&self.slopes) {
            *slope = sum(w, |j| row[j], rate);
        }
        for size in &mut sizes {
            *size = w.abs(*size);
        }
        let stray = sum(w, |j| self.stray[j], &sizes);
        (slopes, stray)
    }

    /// The quantity `scale·q + offset`, which is `value` at the start, over the
    /// step that begins with `rate`.
    #[inline(always)]
    pub(crate) fn curve<W: Width>(
        &self,
        w: W,
        rate: &[W::Vector; D],
        (scale, value): (W::Vector, W::Vector),
    ) -> Curve<W> {
        let (mut slopes, stray) = self.slopes(w, rate);
        for slope in &mut slopes {
            *slope = scale * *slope;
        }
        Curve::new(w, value, slopes, w.abs(scale) * stray)
    }
}
