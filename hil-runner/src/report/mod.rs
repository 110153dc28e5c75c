//! The report: one HTML file that needs no network, drawn from plain data.
//!
//! A [`Report`] holds what is to be shown and nothing else: no clock, no file,
//! no simulation. [`render`] turns it into the page, and the same report gives
//! the same bytes. Only [`HostTiming`] depends on the machine, which is why it
//! is optional and the page shows it apart.
//!
//! ```
//! use hil_runner::report::{Report, render};
//!
//! let report = Report {
//!     title: "Servo bench".into(),
//!     command_line: "hil-runner".into(),
//!     generated_by: "hil-runner 0.1.0".into(),
//!     reserved: None,
//!     cases: Vec::new(),
//!     ladder: None,
//! };
//! assert!(render(&report)?.starts_with("<!doctype html>"));
//! # Ok::<(), hil_runner::report::ReportError>(())
//! ```
//!
//! # What is in the file
//!
//! * Tables are plain HTML, legible with scripts switched off. They show five
//!   significant digits; each number carries its full value (`<data value>`).
//! * Plots are drawn by uPlot (`assets/uplot`, MIT, copied in unchanged) from
//!   the report as JSON in the page. Curves are rounded to
//!   [`number::PLOT_DIGITS`] significant digits, which no screen can tell from
//!   the original and which halves the file.
//! * A content security policy forbids every load, so that "no network" does
//!   not rest on our word.

mod case_report;
mod context;
mod ladder_report;
pub mod number;
mod page;
#[cfg(test)]
mod sample;
#[cfg(test)]
mod tests;
mod traces;

pub use case_report::{CaseReport, FigureRow, HostTiming, Parameter, VerdictRow};
pub use ladder_report::{Held, LadderReport, LadderRung};
pub(crate) use page::environment;
pub use page::{ReportError, render};
pub use traces::{ContactInterval, Traces};

use serde::Serialize;

/// Everything that one report shows.
///
/// Its `Serialize` is the JSON that stands in the page: figures in full,
/// curves rounded to [`number::PLOT_DIGITS`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Heading of the page.
    pub title: String,
    /// The command that made the report, shown below the heading.
    pub command_line: String,
    /// Program and version, such as `hil-runner 0.1.0`; no date.
    pub generated_by: String,
    /// Why they do not simply pass if they keep their limits, in a few words.
    pub reserved: Option<String>,
    /// The runs, in the order in which they are shown.
    pub cases: Vec<CaseReport>,
    /// The rungs of one case side by side, from `hil-runner ladder`.
    pub ladder: Option<LadderReport>,
}

impl Report {
    /// Whether every verdict of every case passes; `None` without verdicts.
    pub fn passed(&self) -> Option<bool> {
        let mut verdicts = self.cases.iter().flat_map(|case| &case.verdicts).peekable();
        verdicts.peek()?;
        Some(verdicts.all(|verdict| verdict.pass))
    }
}
