//! Time is counted in nanoseconds and turned into seconds only to be shown or
//! to evaluate the motion command.

/// Nanoseconds as seconds, correctly rounded.
#[expect(
    clippy::cast_precision_loss,
    reason = "exact below 2^53 ns, which is 104 days"
)]
pub fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}
