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

use super::grid::{CELLS, Grid, LocalCoefficients, MOST_LEVELS, TERMS, Window};
use super::levels::{Levels, integral};
use super::system::{Column, Matrix};
use crate::numerics::bernstein::halves;

/// Coefficients of the slope.
pub(crate) const SLOPES: usize = 11;
/// Coefficients of the quantity.
pub(crate) const VALUES: usize = 12;

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
                loop {
                    let kept = if i < degree { b[i] } else { 0.0 };
                    let below = if i > 0 { b[i - 1] } else { 0.0 };
                    b[i] = ((degree - i) as f64 * low * kept + i as f64 * high * below)
                        / degree as f64;
                    if i == 0 {
                        break;
                    }
                    i -= 1;
                }
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

/// Rounding of the coefficients, relative to the largest of them: the
/// rows of [`FIT`] sum up to less than 800.
const ROUNDING: f64 = 800.0 * 16.0 * f64::EPSILON;

/// Powers of the series about the middle of a step at most: over `λt ≤ 4`, as `λT` is at
/// most 8. What the first n leave out is at most some `(λt)ⁿ/n!` of the first (see
/// [`super::levels`]): of 33 powers, `4³³/33! = 8.5e-18`.
const POWERS: usize = 33;

/// τⁿ with τ = 2θ − 1, by its values at the points of interpolation, and the error of
/// that: the eleventh derivative by θ is at most `2¹¹·n!/(n − 11)!`, which makes it
/// `w·2¹¹·C(n, 11)`.
const POWERS_FIT: [[f64; SLOPES]; POWERS] = powers_fit();
const POWERS_STRAY: [f64; POWERS] = powers_stray();

