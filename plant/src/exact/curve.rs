//! A quantity over a step as one polynomial that is known to within a remainder, in
//! Bernstein form, for one run or many side by side: whether it stays above zero, and where it
//! first does not.

use crate::numerics::bernstein::{halves, value_and_slope};
use crate::numerics::width::{One, Width};

/// Coefficients of the slope.
pub(crate) const SLOPES: usize = 11;
/// Coefficients of the quantity.
pub(crate) const VALUES: usize = 12;

/// One quantity over one step.
#[derive(Clone, Copy)]
pub(crate) struct Curve<W: Width> {
    /// Bernstein coefficients over the step.
    pub(crate) values: [W::Vector; VALUES],
    /// Those of its slope, per step.
    pub(crate) slopes: [W::Vector; SLOPES],
    /// Error of each of the two.
    pub(crate) stray: W::Vector,
}

/// First zero of a quantity, and the stretch that has no other.
pub(crate) struct Zero<W: Width> {
    pub(crate) theta: W::Vector,
    pub(crate) from: W::Vector,
    pub(crate) to: W::Vector,
    /// The lanes in which that is known.
    pub(crate) known: u64,
}

/// What a coefficient of the slope adds to the one of the quantity.
pub(crate) const ELEVENTH: f64 = 1.0 / 11.0;

/// Rounding of the values, and of a look at them.
const EVALUATION: f64 = 16.0 * f64::EPSILON;

impl<W: Width> Curve<W> {
    /// From the value at the start and the coefficients of the slope.
    #[inline(always)]
    pub(crate) fn new(
        w: W,
        start: W::Vector,
        slopes: [W::Vector; SLOPES],
        stray: W::Vector,
    ) -> Self {
        let mut values = [start; VALUES];
        let mut size = w.abs(start);
        for (i, slope) in slopes.iter().enumerate() {
            values[i + 1] = values[i] + *slope * w.splat(ELEVENTH);
            size = size + w.abs(*slope);
        }
        Self {
            values,
            slopes,
            stray: stray + w.splat(EVALUATION) * size,
        }
    }

    /// The lanes in which the quantity stays positive over the whole step.
    #[inline(always)]
    pub(crate) fn holds(&self, w: W) -> u64 {
        w.bits(exceeding(w, &self.values, self.stray))
    }

    /// The same up to θ; the zero at the start is divided out.
    #[inline(always)]
    pub(crate) fn holds_after_start(&self, w: W, theta: W::Vector) -> u64 {
        let all = w.bits(exceeding(w, &without_start(w, &self.values), self.stray));
        if all == (1 << W::LANES) - 1 {
            return all;
        }
        let part = without_start(w, &left_of(w, &self.values, theta));
        all | w.bits(exceeding(w, &part, self.stray))
    }

    /// The same up to θ.
    #[inline(always)]
    pub(crate) fn holds_until(&self, w: W, theta: W::Vector) -> u64 {
        let all = self.holds(w);
        if all == (1 << W::LANES) - 1 {
            return all;
        }
        all | w.bits(exceeding(w, &left_of(w, &self.values, theta), self.stray))
    }

