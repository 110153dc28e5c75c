//! Exact states anywhere within a step, of one run or of many side by side: at 32 points of
//! it by one product each, and around these by a short Taylor series.

use super::levels::{Levels, integral};
use super::system::{Column, Matrix};
use crate::numerics::width::Width;

/// Cells that a step is divided into.
pub(crate) const CELLS: usize = 32;

/// Terms of a local series after the constant one. With `λT` at most 8 the series
/// runs over `λt ≤ 1/8`, and what these leave out is at most
/// `(1/8)^10/11! = 2.3e-17` of its first term (see [`super::levels`]).
pub(crate) const TERMS: usize = 10;

/// Levels of a step that has a grid or a sketch: `λT/2³ ≤ 1`.
pub(super) const MOST_LEVELS: usize = 4;

/// Coefficients of a quantity around a point of the grid.
pub(crate) type LocalCoefficients<W> = [<W as Width>::Vector; TERMS + 1];

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
pub(crate) struct Window<W: Width> {
    pub(crate) centre_s: W::Vector,
    /// Half a cell \[s\]: the unit of σ.
    pub(crate) half_s: W::Vector,
}

/// The solution around one point of the grid, in powers of σ.
#[derive(Clone, Copy)]
pub(crate) struct Local<W: Width, const D: usize> {
    pub(crate) window: Window<W>,
    terms: [[W::Vector; D]; TERMS + 1],
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
    #[inline(always)]
    pub(crate) fn near<W: Width>(
        &self,
        w: W,
        a: &Matrix<D>,
        (x, rate): (&[W::Vector; D], &[W::Vector; D]),
        time_s: W::Vector,
    ) -> Local<W, D> {
        let cell_s = w.splat(self.length_s / 32.0);
        let mut cells = w.splat(0.0);
        for count in [16.0, 8.0, 4.0, 2.0, 1.0, 1.0] {
            let further = cells + w.splat(count);
            let beyond = w.greater(time_s, (further - w.splat(0.5)) * cell_s);
            cells = w.select(beyond, further, cells);
        }
        let change = self.change(w, cells, rate);
        // A·x(t) + u = v + A·ψ(t)·v
        let (mut centre, mut here) = (*x, *rate);
        for (i, (x, rate)) in centre.iter_mut().zip(&mut here).enumerate() {
            *x = *x + change[i];
            *rate = *rate + sum(w, |j| a[(i, j)], &change);
        }
        let mut terms = [centre; TERMS + 1];
        for (slot, matrix) in terms.iter_mut().skip(1).zip(&self.terms) {
            for (i, term) in slot.iter_mut().enumerate() {
                *term = sum(w, |j| matrix[(i, j)], &here);
            }
        }
        let window = Window {
            centre_s: cells * cell_s,
            half_s: w.splat(self.length_s / 64.0),
        };
        Local { window, terms }
    }

    /// `ψ(t)·v` with t at a point of each lane's own.
    #[inline(always)]
    fn change<W: Width>(&self, w: W, cells: W::Vector, rate: &[W::Vector; D]) -> [W::Vector; D] {
        let mut psi = [[W::array(0.0); D]; D];
        for (lane, &cell) in w.stored(cells).as_ref().iter().enumerate() {
            // A whole number from 0 to the number of cells.
            let of_lane = &self.integrals[(cell as usize).min(CELLS)];
            for (i, row) in psi.iter_mut().enumerate() {
                for (j, to) in row.iter_mut().enumerate() {
                    to.as_mut()[lane] = of_lane[(i, j)];
                }
            }
        }
        let mut change = *rate;
        for (change, row) in change.iter_mut().zip(&psi) {
            *change = w.load(&row[0]) * rate[0];
            for j in 1..D {
                *change = *change + w.load(&row[j]) * rate[j];
            }
        }
        change
    }
}

/// `Σ_j c_j·x_j`, in the order of the states.
#[inline(always)]
pub(super) fn sum<W: Width, const D: usize>(
    w: W,
    coefficients: impl Fn(usize) -> f64,
    x: &[W::Vector; D],
) -> W::Vector {
    let mut sum = w.splat(coefficients(0)) * x[0];
    for (j, x) in x.iter().enumerate().skip(1) {
        sum = sum + w.splat(coefficients(j)) * *x;
    }
    sum
}

impl<W: Width> Window<W> {
    /// σ of a time.
    #[inline(always)]
    pub(crate) fn sigma(&self, time_s: W::Vector) -> W::Vector {
        (time_s - self.centre_s) / self.half_s
    }

