//! Two runs of one case over each other: before a change of its settings, and after it.

use serde::Serialize;

use super::{CaseReport, Parameter, Report, report};
use crate::run::CaseRun;

/// What two runs of one case have in common, and the settings in which they differ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CompareReport {
    /// True where both follow the same command.
    pub one_command: bool,
    /// Settings that are not the same.
    pub changes: Vec<Change>,
}

/// A setting before and after; `None` where the run does not use it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Its name, such as `Sample time Δt`.
    pub label: String,
    /// Its unit, empty where there is none.
    pub unit: String,
    /// Its value before.
    pub before: Option<String>,
    /// Its value after.
    pub after: Option<String>,
}

/// The report of one case before and after a change: its page shows both runs in every
/// plot.
pub fn compared(title: &str, command_line: &str, runs: &[CaseRun; 2]) -> Report {
    let mut report = report(title, command_line, runs);
    for (case, name) in report.cases.iter_mut().zip(["before", "after"]) {
        name.clone_into(&mut case.name);
    }
    let [before, after] = runs;
    Report {
        compare: Some(CompareReport {
            one_command: before.case.motion == after.case.motion,
            changes: changes(&report.cases),
        }),
        ..report
    }
}

/// Settings of two cases that differ, in the order of the later one; after them those
/// that it has no longer.
fn changes(cases: &[CaseReport]) -> Vec<Change> {
    let [before, after] = cases else {
        return Vec::new();
    };
    let value = |of: &CaseReport, row: &Parameter| {
        let same = |other: &&Parameter| other.label == row.label && other.unit == row.unit;
        let found = of.parameters.iter().find(same);
        found.map(|found| found.value.clone())
    };
    let gone = before.parameters.iter();
    let gone = gone.filter(|row| value(after, row).is_none());
    let rows = after.parameters.iter().chain(gone);
    let changes = rows.map(|row| Change {
        label: row.label.clone(),
        unit: row.unit.clone(),
        before: value(before, row),
        after: value(after, row),
    });
    let changes = changes.filter(|change| change.before != change.after);
    changes.collect()
}