    /// The first zero in the lanes of `asked` in which the quantity falls through
    /// it once, by more than `noise`, over the step or one half of it, and is
    /// known to fall there.
    #[inline(always)]
    pub(crate) fn first_zero(&self, w: W, noise: W::Vector, asked: u64) -> Zero<W> {
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
    pub(crate) fn falls_within(&self, w: W, from: W::Vector, to: W::Vector) -> W::Mask {
        let (slope, _) = value_and_slope(w, &self.slopes, w.splat(0.5) * (from + to));
        let mut bend = w.splat(0.0);
        for pair in self.slopes.windows(2) {
            bend = w.max(w.abs(pair[1] - pair[0]), bend);
        }
        let highest = slope + w.splat(10.0) * bend * (to - from) + self.stray;
        w.greater(w.splat(0.0), highest)
    }

    /// The values up to θ; the slopes stay those of the whole step.
    #[inline(always)]
    pub(crate) fn values_until(&self, w: W, theta: W::Vector) -> [W::Vector; VALUES] {
        part_of(w, &self.values, theta)
    }

    /// The part up to θ.
    #[inline(always)]
    pub(crate) fn until(&self, w: W, theta: W::Vector) -> Self {
        let one = w.splat(1.0);
        let whole = w.at_most(one, theta);
        let mut slopes = part_of(w, &self.slopes, theta);
        for slope in &mut slopes {
            *slope = w.select(whole, one, theta) * *slope;
        }
        Self {
            values: self.values_until(w, theta),
            slopes,
            stray: self.stray,
        }
    }

    /// A quantity that starts at `start` and has these slopes, known to within `stray`, less
    /// this one.
    #[inline(always)]
    pub(crate) fn less_from(
        &self,
        w: W,
        (start, mut slopes, stray): (W::Vector, [W::Vector; SLOPES], W::Vector),
    ) -> Self {
        for (slope, own) in slopes.iter_mut().zip(&self.slopes) {
            *slope = *slope - *own;
        }
        Self::new(w, start - self.values[0], slopes, self.stray + stray)
    }

    /// Upper bound of the magnitude.
    #[inline(always)]
    pub(crate) fn upper(&self, w: W) -> W::Vector {
        let mut upper = w.splat(0.0);
        for value in &self.values {
            upper = w.max(w.abs(*value), upper);
        }
        upper + self.stray
    }

    /// The lanes in which the quantity does not turn.
    #[inline(always)]
    pub(crate) fn is_monotone(&self, w: W) -> u64 {
        w.bits(exceeding(w, &self.rising_first(w), self.stray))
    }

    /// The slopes, of the other sign where the first one is not positive.
    #[inline(always)]
    fn rising_first(&self, w: W) -> [W::Vector; SLOPES] {
        let rises = w.greater(self.slopes[0], w.splat(0.0));
        let sign = w.select(rises, w.splat(1.0), w.splat(-1.0));
        let mut slopes = self.slopes;
        for slope in &mut slopes {
            *slope = sign * *slope;
        }
        slopes
    }

    /// θ of the one turn of the quantity, and the lanes of `asked` in which it is known. The
    /// sketch tells nothing about others that are not monotone.
    #[inline(always)]
    pub(crate) fn turn(&self, w: W, asked: u64) -> (W::Vector, u64) {
        let slopes = self.rising_first(w);
        let zero = w.splat(0.0);
        let turn = sole_zero(w, &slopes, (self.stray, zero), asked);
        // It must not turn back within the remainder either.
        let known = turn.known & falls_once(w, &slopes, zero - self.stray);
        (turn.theta, known)
    }
}

/// Answer of a polynomial with a remainder about the first zero on \[0, 1\] of
/// something that is positive at 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Found {
    /// There is none.
    None,
    /// There is one, near the first of these; from the second to the third there is no other.
    At([f64; 3]),
    /// The remainder does not let it tell.
    Unclear,
}

/// The first zero of a quantity of one run that is positive at the start and known to
/// within `stray`; it counts if the quantity falls below `−noise`. Stretches
/// that do not tell are halved `halvings` times.
pub(crate) fn first_zero<const N: usize>(
    b: &[f64; N],
    stray: f64,
    noise: f64,
    halvings: u32,
) -> Found {
    if exceeding(One, b, stray) {
        return Found::None;
    }
    let starts_above = b[0] > stray;
    if !starts_above {
        return Found::Unclear;
    }
    let zero = sole_zero(One, b, (stray, noise), 1);
    if zero.known != 0 {
        return Found::At([zero.theta, zero.from, zero.to]);
    }
    if halvings == 0 {
        return Found::Unclear;
    }
    let (left, right) = halves(One, b);
    let (found, middle) = match first_zero(&left, stray, noise, halvings - 1) {
        Found::None => (first_zero(&right, stray, noise, halvings - 1), 0.5),
        found => (found, 0.0),
    };
    match found {
        Found::At(zero) => Found::At(zero.map(|theta| middle + 0.5 * theta)),
        found => found,
    }
}

