//! Polynomials that are known for certain, quadrature, and time as a number.

pub(crate) mod bernstein;
pub(crate) mod quadrature;

/// Nanoseconds as seconds, correctly rounded.
pub(crate) fn seconds(ns: u64) -> f64 {
    count(ns) / 1e9
}

/// A count as a float; exact below 2^53, which is 104 days in nanoseconds.
#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
pub(crate) fn count(n: u64) -> f64 {
    n as f64
}
