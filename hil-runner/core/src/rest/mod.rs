//! Rest of an axis: ripple, limit cycle, and how much of encoder and
//! converter is at work.
//!
//! At rest is the axis from the end of the motion (on rung `firmware` from the
//! last request, gain change or injected fault, if that is later) to the end of
//! the run. Looked at is the *window*, the second half of that: the rows from
//! its middle on, the last 4,096 of them at most, so that memory stays bounded;
//! or as much of its end as `run.rest_window_s` asks for.
//! With fewer than 8 rows there is no window and all figures of it are null.
//!
//! The carriage is taken at the rows alone, the samples, on rung `continuous`
//! every `run.row_interval_s`: what oscillates faster than twice their distance is
//! seen too small or too slow.
//!
//! ```text
//! seen      what the rows of runs side by side leave behind
//! ripple    how far the carriage strays from a straight line, and whether regularly
//! feeding   the quantiser, gap or friction that keeps a cycle going
//! ```

pub mod feeding;
mod ripple;
mod seen;
#[cfg(test)]
mod tests;

#[cfg(feature = "lanes")]
pub(crate) use self::ripple::Line;
#[cfg(feature = "lanes")]
pub(crate) use self::seen::AtRest;
pub(crate) use self::seen::{Seen, SeenRows};
use crate::case::{Case, Law};
use crate::message::whole;
use crate::number::{self, seconds};

/// Lowest and highest of whole numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub(crate) lowest: f64,
    pub(crate) highest: f64,
}

impl Range {
    /// Of nothing yet.
    pub(crate) const EMPTY: Self = Self {
        lowest: f64::INFINITY,
        highest: f64::NEG_INFINITY,
    };

    /// The range of both.
    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            lowest: self.lowest.min(other.lowest),
            highest: self.highest.max(other.highest),
        }
    }

    /// Highest less lowest; 0 of nothing.
    pub(crate) fn width(&self) -> u64 {
        u64::try_from(whole(self.highest - self.lowest)).unwrap_or(0)
    }

    /// The smallest n with all of it in −2^(n−1) … 2^(n−1) − 1, at least 1.
    pub(crate) fn signed_bits(&self) -> u32 {
        // A negative number −m − 1 takes as many bits as m.
        let bits = |n: f64| {
            let n = whole(n);
            i64::BITS - if n < 0 { !n } else { n }.leading_zeros()
        };
        bits(self.lowest).max(bits(self.highest)) + 1
    }

    /// Bits that tell all values from lowest to highest apart,
    /// `ceil(log2(highest − lowest + 1))`.
    pub(crate) fn bits_of_width(&self) -> u32 {
        u64::BITS - self.width().leading_zeros()
    }
}

/// Rows of a window at least: a line takes two, three periods some more.
pub const FEWEST: u64 = 8;

/// Rows of a window at most that nobody asked for: 64 kB of positions.
pub(crate) const MOST: u64 = 4_096;

/// Rows of `run.rest_window_s` at most: 16 MB of positions.
const MOST_WANTED: u64 = 1_000_000;

/// Difference at which two times are one \[s\]: the motion's end is a sum of seconds.
const ROUNDING_S: f64 = 1e-12;

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
        let interval_ns = interval_ns(case)?;
        let (from_s, most) = match case.run.rest_window_ns {
            Some(window_ns) => (wanted_from_s(case, window_ns)?, MOST_WANTED),
            None => {
                let (rest_s, end_s) = (rest_from_s(case), seconds(case.run.duration_ns));
                let from_s = 0.5 * (rest_s + end_s);
                (Some(from_s).filter(|&from_s| from_s < end_s)?, MOST)
            }
        };
        let (first, rows) = rows_from(from_s, interval_ns, case);
        (rows >= FEWEST).then_some(Self {
            first: first + rows.saturating_sub(most),
            interval_ns,
        })
    }
}

/// The start of a window of that length at the end of the run, if all of it is rest
/// \[s\].
fn wanted_from_s(case: &Case, window_ns: u64) -> Option<f64> {
    let from_s = seconds(case.run.duration_ns.checked_sub(window_ns)?);
    (from_s + ROUNDING_S >= rest_from_s(case)).then_some(from_s)
}

/// The first row that is not before a time, and how many there are from it on.
fn rows_from(from_s: f64, interval_ns: u64, case: &Case) -> (u64, u64) {
    // The division may be off by a rounding: one row earlier, then on.
    let estimate = whole((from_s / seconds(interval_ns)).floor());
    let mut first = u64::try_from(estimate).unwrap_or(0).saturating_sub(1);
    while seconds(first.saturating_mul(interval_ns)) < from_s {
        first += 1;
    }
    let last = case.run.duration_ns / interval_ns;
    (first, (last + 1).saturating_sub(first))
}

/// From row to row of a case \[ns\]; `None` without a sample time.
fn interval_ns(case: &Case) -> Option<u64> {
    let interval_ns = match case.controller.law {
        Law::Continuous => Some(case.run.row_interval_ns),
        _ => case.controller.sample_time_ns,
    };
    interval_ns.filter(|&ns| ns > 0)
}

/// What is allowed where `run.rest_window_s` does not lie within the rest, or has
/// too few or too many rows.
pub(crate) fn unfit_window(case: &Case) -> Option<String> {
    let (window_ns, interval_ns) = (case.run.rest_window_ns?, interval_ns(case)?);
    let Some(from_s) = wanted_from_s(case, window_ns) else {
        let rest_s = (seconds(case.run.duration_ns) - rest_from_s(case)).max(0.0);
        let rest = number::table(rest_s);
        return Some(format!(
            "the window must lie within the rest, which the run ends with and which takes {rest} s"
        ));
    };
    let (_, rows) = rows_from(from_s, interval_ns, case);
    let interval = number::table(seconds(interval_ns));
    let fits = (FEWEST..=MOST_WANTED).contains(&rows);
    (!fits).then(|| {
        format!(
            "its samples, {interval} s apart, would be {rows}; {FEWEST} to {MOST_WANTED} are allowed"
        )
    })
}

/// End of the last thing that is asked of the axis or happens to it \[s\].
pub fn rest_from_s(case: &Case) -> f64 {
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
    let within = |ns: &u64| *ns < case.run.duration_ns;
    let within = times_ns.into_iter().flatten().filter(within);
    within.map(seconds).fold(motion_s, f64::max)
}
