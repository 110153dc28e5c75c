//! Rest of an axis: ripple, limit cycle, and how much of encoder and
//! converter is at work.
//!
//! At rest is the axis from the end of the motion (on rung `firmware` from the
//! last request, gain change or injected fault, if that is later) to the end of
//! the run. Looked at is the *window*, the second half of that: the rows from
//! its middle on, the last 4,096 of them at most, so that memory stays bounded.
//! With fewer than 8 rows there is no window and all figures of it are null.
//!
//! The carriage is taken at the rows alone, the samples, on rung `continuous`
//! every `run.row_interval_s`: what oscillates faster than twice their distance is
//! seen too small or too slow.
//!
//! ```text
//! seen      the window, and what its rows leave behind: positions, ranges of codes and counts
//! ripple    how far the carriage strays from a straight line, and whether regularly
//! feeding   the quantiser, gap or friction that keeps a cycle going
//! ```

pub mod feeding;
mod ripple;
mod seen;

pub use seen::{FEWEST, Window};
pub(crate) use seen::{Range, Seen};

#[cfg(test)]
mod tests;
