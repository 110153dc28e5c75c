//! How an axis rests: ripple, limit cycle, and how much of encoder and
//! converter is at work.
//!
//! At rest is the axis from the end of the motion (on rung `firmware` from the
//! last request, gain change or injected fault, if that is later) to the end of
//! the run. Looked at is the *window*, the second half of that: the rows from
//! its middle on, the last 4,096 of them at most, so that memory stays bounded.
//! With fewer than 8 rows there is no window and all figures of it are null.
//!
//! The carriage is taken at the rows alone, the samples, on rung `continuous`
//! every `run.row_interval_s`: what swings faster than twice their distance is
//! seen too small or too slow.
//!
//! ```text
//! window    which rows
//! seen      what they leave behind: positions, and ranges of codes and counts
//! ripple    how far the carriage strays from a straight line
//! cycle     whether it does so regularly
//! feeding   which quantiser, gap or friction keeps a cycle going
//! ```

mod cycle;
pub mod feeding;
mod ripple;
mod seen;
mod window;

use cycle::period_samples;
use ripple::Residual;

pub(crate) use seen::{Range, Seen};
pub use window::{FEWEST, Window};

/// What the window of rest shows of the carriage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ripple {
    /// Half of the carriage's swing about its straight line \[µm\].
    pub(crate) ripple_um: f64,
    /// The same where it is a sustained oscillation, else 0 \[µm\].
    pub(crate) limit_cycle_um: f64,
    /// Period of the oscillation \[s\].
    pub(crate) limit_cycle_period_s: Option<f64>,
}

impl Ripple {
    /// From the positions of a window, `interval_s` apart.
    pub(crate) fn of(positions_m: &[f64], interval_s: f64) -> Self {
        let residual = Residual::of(positions_m);
        let ripple_um = 1e6 * residual.amplitude_m();
        let period = period_samples(&residual);
        Self {
            ripple_um,
            limit_cycle_um: period.map_or(0.0, |_| ripple_um),
            limit_cycle_period_s: period.map(|samples| samples * interval_s),
        }
    }
}

/// x_ref − x at the rows of the window of rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RestError {
    /// Largest magnitude \[µm\].
    pub(crate) max_um: f64,
    /// Root mean square \[µm\].
    pub(crate) rms_um: f64,
}

#[cfg(test)]
mod tests;
