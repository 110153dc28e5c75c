//! A guard over a step as one polynomial, lane by lane: the operations of
//! `exact::sketch` in their order. Where these would have to
//! look closer, this gives up: the lane is then a single run.

use super::grid::{LaneGrid, States};
use crate::exact::{CLOSE, DRIVING, EVALUATION, MOST_NEWTON, SLOPES, VALUES, binomials};
use crate::numerics::width::Width;

/// A guard in Bernstein form, and what it may be off by.
pub(super) struct Curve<W: Width> {
    pub(super) values: [W::Vector; VALUES],
    slopes: [W::Vector; SLOPES],
    pub(super) stray: W::Vector,
}

/// First zero of a guard, and the stretch that has no other.
pub(super) struct Zero<W: Width> {
    pub(super) theta: W::Vector,
    pub(super) from: W::Vector,
    pub(super) to: W::Vector,
    /// The lanes in which that is known.
    pub(super) known: u64,
}

/// Slopes of δ over a step, and what they may be off by.
pub(super) struct DeltaSlopes<W: Width> {
    slopes: [W::Vector; SLOPES],
    stray: W::Vector,
}

impl<W: Width> DeltaSlopes<W> {
    /// Over the step that begins with `rate`.
    #[inline(always)]
    pub(super) fn new(w: W, grid: &LaneGrid, rate: &States<W>) -> Self {
        let mut slopes = [rate[0]; SLOPES];
        for (slope, row) in slopes.iter_mut().zip(&grid.slopes) {
            *slope = super::grid::sum(w, row, rate);
        }
        let mut stray = w.splat(grid.stray[0]) * w.abs(rate[1]);
        for j in 1..DRIVING {
            stray = stray + w.splat(grid.stray[j]) * w.abs(rate[j + 1]);
        }
        Self { slopes, stray }
    }

    /// About where δ ends that starts here.
    #[inline(always)]
    pub(super) fn end(&self, w: W, start: W::Vector) -> W::Vector {
        let mut change = self.slopes[0];
        for slope in &self.slopes[1..] {
            change = change + *slope;
        }
        start + change / w.splat(11.0)
    }

    /// The guard `sign·δ + offset`, which is `start` at the start; `sign` is 1 or
    /// −1.
    #[inline(always)]
    pub(super) fn guard(&self, w: W, sign: W::Vector, start: W::Vector) -> Curve<W> {
        let mut slopes = self.slopes;
        for slope in &mut slopes {
            *slope = sign * *slope;
        }
        let mut values = [start; VALUES];
        let mut size = w.abs(start);
        for (i, slope) in slopes.iter().enumerate() {
            values[i + 1] = values[i] + *slope / w.splat(11.0);
            size = size + w.abs(*slope);
        }
        Curve {
            values,
            slopes,
            stray: self.stray + w.splat(EVALUATION) * size,
        }
    }
}

impl<W: Width> Curve<W> {
    /// The lanes in which the guard stays positive over the whole step.
    #[inline(always)]
    pub(super) fn holds(&self, w: W) -> u64 {
        exceeds(w, &self.values, self.stray)
    }

    /// The same up to θ; the zero at the start is divided out.
    #[inline(always)]
    pub(super) fn holds_after_start(&self, w: W, theta: W::Vector) -> u64 {
        let all = exceeds(w, &without_start(w, &self.values), self.stray);
        if all == (1 << W::LANES) - 1 {
            return all;
        }
        let part = without_start(w, &left_of(w, &self.values, theta));
        all | exceeds(w, &part, self.stray)
    }

    /// The same up to θ.
    #[inline(always)]
    pub(super) fn holds_until(&self, w: W, theta: W::Vector) -> u64 {
        let all = self.holds(w);
        if all == (1 << W::LANES) - 1 {
            return all;
        }
        all | exceeds(w, &left_of(w, &self.values, theta), self.stray)
    }