    /// The time at σ \[s\].
    #[inline(always)]
    pub(crate) fn time_s(&self, sigma: W::Vector) -> W::Vector {
        self.centre_s + sigma * self.half_s
    }
}

impl<W: Width, const D: usize> Local<W, D> {
    /// The state at σ, by Horner's rule.
    #[inline(always)]
    pub(crate) fn at(&self, sigma: W::Vector) -> [W::Vector; D] {
        let mut x = self.terms[TERMS];
        for term in self.terms.iter().rev().skip(1) {
            for (x, term) in x.iter_mut().zip(term) {
                *x = *x * sigma + *term;
            }
        }
        x
    }

    /// `scale·x_i + offset` as a polynomial in σ.
    #[inline(always)]
    pub(crate) fn state(
        &self,
        state: usize,
        (scale, offset): (W::Vector, W::Vector),
    ) -> LocalCoefficients<W> {
        let mut coefficients = [scale; TERMS + 1];
        for (coefficient, term) in coefficients.iter_mut().zip(&self.terms) {
            *coefficient = scale * term[state];
        }
        coefficients[0] = coefficients[0] + offset;
        coefficients
    }

    /// `row·x` as a polynomial in σ.
    #[inline(always)]
    pub(crate) fn quantity(&self, w: W, row: &Column<D>) -> LocalCoefficients<W> {
        let mut coefficients = [w.splat(0.0); TERMS + 1];
        for (coefficient, term) in coefficients.iter_mut().zip(&self.terms) {
            *coefficient = product(w, row, term);
        }
        coefficients
    }
}

/// `f·x`, summed in the order of the states.
#[inline(always)]
pub(crate) fn product<W: Width, const D: usize>(
    w: W,
    row: &Column<D>,
    x: &[W::Vector; D],
) -> W::Vector {
    let mut sum = w.splat(0.0);
    for (f, x) in row.iter().zip(x) {
        sum = sum + w.splat(*f) * *x;
    }
    sum
}

/// `scale·q + offset`.
#[inline(always)]
pub(crate) fn scaled<W: Width>(
    mut q: LocalCoefficients<W>,
    (scale, offset): (W::Vector, W::Vector),
) -> LocalCoefficients<W> {
    for c in &mut q {
        *c = scale * *c;
    }
    q[0] = q[0] + offset;
    q
}

/// Coefficients of the slope.
#[inline(always)]
pub(crate) fn derivative<W: Width>(
    w: W,
    coefficients: &LocalCoefficients<W>,
) -> LocalCoefficients<W> {
    let mut slope = [w.splat(0.0); TERMS + 1];
    for (n, (s, c)) in (1_u32..).zip(slope.iter_mut().zip(&coefficients[1..])) {
        *s = w.splat(f64::from(n)) * *c;
    }
    slope
}

/// Value and slope of a polynomial, by Horner's rule.
#[inline(always)]
pub(crate) fn horner<W: Width, const N: usize>(
    w: W,
    coefficients: &[W::Vector; N],
    at: W::Vector,
) -> (W::Vector, W::Vector) {
    let (mut value, mut slope) = (w.splat(0.0), w.splat(0.0));
    for c in coefficients.iter().rev() {
        slope = slope * at + value;
        value = value * at + *c;
    }
    (value, slope)
}

/// Newton steps at most; the start is known to a ten-thousandth of the step.
const MOST_NEWTON: usize = 8;

/// A zero near σ by Newton's rule, down to the rounding of the value, and the lanes of
/// `asked` in which there is one: it must not leave the cell.
#[inline(always)]
pub(crate) fn zero_near<W: Width>(
    w: W,
    coefficients: &LocalCoefficients<W>,
    mut sigma: W::Vector,
    asked: u64,
) -> (W::Vector, u64) {
    let mut rounding = w.splat(0.0);
    for c in coefficients {
        rounding = rounding + w.splat(f64::EPSILON) * w.abs(*c);
    }
    let (mut done, mut left) = (w.greater(w.splat(0.0), w.splat(0.0)), asked);
    let mut found = 0;
    for _ in 0..MOST_NEWTON {
        let (value, slope) = horner(w, coefficients, sigma);
        let step = value / slope;
        sigma = w.select(done, sigma, sigma - step);
        left &= w.bits(w.at_most(w.abs(sigma), w.splat(1.25)));
        let small = w.at_most(w.abs(step), w.splat(8.0 * f64::EPSILON));
        done = w.either(done, w.either(w.at_most(w.abs(value), rounding), small));
        found = left & w.bits(done);
        if found == left {
            break;
        }
    }
    (sigma, found)
}