/// The zero of a polynomial p, in the lanes of `asked` in which its coefficients fall through
/// zero once, by more than `noise`, and through `stray` too. Let |p(θ)| ≤ s with s no less than
/// `stray`, `−m` the slope there and K a bound of |p''|. Then p falls by at least `¾·m` per θ as
/// far as `u = 8·s/m` to both sides if `K·u ≤ m/4`: from more than `stray` to
/// less than `−stray`. Before that p stays above `stray`, as it falls through
/// that but once.
#[inline(always)]
fn sole_zero<W: Width, const N: usize>(
    w: W,
    b: &[W::Vector; N],
    (stray, noise): (W::Vector, W::Vector),
    asked: u64,
) -> Zero<W> {
    let (zero, degree) = (w.splat(0.0), const { (N - 1) as f64 });
    let above = w.greater(b[0], stray);
    let ends_below = w.greater(zero - (stray + noise), b[N - 1]);
    let mut known = asked & w.bits(w.both(above, ends_below));
    known &= falls_once(w, b, zero) & falls_once(w, b, stray);
    let mut theta = start_of_newton(w, b);
    let (mut value, mut slope) = (zero, zero);
    let mut close = 0;
    for _ in 0..MOST_NEWTON {
        if known == 0 {
            break;
        }
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
    let bends = bend * w.splat(degree) * w.splat(degree - 1.0) * reach;
    let straight = w.at_most(bends, w.splat(0.25) * m);
    known &= w.bits(w.both(w.greater(m, zero), straight));
    Zero {
        theta,
        from: theta - reach,
        to: theta + reach,
        known,
    }
}

/// Distance from a zero at which θ is near enough: the solution itself is asked for the rest.
const CLOSE: f64 = 1e-4;

/// Newton steps at most, from where the control polygon falls through zero.
const MOST_NEWTON: usize = 6;

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
fn falls_once<W: Width, const N: usize>(w: W, b: &[W::Vector; N], level: W::Vector) -> u64 {
    let (mut below, mut again) = (0, 0);
    for b in b {
        let above = w.bits(w.greater(*b, level));
        again |= above & below;
        below |= !above;
    }
    !again & ((1 << W::LANES) - 1)
}

/// Zero of the control polygon, where it falls.
#[inline(always)]
fn start_of_newton<W: Width, const N: usize>(w: W, b: &[W::Vector; N]) -> W::Vector {
    let degree = const { (N - 1) as f64 };
    let (zero, one, step) = (w.splat(0.0), w.splat(1.0), w.splat(1.0 / degree));
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
    let share = from / ((from - to) * w.splat(degree));
    w.select(before, theta, theta + share)
}

/// `(q(θ) − q(0))/θ`, whose remainder is that of the slope: the zero at the
/// start divided out. It begins with the slope, known not to fall.
#[inline(always)]
pub(crate) fn without_start<W: Width>(
    w: W,
    values: &[W::Vector; VALUES],
) -> [W::Vector; VALUES - 1] {
    let mut b = [values[0]; VALUES - 1];
    let mut count = 1.0;
    for (b, value) in b.iter_mut().zip(&values[1..]) {
        *b = (*value - values[0]) * w.splat(11.0 / count);
        count += 1.0;
    }
    b
}

/// The same, or all of them from θ = 1 on.
#[inline(always)]
fn part_of<W: Width, const N: usize>(w: W, b: &[W::Vector; N], theta: W::Vector) -> [W::Vector; N] {
    let whole = w.at_most(w.splat(1.0), theta);
    if w.bits(whole) == (1 << W::LANES) - 1 {
        return *b;
    }
    let mut part = left_of(w, b, theta);
    for (part, b) in part.iter_mut().zip(b) {
        *part = w.select(whole, *b, *part);
    }
    part
}

/// Coefficients of the part up to θ.
#[inline(always)]
pub(crate) fn left_of<W: Width, const N: usize>(
    w: W,
    b: &[W::Vector; N],
    theta: W::Vector,
) -> [W::Vector; N] {
    let (mut left, mut row) = (*b, *b);
    let rest = w.splat(1.0) - theta;
    for (i, corner) in left.iter_mut().enumerate() {
        *corner = row[0];
        for j in 0..N - 1 - i {
            row[j] = rest * row[j] + theta * row[j + 1];
        }
    }
    left
}
