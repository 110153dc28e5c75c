//! The data of a report: everything that a page shows of one or more runs, or of
//! a ladder, and nothing else.

mod case_report;
mod chip;
mod from_runs;
mod ladder_report;
mod parameters;
mod traces;

pub use case_report::{CaseReport, FigureRow, HostTiming, Parameter, VerdictRow};
pub use from_runs::{ladder_report, report};
pub use ladder_report::{Held, LadderReport, LadderRung};
pub use traces::{ContactInterval, Traces};

use serde::Serialize;

/// Everything that one report shows.
///
/// Its `Serialize` is the JSON that stands in the page: figures in full,
/// curves rounded to [`PLOT_DIGITS`](crate::number::PLOT_DIGITS).
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
