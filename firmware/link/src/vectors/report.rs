//! The stored files as a part of an image, and their replay in one call with its
//! result in words.

use core::fmt;

use super::replay;

/// Name and contents of a file of vectors.
pub type File = (&'static str, &'static str);

macro_rules! files {
    ($($name:literal)*) => {
        [$(($name, include_str!(concat!("../../vectors/", $name)))),*]
    };
}

/// Every stored file, 304 kB of text; an image that does not name it has none of
/// it.
pub const ALL: [File; 35] = files! {
    "ahead.txt"
    "back-calculation.txt"
    "backlash-compensation-acceleration.txt"
    "backlash-compensation-velocity.txt"
    "clamp.txt"
    "dead-band.txt"
    "derivative-filter.txt"
    "dither.txt"
    "dual-loop.txt"
    "error-feedback.txt"
    "fault-emergency-stop.txt"
    "fault-encoder-glitch.txt"
    "fault-encoder-loss.txt"
    "fault-following-error.txt"
    "fault-hardware-bus.txt"
    "fault-missed-tick.txt"
    "fault-saturation-too-long.txt"
    "fault-setpoint-underrun.txt"
    "feed-forward-gains-change.txt"
    "feed-forward.txt"
    "gains-change.txt"
    "hold-integral.txt"
    "lag.txt"
    "large-derivative.txt"
    "late-tick.txt"
    "load-counter.txt"
    "measurement-gains-change.txt"
    "negative-loss.txt"
    "out-of-range.txt"
    "paper.txt"
    "slew-at-the-end.txt"
    "slew.txt"
    "stretches.txt"
    "wrap-16.txt"
    "wrap-32.txt"
};

/// Law, both ends of a counter and every fault in 76 kB, for a flash of 128 kB. A
/// smaller one takes files of its own choice.
pub const SMALL: [File; 11] = files! {
    "fault-emergency-stop.txt"
    "fault-encoder-glitch.txt"
    "fault-encoder-loss.txt"
    "fault-following-error.txt"
    "fault-hardware-bus.txt"
    "fault-missed-tick.txt"
    "fault-saturation-too-long.txt"
    "fault-setpoint-underrun.txt"
    "paper.txt"
    "wrap-16.txt"
    "wrap-32.txt"
};

/// Replays `files` and writes a line of the result: the number of rows that are
/// equal, or the first that is not, with what came and what the file has. True
/// if all are equal.
///
/// # Errors
/// [`fmt::Error`] of `out`.
///
/// ```
/// use firmware_link::vectors::{SMALL, report};
///
/// let mut line = String::new();
/// assert_eq!(report(SMALL, &mut line), Ok(true));
/// assert_eq!(line, "1227 rows of 11 files, all equal\n");
/// ```
pub fn report(
    files: impl IntoIterator<Item = File>,
    out: &mut impl fmt::Write,
) -> Result<bool, fmt::Error> {
    let (mut rows, mut count): (usize, usize) = (0, 0);
    for (name, text) in files {
        match replay(text) {
            Ok(equal) => rows = rows.saturating_add(equal),
            Err(mismatch) => {
                let before = mismatch.line.saturating_sub(1);
                let row = text.lines().nth(before).unwrap_or_default();
                writeln!(out, "{name}, {mismatch}; the file has {row}")?;
                return Ok(false);
            }
        }
        count = count.saturating_add(1);
    }
    writeln!(out, "{rows} rows of {count} files, all equal")?;
    Ok(true)
}
