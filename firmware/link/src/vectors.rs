//! Golden vectors: what the axis gives for stored inputs, number by number, on
//! every processor.
//!
//! The files are `firmware/link/vectors/*.txt`, their format is in the `README.md`
//! beside them. Whoever brings the controller to another processor replays them
//! there, with [`replay()`] on the processor itself, or row by row from a host
//! that has it at the end of a line: [`rows()`] needs no axis.
//!
//! ```
//! use firmware_link::vectors::{What, replay};
//!
//! // Kp = 2 codes per count behind 12 bits; 10 counts behind its setpoint.
//! let file = "\
//! dac_bits = 12
//! kp = 1073741824 29
//!
//! ES 0 0 - 0 0 next 0 0 0 | 0 0 moving 1 0 -
//! - 1 90 - 0 0 last 100 0 0 | 20 10 holding 1 0 -
//! ";
//! assert_eq!(replay(file), Ok(2));
//!
//! // One code of it is another.
//! let other = file.replace("| 20 10", "| 21 10");
//! let mismatch = replay(&other).unwrap_err();
//! assert_eq!((mismatch.line, mismatch.what), (5, What::Outputs));
//! ```

mod row;
mod settings;

use core::fmt;
use core::str::Lines;

use firmware::axis::{Axis, AxisState};

pub use row::{Given, Wanted};
pub use settings::Settings;

/// A row with all that comes before it.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Number of its line, from 1.
    pub line: usize,
    /// The axis, where it is another from this row on. The first row has it;
    /// each later one comes with [`firmware::AxisState::gains_changed`].
    pub axis: Option<Axis>,
    /// Inputs of the sample.
    pub given: Given<'a>,
    /// Outputs that it must give.
    pub wanted: Wanted,
}

/// Line at which a file and an axis part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mismatch {
    /// Number of the line, from 1.
    pub line: usize,
    /// In what.
    pub what: What,
}

/// Mistakes of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// It is neither a setting nor a row.
    Unreadable,
    /// The firmware refuses the settings before it.
    Settings,
    /// The axis refuses a request of the row.
    Request,
    /// The outputs of the row are others.
    Outputs,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.what {
            What::Unreadable => "it is neither a setting nor a row",
            What::Settings => "the firmware refuses the settings before it",
            What::Request => "the axis refuses a request of it",
            What::Outputs => "the axis gives other outputs",
        };
        write!(f, "line {}: {what}", self.line)
    }
}

impl core::error::Error for Mismatch {}

/// The rows of a file; see [`rows()`].
#[derive(Debug, Clone)]
pub struct Rows<'a> {
    lines: Lines<'a>,
    /// Of the last line.
    line: usize,
    settings: Settings,
    changed: bool,
}

/// The rows of a file with the axis that each is for. A line that cannot be
/// read, or settings that the firmware refuses, come as [`Mismatch`].
pub fn rows(text: &str) -> Rows<'_> {
    Rows {
        lines: text.lines(),
        line: 0,
        settings: Settings::default(),
        changed: true,
    }
}

impl<'a> Iterator for Rows<'a> {
    type Item = Result<Row<'a>, Mismatch>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let content = self.lines.next()?.trim();
            self.line = self.line.saturating_add(1);
            if content.is_empty() || content.starts_with('#') {
                continue;
            }
            match content.split_once('|') {
                Some((inputs, outputs)) => {
                    let line = self.line;
                    let row = self.row(inputs, outputs);
                    return Some(row.map_err(|what| Mismatch { line, what }));
                }
                None if self.settings.set(content).is_some() => self.changed = true,
                None => {
                    return Some(Err(Mismatch {
                        line: self.line,
                        what: What::Unreadable,
                    }));
                }
            }
        }
    }
}

impl<'a> Rows<'a> {
    fn row(&mut self, inputs: &'a str, outputs: &str) -> Result<Row<'a>, What> {
        let given = Given::read(inputs).ok_or(What::Unreadable)?;
        let wanted = Wanted::read(outputs).ok_or(What::Unreadable)?;
        let axis = if core::mem::take(&mut self.changed) {
            Some(self.settings.axis().ok_or(What::Settings)?)
        } else {
            None
        };
        Ok(Row {
            line: self.line,
            axis,
            given,
            wanted,
        })
    }
}

/// The number of rows in a file whose every row the axis gives.
///
/// # Errors
/// [`Mismatch`] with the first line where file and axis part.
pub fn replay(text: &str) -> Result<usize, Mismatch> {
    let mut running: Option<(Axis, AxisState)> = None;
    let mut count: usize = 0;
    for row in rows(text) {
        let row = row?;
        if let Some(axis) = row.axis {
            running = Some(match running {
                None => (axis, AxisState::start(&axis)),
                Some((_, mut state)) => {
                    state.gains_changed();
                    (axis, state)
                }
            });
        }
        let line = row.line;
        let fail = |what| Mismatch { line, what };
        let (axis, state) = running.as_mut().ok_or(fail(What::Settings))?;
        sample(axis, state, &row).map_err(fail)?;
        count = count.saturating_add(1);
    }
    Ok(count)
}

fn sample(axis: &Axis, state: &mut AxisState, row: &Row<'_>) -> Result<(), What> {
    let mut given = row.given;
    for event in given.events() {
        axis.request(state, event).map_err(|_| What::Request)?;
    }
    let output = axis.tick(state, &row.given.inputs, &mut given);
    let gave = Wanted {
        output,
        fault: state.fault().copied(),
    };
    if gave == row.wanted {
        Ok(())
    } else {
        Err(What::Outputs)
    }
}
