//! The rows that the figures of rest are taken from.

use crate::case::{Case, Law};
use crate::controllers::whole;
use crate::time::seconds;

/// Rows of a window at least: a line takes two, three periods some more.
pub const FEWEST: u64 = 8;

/// Rows of a window at most: 32 kB of positions.
const MOST: u64 = 4_096;

/// Consecutive rows up to the end of the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Number of the first row.
    pub first: u64,
    /// From row to row \[ns\].
    pub interval_ns: u64,
}

impl Window {
    /// The window of a case; `None` where it does not rest long enough.
    pub fn of(case: &Case) -> Option<Self> {
        let interval_ns = match case.controller.law {
            Law::Continuous => Some(case.run.row_interval_ns),
            _ => case.controller.sample_time_ns,
        };
        let interval_ns = interval_ns.filter(|&ns| ns > 0)?;
        let end_s = seconds(case.run.duration_ns);
        let middle_s = 0.5 * (rest_from_s(case) + end_s);
        if middle_s >= end_s {
            return None;
        }
        let last = case.run.duration_ns / interval_ns;
        // The division may be off by a rounding: one row earlier, then on.
        let estimate = whole((middle_s / seconds(interval_ns)).floor());
        let mut first = u64::try_from(estimate).unwrap_or(0).saturating_sub(1);
        while seconds(first.saturating_mul(interval_ns)) < middle_s {
            first += 1;
        }
        let rows = (last + 1).saturating_sub(first);
        (rows >= FEWEST).then_some(Self {
            first: first.max((last + 1).saturating_sub(MOST)),
            interval_ns,
        })
    }
}

/// When the last thing that is asked of the axis is over, or happens to it \[s\].
fn rest_from_s(case: &Case) -> f64 {
    let motion_s = case.motion.end_s();
    if case.controller.law != Law::Firmware {
        return motion_s;
    }
    let options = &case.options;
    let (requests, injections) = (&options.requests, &options.injections);
    let times_ns = [
        requests.disable_ns,
        requests.enable_ns,
        requests.emergency_stop_ns,
        requests.emergency_stop_release_ns,
        requests.reset_ns,
        options.gain_change.map(|change| change.at_ns),
        injections.encoder_freeze_ns,
        injections.encoder_glitch.map(|glitch| glitch.at_ns),
        injections.missed_tick_ns,
        injections.bus_error_ns,
        injections.setpoint_underrun_ns,
    ];
    let within = times_ns
        .into_iter()
        .flatten()
        .filter(|&ns| ns < case.run.duration_ns);
    within.map(seconds).fold(motion_s, f64::max)
}
