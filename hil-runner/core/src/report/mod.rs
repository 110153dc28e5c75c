//! The data of a report: everything that a page shows of one or more runs, or of
//! a ladder, and nothing else.
//!
//! Verdicts and times of the host stand in it as they came out; figures,
//! settings and curves as rows and columns that a page can show without knowing
//! a case.

mod ladder;
mod parameters;
mod runs;
mod traces;

pub use ladder::{Held, LadderReport, LadderRung};
pub use parameters::Parameter;
pub use runs::{CaseReport, FigureRow};
pub use traces::{ContactInterval, Traces};

use serde::Serialize;

use crate::case_run::CaseRun;
use crate::ladder::Rung;
use crate::reservation::kept_but;

/// Everything that one report shows.
///
/// Its `Serialize` is what the page is rendered from, and the JSON that stands
/// in it: figures in full, curves rounded to
/// [`PLOT_DIGITS`](crate::number::PLOT_DIGITS).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Heading of the page.
    pub title: String,
    /// The command that made the report, shown below the heading.
    pub command_line: String,
    /// Program and version, such as `hil-runner 0.1.0`; no date.
    pub generated_by: String,
    /// Reasons not simply to pass if they keep their limits, in a few words.
    pub reserved: Option<String>,
    /// The runs, in the order in which they are shown.
    pub cases: Vec<CaseReport>,
    /// The rungs of one case side by side, from `hil-runner ladder`.
    pub ladder: Option<LadderReport>,
}

/// The report of one or more runs.
pub fn report(title: &str, command_line: &str, runs: &[CaseRun]) -> Report {
    let named: Vec<_> = runs.iter().map(CaseRun::named_reservations).collect();
    Report {
        title: title.to_owned(),
        command_line: command_line.to_owned(),
        generated_by: concat!("hil-runner ", env!("CARGO_PKG_VERSION")).to_owned(),
        cases: runs.iter().map(CaseReport::of).collect(),
        reserved: kept_but(&named),
        ladder: None,
    }
}

/// The report of a ladder.
pub fn ladder_report(command_line: &str, rungs: &[Rung]) -> Report {
    let name = rungs.first().map_or("", |rung| &rung.outcome.summary.name);
    Report {
        ladder: Some(LadderReport::of(name, rungs)),
        ..report(&format!("Ladder of {name}"), command_line, &[])
    }
}
