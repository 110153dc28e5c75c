//! A file of vectors, row by row.

use core::fmt;
use core::str::Lines;

use super::row::{Given, Wanted};
use super::settings::Settings;
use firmware::axis::Axis;

/// A row with all that comes before it.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Number of its line, from 1.
    pub line: usize,
    /// The axis, where it is another from this row on. The first row has it;
    /// each later one comes with [`firmware::AxisState::gains_changed`].
    pub axis: Option<Axis>,
    /// What goes into the sample.
    pub given: Given<'a>,
    /// What must come out of it.
    pub wanted: Wanted,
}

/// Where a file and an axis part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mismatch {
    /// Number of the line, from 1.
    pub line: usize,
    /// In what.
    pub what: What,
}

/// What is wrong with a line.
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