    /// The first zero in the lanes of `asked` in which the guard falls through
    /// it once, by more than `noise`, over the step or one half of it, and is
    /// known to fall there.
    #[inline(always)]
    pub(super) fn first_zero(&self, w: W, noise: W::Vector, asked: u64) -> Zero<W> {
        let stray = self.stray;
        let mut zero = sole_zero(w, &self.values, (stray, noise), asked);
        let starts_above = w.bits(w.greater(self.values[0], stray));
        let open = asked & starts_above & !zero.known & !self.holds(w);
        if open != 0 {
            // The left half, or the right one if there is none in that.
            let (mut left, right) = halves(w, &self.values);
            let after = exceeding(w, &left, stray);
            for (left, right) in left.iter_mut().zip(&right) {
                *left = w.select(after, *right, *left);
            }
            let half = sole_zero(w, &left, (stray, noise), open);
            let found = w.lanes(half.known);
            let (by, middle) = (w.splat(0.5), w.select(after, w.splat(0.5), w.splat(0.0)));
            zero.theta = w.select(found, middle + by * half.theta, zero.theta);
            zero.from = w.select(found, middle + by * half.from, zero.from);
            zero.to = w.select(found, middle + by * half.to, zero.to);
            zero.known |= half.known;
        }
        let falls = self.falls_within(w, zero.from, zero.to);
        zero.known &= w.bits(w.both(w.greater(zero.from, w.splat(0.0)), falls));
        zero
    }

    /// Mask of the lanes in which the slope is below zero, for certain, from θ to θ.
    #[inline(always)]
    fn falls_within(&self, w: W, from: W::Vector, to: W::Vector) -> W::Mask {
        let (slope, _) = value_and_slope(w, &self.slopes, w.splat(0.5) * (from + to));
        let mut bend = w.splat(0.0);
        for pair in self.slopes.windows(2) {
            bend = w.max(w.abs(pair[1] - pair[0]), bend);
        }
        let highest = slope + w.splat(10.0) * bend * (to - from) + self.stray;
        w.greater(w.splat(0.0), highest)
    }
}

/// The zero of a polynomial that falls through it once, by more than `noise`.
#[inline(always)]
fn sole_zero<W: Width>(
    w: W,
    b: &[W::Vector; VALUES],
    (stray, noise): (W::Vector, W::Vector),
    asked: u64,
) -> Zero<W> {
    let zero = w.splat(0.0);
    let above = w.greater(b[0], stray);
    let ends_below = w.greater(zero - (stray + noise), b[VALUES - 1]);
    let mut known = asked & w.bits(w.both(above, ends_below));
    known &= falls_once(w, b, zero) & falls_once(w, b, stray);
    let mut theta = start_of_newton(w, b);
    let (mut value, mut slope) = (zero, zero);
    let mut close = 0;
    for _ in 0..MOST_NEWTON {
        (value, slope) = value_and_slope(w, b, theta);
        let enough = w.max(stray, w.splat(CLOSE) * w.abs(slope));
        let there = w.at_most(w.abs(value), enough);
        close = w.bits(there);
        if known & !close == 0 {
            break;
        }
        let next = theta - value / slope;
        // As `clamp(0, 1)`.
        let next = w.select(w.greater(zero, next), zero, next);
        let next = w.select(w.greater(next, w.splat(1.0)), w.splat(1.0), next);
        theta = w.select(there, theta, next);
    }
    known &= close;
    let m = zero - slope;
    let mut bend = zero;
    for three in b.windows(3) {
        let second = (three[2] - three[1]) - (three[1] - three[0]);
        bend = w.max(w.abs(second), bend);
    }
    let reach = w.splat(8.0) * w.max(stray, w.abs(value)) / m;
    let bends = bend * w.splat(11.0) * w.splat(10.0) * reach;
    let straight = w.at_most(bends, w.splat(0.25) * m);
    known &= w.bits(w.both(w.greater(m, zero), straight));
    Zero {
        theta,
        from: theta - reach,
        to: theta + reach,
        known,
    }
}

