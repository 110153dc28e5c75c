//! Golden vectors: what the axis gives for stored inputs, number by number, on
//! every processor.
//!
//! The files are `firmware/link/vectors/*.txt`, their format is in the `README.md`
//! beside them. Whoever brings the controller to another processor replays them
//! there, with one call of [`report()`] on the processor itself, or row by row from
//! a host that has it at the end of a line: [`rows()`] needs no axis.
//!
//! ```
//! use firmware_link::vectors::replay;
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
//! assert_eq!(mismatch.to_string(), "line 5: the axis gives 20 10 holding 1 0 -");
//! ```

mod report;
mod row;
mod settings;

use firmware::axis::{Axis, AxisState};
use thiserror::Error;

pub use report::{ALL, File, SMALL, report};
pub use row::{Given, Wanted};
pub use settings::Settings;

/// A row with all that comes before it.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Number of its line, from 1.
    pub line: usize,
    /// The axis, where it is another from this row on. The first row has it;
    /// each later one comes with [`firmware::AxisState::change`].
    pub axis: Option<Axis>,
    /// Inputs of the sample.
    pub given: Given<'a>,
    /// Outputs that it must give.
    pub wanted: Wanted,
}

/// Line at which a file and an axis part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("line {line}: {what}")]
pub struct Mismatch {
    /// Number of the line, from 1.
    pub line: usize,
    /// In what.
    pub what: What,
}

/// Mistakes of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum What {
    /// It is neither a setting nor a row.
    #[error("it is neither a setting nor a row")]
    Unreadable,
    /// The firmware refuses the settings before it.
    #[error("the firmware refuses the settings before it")]
    Settings,
    /// The axis refuses a request of the row.
    #[error("the axis refuses a request of it")]
    Request,
    /// The outputs of the row are others than these of the axis.
    #[error("the axis gives {0}")]
    Outputs(Wanted),
}

/// The rows of a file with the axis that each is for. A line that cannot be
/// read, or settings that the firmware refuses, come as [`Mismatch`].
pub fn rows(text: &str) -> impl Iterator<Item = Result<Row<'_>, Mismatch>> {
    let (mut settings, mut changed) = (Settings::default(), true);
    text.lines().zip(1..).filter_map(move |(content, line)| {
        let content = content.trim();
        if content.is_empty() || content.starts_with('#') {
            return None;
        }
        let row = match content.split_once('|') {
            Some((inputs, outputs)) => {
                let row = row(line, inputs, outputs, changed.then_some(&settings));
                changed &= row.is_err();
                row
            }
            None if settings.set(content).is_some() => {
                changed = true;
                return None;
            }
            None => Err(What::Unreadable),
        };
        Some(row.map_err(|what| Mismatch { line, what }))
    })
}

/// A row behind `settings`, where they are others than those before.
fn row<'a>(
    line: usize,
    inputs: &'a str,
    outputs: &str,
    settings: Option<&Settings>,
) -> Result<Row<'a>, What> {
    let accepted = |settings: &Settings| settings.axis().ok_or(What::Settings);
    Ok(Row {
        line,
        given: Given::read(inputs).ok_or(What::Unreadable)?,
        wanted: Wanted::read(outputs).ok_or(What::Unreadable)?,
        axis: settings.map(accepted).transpose()?,
    })
}

/// The number of rows in a file whose every row the axis gives.
///
/// # Errors
/// [`Mismatch`] with the first line where file and axis part.
pub fn replay(text: &str) -> Result<usize, Mismatch> {
    let mut running: Option<AxisState> = None;
    let mut count: usize = 0;
    for row in rows(text) {
        let row = row?;
        if let Some(axis) = row.axis {
            running = Some(match running {
                None => AxisState::start(&axis),
                Some(mut state) => {
                    state.change(&axis);
                    state
                }
            });
        }
        let line = row.line;
        let fail = |what| Mismatch { line, what };
        let state = running.as_mut().ok_or(fail(What::Settings))?;
        sample(state, &row).map_err(fail)?;
        count = count.saturating_add(1);
    }
    Ok(count)
}

fn sample(state: &mut AxisState, row: &Row<'_>) -> Result<(), What> {
    let mut given = row.given;
    for event in given.events() {
        state.request(event).map_err(|_| What::Request)?;
    }
    let output = state.tick(&row.given.inputs, &mut given);
    let gave = Wanted {
        output,
        fault: state.fault().copied(),
    };
    if gave == row.wanted {
        Ok(())
    } else {
        Err(What::Outputs(gave))
    }
}
