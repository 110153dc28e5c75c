//! The first zero of something that is known as a polynomial in Bernstein form
//! with a remainder: there is none, there is one and where, or the remainder
//! does not let it tell.

use super::sketch::VALUES;
use crate::numerics::bernstein::halves;

/// What a polynomial with a remainder tells about the first zero on \[0, 1\] of
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

/// Whether the coefficients less `level` change their sign once.
pub(super) fn falls_once<const N: usize>(b: &[f64; N], level: f64) -> bool {
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

/// How near a zero θ must be: the solution itself is asked for the rest.
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
pub(super) fn left_of<const N: usize>(b: &[f64; N], theta: f64) -> [f64; N] {
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