/// Coefficients of both halves.
#[inline(always)]
fn halves<W: Width>(w: W, b: &[W::Vector; VALUES]) -> ([W::Vector; VALUES], [W::Vector; VALUES]) {
    let (mut left, mut right) = (*b, *b);
    for (i, corner) in left.iter_mut().enumerate() {
        *corner = right[0];
        for j in 0..VALUES - 1 - i {
            right[j] = w.splat(0.5) * (right[j] + right[j + 1]);
        }
    }
    (left, right)
}

/// The lanes in which all coefficients exceed `stray`.
#[inline(always)]
fn exceeds<W: Width, const N: usize>(w: W, b: &[W::Vector; N], stray: W::Vector) -> u64 {
    w.bits(exceeding(w, b, stray))
}

/// Mask of the lanes in which all coefficients exceed `stray`.
#[inline(always)]
fn exceeding<W: Width, const N: usize>(w: W, b: &[W::Vector; N], stray: W::Vector) -> W::Mask {
    let mut all = w.greater(b[0], stray);
    for b in &b[1..] {
        all = w.both(all, w.greater(*b, stray));
    }
    all
}

/// The lanes in which the coefficients less `level` change their sign once.
#[inline(always)]
fn falls_once<W: Width>(w: W, b: &[W::Vector; VALUES], level: W::Vector) -> u64 {
    let (mut below, mut again) = (0, 0);
    for b in b {
        let above = w.bits(w.greater(*b, level));
        again |= above & below;
        below |= !above;
    }
    !again
}

/// Zero of the control polygon, where it falls.
#[inline(always)]
fn start_of_newton<W: Width>(w: W, b: &[W::Vector; VALUES]) -> W::Vector {
    let (zero, one, step) = (w.splat(0.0), w.splat(1.0), w.splat(1.0 / 11.0));
    let mut theta = zero;
    let (mut from, mut to) = (zero, one);
    let mut before = w.at_most(zero, zero);
    for pair in b.windows(2) {
        let falls = w.both(before, w.at_most(pair[1], zero));
        from = w.select(falls, pair[0], from);
        to = w.select(falls, pair[1], to);
        before = w.both(before, w.greater(pair[1], zero));
        theta = w.select(before, theta + step, theta);
    }
    let share = from / ((from - to) * w.splat(11.0));
    w.select(before, theta, theta + share)
}

/// Value and slope at θ.
#[inline(always)]
fn value_and_slope<W: Width, const N: usize>(
    w: W,
    b: &[W::Vector; N],
    theta: W::Vector,
) -> (W::Vector, W::Vector) {
    let of_value = const { binomials::<N>(N - 1) };
    let of_slope = const { binomials::<N>(N - 2) };
    let rest = w.splat(1.0) - theta;
    let (mut value, mut slope, mut power) = (b[0], w.splat(0.0), w.splat(1.0));
    for i in 1..N {
        slope = slope * rest + w.splat(of_slope[i - 1]) * power * (b[i] - b[i - 1]);
        power = power * theta;
        value = value * rest + w.splat(of_value[i]) * power * b[i];
    }
    let degree = if N == VALUES { 11.0 } else { 10.0 };
    (value, w.splat(degree) * slope)
}

/// `(q(θ) − q(0))/θ`.
#[inline(always)]
fn without_start<W: Width>(w: W, values: &[W::Vector; VALUES]) -> [W::Vector; VALUES - 1] {
    let mut b = [values[0]; VALUES - 1];
    let mut count = 1.0;
    for (b, value) in b.iter_mut().zip(&values[1..]) {
        *b = (*value - values[0]) * w.splat(11.0 / count);
        count += 1.0;
    }
    b
}

/// Coefficients of the part up to θ.
#[inline(always)]
fn left_of<W: Width>(w: W, b: &[W::Vector; VALUES], theta: W::Vector) -> [W::Vector; VALUES] {
    let (mut left, mut row) = (*b, *b);
    let rest = w.splat(1.0) - theta;
    for (i, corner) in left.iter_mut().enumerate() {
        *corner = row[0];
        for j in 0..VALUES - 1 - i {
            row[j] = rest * row[j] + theta * row[j + 1];
        }
    }
    left
}
