//! Exact states anywhere within a step: at 32 points of it by one product each,
//! and around these by a short Taylor series.

use super::levels::{Levels, integral, value_and_slope};
use super::system::{Column, Matrix};

/// Cells that a step is divided into.
pub(crate) const CELLS: usize = 32;

/// Terms of a local series after the constant one. With `λT` at most 8 the series
/// runs over `λt ≤ 1/8`, and what these leave out is at most
/// `(1/8)^10/11! = 2.3e-17` of its first term (see [`super::levels`]).
pub(crate) const TERMS: usize = 10;

/// Levels of a step that has a grid or a sketch: `λT/2³ ≤ 1`.
pub(super) const MOST_LEVELS: usize = 4;

/// Coefficients of a quantity around a point of the grid.
pub(crate) type LocalCoefficients = [f64; TERMS + 1];

/// Exact steps to the points of a grid over a step of length T.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid<const D: usize> {
    /// Length T of the step \[s\].
    pub(crate) length_s: f64,
    /// `ψ(j·T/32)`, j = 0 … 32.
    pub(crate) integrals: Vec<Matrix<D>>,
    /// `Aⁿ·hⁿ⁺¹/(n + 1)!` with half a cell h: what the terms of a local series
    /// make of the rate, each by itself, so that none waits for another.
    pub(crate) terms: [Matrix<D>; TERMS],
    /// Transposes of `(TA)³`, `(TA)¹¹` and of `e^{|A|h}` over a cell.
    pub(super) third: Matrix<D>,
    pub(super) eleventh: Matrix<D>,
    pub(super) grown: Matrix<D>,
}

/// The time around an instant, as `σ = (t − centre)/half`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window {
    pub(crate) centre_s: f64,
    /// Half a cell \[s\]: the unit of σ.
    pub(crate) half_s: f64,
}

/// The solution around one point of the grid, in powers of σ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Local<const D: usize> {
    pub(crate) window: Window,
    terms: [Column<D>; TERMS + 1],
}

impl<const D: usize> Grid<D> {
    /// The grid of a step; `None` if the axis is too fast for it, which then
    /// goes the way of the halvings.
    pub(crate) fn new(levels: &Levels<D>) -> Option<Self> {
        let (a, length_s) = (&levels.a, levels.steps[0].length_s);
        if levels.steps.len() > MOST_LEVELS {
            return None;
        }
        let mut integrals = vec![Matrix::zeros(), integral(a, length_s / 32.0)];
        let mut doubled = 1;
        for j in 2..=CELLS {
            // ψ(s + t) = ψ(s) + e^{As}·ψ(t), s the largest power of two below.
            if j == 2 * doubled + 1 {
                doubled *= 2;
            }
            let first = integrals[doubled];
            let rest = integrals[j - doubled];
            integrals.push(first + (rest + a * (first * rest)));
        }
        let half_s = length_s / 64.0;
        let mut terms = [Matrix::identity() * half_s; TERMS];
        for n in 1..TERMS {
            terms[n] = (a * terms[n - 1]) * (half_s / (n + 1) as f64);
        }
        let scaled = (a * length_s).transpose();
        let third = scaled * scaled * scaled;
        let magnitude = a.abs();
        // e^{|A|h} = 1 + |A|·ψ_|A|(h)
        let grown = Matrix::identity() + magnitude * integral(&magnitude, length_s / 32.0);
        Some(Self {
            length_s,
            integrals,
            terms,
            third,
            eleventh: third * third * third * (scaled * scaled),
            grown: grown.transpose(),
        })
    }

    /// The solution around `time_s`, from `x` with `rate = A·x + u`.
    pub(crate) fn near(
        &self,
        a: &Matrix<D>,
        x: &Column<D>,
        rate: &Column<D>,
        time_s: f64,
    ) -> Local<D> {
        let cell_s = self.length_s / 32.0;
        let (mut j, mut cells) = (0, 0.0);
        for (more, count) in [(16, 16.0), (8, 8.0), (4, 4.0), (2, 2.0), (1, 1.0), (1, 1.0)] {
            if time_s > (cells + count - 0.5) * cell_s {
                j += more;
                cells += count;
            }
        }
        let change = self.integrals[j] * rate;
        let half_s = cell_s / 2.0;
        let mut terms = [x + change; TERMS + 1];
        // A·x(t) + u = v + A·ψ(t)·v
        let rate = rate + a * change;
        for (slot, matrix) in terms.iter_mut().skip(1).zip(&self.terms) {
            *slot = matrix * rate;
        }
        let centre_s = cells * cell_s;
        Local {
            window: Window { centre_s, half_s },
            terms,
        }
    }
}

impl Window {
    /// σ of a time.
    pub(crate) fn sigma(&self, time_s: f64) -> f64 {
        (time_s - self.centre_s) / self.half_s
    }

    /// The time at σ \[s\].
    pub(crate) fn time_s(&self, sigma: f64) -> f64 {
        self.centre_s + sigma * self.half_s
    }
}

impl<const D: usize> Local<D> {
    /// The state at σ, by Horner's rule.
    pub(crate) fn at(&self, sigma: f64) -> Column<D> {
        let mut x = self.terms[TERMS];
        for term in self.terms.iter().rev().skip(1) {
            x = x * sigma + term;
        }
        x
    }

    /// `row·x` as a polynomial in σ.
    pub(crate) fn quantity(&self, row: &Column<D>) -> LocalCoefficients {
        self.terms.map(|term| row.dot(&term))
    }
}

/// Coefficients of the slope.
pub(crate) fn derivative(coefficients: &LocalCoefficients) -> LocalCoefficients {
    let mut slope = [0.0; TERMS + 1];
    for (n, (s, c)) in (1_u32..).zip(slope.iter_mut().zip(&coefficients[1..])) {
        *s = f64::from(n) * c;
    }
    slope
}

/// Newton steps at most; the start is known to a ten-thousandth of the step.
pub(crate) const MOST_NEWTON: usize = 8;

/// A zero near σ by Newton's rule, down to the rounding of the value; `None` if
/// it leaves the cell.
pub(crate) fn zero_near(coefficients: &LocalCoefficients, mut sigma: f64) -> Option<f64> {
    let mut rounding = 0.0;
    for c in coefficients {
        rounding += f64::EPSILON * c.abs();
    }
    for _ in 0..MOST_NEWTON {
        let (value, slope) = value_and_slope(coefficients, sigma);
        let step = value / slope;
        sigma -= step;
        let inside = sigma.abs() <= 1.25;
        if !inside {
            return None;
        }
        if value.abs() <= rounding || step.abs() <= 8.0 * f64::EPSILON {
            return Some(sigma);
        }
    }
    None
}