const fn powers_fit() -> [[f64; SLOPES]; POWERS] {
    let mut powers = [[0.0; SLOPES]; POWERS];
    let mut node = 0;
    while node < SLOPES {
        let tau = 2.0 * NODES[node] as f64 / CELLS as f64 - 1.0;
        let (mut n, mut value) = (0, 1.0);
        while n < POWERS {
            let mut i = 0;
            while i < SLOPES {
                powers[n][i] += FIT[i][node] * value;
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
        // f·e^{At} = f + (f·ψ(t))·A at the points of the grid.
        let slopes: Vec<Column<D>> = grid
            .integrals
            .iter()
            .map(|psi| row + a.transpose() * (psi.transpose() * row))
            .collect();
        Self::new(a, &slopes, grid.length_s)
    }

    /// From `f·e^{At}` at every point of the grid.
    fn new(a: &Matrix<D>, rows: &[Column<D>], length_s: f64) -> Self {
        let slopes = FIT.map(|weights| {
            let mut sum = Column::<D>::zeros();
            for (weight, node) in weights.iter().zip(NODES) {
                sum += rows[node] * (*weight * length_s);
            }
            sum
        });
        // T¹¹·f·A¹¹·e^{At} at the grid's points; functions of A commute.
        let scaled = (a * length_s).transpose();
        let mut largest = Column::<D>::zeros();
        let mut rounding = Column::<D>::zeros();
        for row in rows {
            let mut derivative = *row;
            for _ in 0..SLOPES {
                derivative = scaled * derivative;
            }
            largest = largest.sup(&derivative.abs());
            rounding = rounding.sup(&row.abs());
        }
        let magnitude = a.abs();
        let cell_s = length_s / 32.0;
        let grown = Matrix::<D>::identity() + magnitude * integral(&magnitude, cell_s);
        let remainder = grown.transpose() * largest * REMAINDER;
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
        let (a, length_s) = (&levels.a, levels.steps[0].length_s);
        let half_s = 0.5 * length_s;
        let half = match levels.steps.get(1) {
            Some(step) => step.transition,
            None => Matrix::identity() + a * integral(a, half_s),
        };
        let scaled = (a * half_s).transpose();
        let mut term = half.transpose() * row * length_s;
        let (mut slopes, mut stray) = ([Column::zeros(); SLOPES], Column::zeros());
        let mut series = Vec::with_capacity(POWERS);
        let mut left_out = 1.0;
        for (n, (weights, error)) in (1_u32..).zip(POWERS_FIT.iter().zip(POWERS_STRAY)) {
            for (slope, weight) in slopes.iter_mut().zip(weights) {
                *slope += term * *weight;
            }
            stray += term.abs() * (error + ROUNDING);
            series.push(term);
            term = scaled * term / f64::from(n);
            left_out *= levels.growth_per_s * half_s / f64::from(n);
            if left_out < 1e-17 {
                break;
            }
        }
        Some(Self {
            slopes,
            stray,
            series,
        })
    }

    /// The quantity, which is `start` at the start, around `time_s`: by the series about
    /// the middle.
    pub(crate) fn around(
        &self,
        rate: &Column<D>,
        start: f64,
        (time_s, length_s): (f64, f64),
    ) -> (Window, LocalCoefficients) {
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

    /// The quantity `scale·q + offset`, which is `value` at the start, over the
    /// step that begins with `rate`.
    pub(crate) fn curve(&self, rate: &Column<D>, scale: f64, value: f64) -> Curve {
        let stray = scale.abs() * self.stray.dot(&rate.abs());
        Curve::new(value, self.slopes.map(|row| scale * row.dot(rate)), stray)
    }
}

/// One quantity over one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve {
    /// Bernstein coefficients over the step.
    pub(crate) values: [f64; VALUES],
    /// Those of its slope, per step.
    pub(crate) slopes: [f64; SLOPES],
    /// Error of each of the two.
    pub(crate) stray: f64,
}

/// Rounding of the values, and of a look at them.
pub(crate) const EVALUATION: f64 = 16.0 * f64::EPSILON;

impl Curve {
    /// From the value at the start and the coefficients of the slope.
    pub(crate) fn new(start: f64, slopes: [f64; SLOPES], stray: f64) -> Self {
        let mut values = [start; VALUES];
        let mut size = start.abs();
        for (i, slope) in slopes.iter().enumerate() {
            values[i + 1] = values[i] + slope / 11.0;
            size += slope.abs();
        }
        Self {
            values,
            slopes,
            stray: stray + EVALUATION * size,
        }
    }

    /// The values up to θ; the slopes stay those of the whole step.
    pub(crate) fn values_until(&self, theta: f64) -> [f64; VALUES] {
        if theta >= 1.0 {
            return self.values;
        }
        left_of(&self.values, theta)
    }

    /// The part up to θ.
    pub(crate) fn until(&self, theta: f64) -> Self {
        if theta >= 1.0 {
            return *self;
        }
        Self {
            values: self.values_until(theta),
            slopes: left_of(&self.slopes, theta).map(|slope| theta * slope),
            stray: self.stray,
        }
    }

    /// Upper bound of the magnitude.
    pub(crate) fn upper(&self) -> f64 {
        self.values.iter().fold(0.0, |m: f64, b| m.max(b.abs())) + self.stray
    }

    /// True if the slope is below zero, for certain, from θ to θ.
    pub(crate) fn falls_within(&self, from: f64, to: f64) -> bool {
        let slope = value_and_slope(&self.slopes, 0.5 * (from + to)).0;
        let mut bend = 0.0_f64;
        for pair in self.slopes.windows(2) {
            bend = bend.max((pair[1] - pair[0]).abs());
        }
        slope + 10.0 * bend * (to - from) + self.stray < 0.0
    }

    /// Turn of the quantity, if it has one.
    pub(crate) fn turn(&self) -> Found {
        let rises = self.slopes[0] > 0.0;
        let slopes = if rises {
            self.slopes
        } else {
            self.slopes.map(|s| -s)
        };
        match first_zero(&slopes, self.stray, 0.0, 0) {
            // It must not turn back within the remainder either.
            Found::At { .. } if !falls_once(&slopes, -self.stray) => Found::Unclear,
            found => found,
        }
    }
}

/// Answer of a polynomial with a remainder about the first zero on \[0, 1\] of
/// something that is positive at 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Found {
    /// There is none.
    None,
    /// There is one, near here; in `from ..= to` there is no other.
    At { theta: f64, from: f64, to: f64 },
    /// The remainder does not let it tell.
    Unclear,
}

/// The first zero of a quantity that is positive at the start and known to
/// within `stray`; it counts if the quantity falls below `−noise`. Stretches
/// that do not tell are halved `halvings` times.
pub(crate) fn first_zero<const N: usize>(
    b: &[f64; N],
    stray: f64,
    noise: f64,
    halvings: u32,
) -> Found {
    let lowest = b.iter().fold(f64::INFINITY, |m: f64, b| m.min(*b));
    if lowest > stray {
        return Found::None;
    }
    let starts_above = b[0] > stray;
    if !starts_above {
        return Found::Unclear;
    }
    if b[N - 1] < -(stray + noise) && falls_once(b, 0.0) && falls_once(b, stray) {
        let found = sole_zero(b, stray);
        if found != Found::Unclear {
            return found;
        }
    }
    if halvings == 0 {
        return Found::Unclear;
    }
    let (left, right) = halves(b);
    let within = |found, from: f64| match found {
        Found::At {
            theta,
            from: low,
            to,
        } => Found::At {
            theta: from + 0.5 * theta,
            from: from + 0.5 * low,
            to: from + 0.5 * to,
        },
        other => other,
    };
    match first_zero(&left, stray, noise, halvings - 1) {
        Found::None => within(first_zero(&right, stray, noise, halvings - 1), 0.5),
        found => within(found, 0.0),
    }
}

/// True if the coefficients less `level` change their sign once.
fn falls_once<const N: usize>(b: &[f64; N], level: f64) -> bool {
    let mut below = false;
    for b in b {
        if *b > level {
            if below {
                return false;
            }
        } else {
            below = true;
        }
    }
    below
}

/// The zero of a polynomial p whose coefficients fall through zero once, and
/// through `stray` too. Let |p(θ)| ≤ s with s no less than `stray`, `−m` the
/// slope there and K a bound of |p''|. Then p falls by at least `¾·m` per θ as
/// far as `u = 8·s/m` to both sides if `K·u ≤ m/4`: from more than `stray` to
/// less than `−stray`. Before that p stays above `stray`, as it falls through
/// that but once.
fn sole_zero<const N: usize>(b: &[f64; N], stray: f64) -> Found {
    let degree = degree_of::<N>();
    let mut theta = 0.0;
    for pair in b.windows(2) {
        if pair[1] <= 0.0 {
            theta += pair[0] / ((pair[0] - pair[1]) * degree);
            break;
        }
        theta += 1.0 / degree;
    }
    for _ in 0..MOST_NEWTON {
        let (value, slope) = value_and_slope(b, theta);
        if value.abs() <= stray.max(CLOSE * slope.abs()) {
            let (m, mut bend) = (-slope, 0.0_f64);
            let stray = stray.max(value.abs());
            for three in b.windows(3) {
                bend = bend.max(((three[2] - three[1]) - (three[1] - three[0])).abs());
            }
            let reach = 8.0 * stray / m;
            if m > 0.0 && bend * degree * (degree - 1.0) * reach <= 0.25 * m {
                let (from, to) = (theta - reach, theta + reach);
                return Found::At { theta, from, to };
            }
            return Found::Unclear;
        }
        theta = (theta - value / slope).clamp(0.0, 1.0);
    }
    Found::Unclear
}

/// Distance from a zero at which θ is near enough: the solution itself is asked for the rest.
pub(crate) const CLOSE: f64 = 1e-4;

/// Newton steps at most, from where the control polygon falls through zero.
pub(crate) const MOST_NEWTON: usize = 6;

/// The degree of a polynomial with N coefficients.
fn degree_of<const N: usize>() -> f64 {
    // At most 11: the slope's and the quantity's.
    if N == VALUES { 11.0 } else { 10.0 }
}

/// `C(degree, i)`.
pub(crate) const fn binomials<const N: usize>(degree: usize) -> [f64; N] {
    let mut row = [0.0; N];
    row[0] = 1.0;
    let mut i = 1;
    while i <= degree {
        row[i] = row[i - 1] * (degree - i + 1) as f64 / i as f64;
        i += 1;
    }
    row
}

/// Value and slope at θ: Horner's rule in `1 − θ`, with the powers of θ.
pub(crate) fn value_and_slope<const N: usize>(b: &[f64; N], theta: f64) -> (f64, f64) {
    let of_value = const { binomials::<N>(N - 1) };
    let of_slope = const { binomials::<N>(N - 2) };
    let rest = 1.0 - theta;
    let (mut value, mut slope, mut power) = (b[0], 0.0, 1.0);
    for i in 1..N {
        slope = slope * rest + of_slope[i - 1] * power * (b[i] - b[i - 1]);
        power *= theta;
        value = value * rest + of_value[i] * power * b[i];
    }
    (value, degree_of::<N>() * slope)
}

/// Coefficients of the part up to θ.
fn left_of<const N: usize>(b: &[f64; N], theta: f64) -> [f64; N] {
    let (mut left, mut row) = ([0.0; N], *b);
    let rest = 1.0 - theta;
    for (i, corner) in left.iter_mut().enumerate() {
        *corner = row[0];
        for j in 0..N - 1 - i {
            row[j] = rest * row[j] + theta * row[j + 1];
        }
    }
    left
}
