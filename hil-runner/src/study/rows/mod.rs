//! From points to rows of results: a block of runs at a time.

pub(super) mod beside;
pub(super) mod cell;
pub(super) mod engine;

use self::beside::{DIFFERENCES, differences, feeding};
use self::cell::{Cell, Column, ColumnKind};
use super::plan::axis::AxisValue;
use super::plan::{Point, Study};
use hil_core::budget::least_relative_margin;
use hil_core::case::Case;
use hil_core::error::{RunError, explain};
use hil_core::figures::SUMMARY_FIGURES;
use hil_core::lanes::Runs;
use hil_core::runfile::Kind;
use hil_core::summary::Summary;

/// Outcome of an attempt at a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// It was made; the figures are there.
    Ok,
    /// A constraint of the study leaves the point out.
    Excluded,
    /// The values of the point make no run: the run file or the firmware says so.
    Refused,
    /// The run was begun and could not be finished.
    Failed,
}

impl Status {
    /// As the column `status` has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Excluded => "excluded",
            Self::Refused => "refused",
            Self::Failed => "failed",
        }
    }
}

/// Columns between those of the axes and the figures.
const STATUS_COLUMNS: [(&str, ColumnKind); 6] = [
    ("rung", ColumnKind::Text),
    ("status", ColumnKind::Text),
    ("reason", ColumnKind::Text),
    ("pass", ColumnKind::Flag),
    ("failed_limits", ColumnKind::Text),
    (LEAST_MARGIN, ColumnKind::Number),
];

/// Column of [`least_relative_margin`].
pub(in crate::study) const LEAST_MARGIN: &str = "least_relative_margin";

/// The columns of a study's results, in their order.
pub fn columns(study: &Study) -> Vec<Column> {
    let column = |name: &str, kind| Column {
        name: name.to_owned(),
        kind,
    };
    let mut columns = vec![column("row", ColumnKind::Whole)];
    for axis in &study.axes {
        let kind = match axis.key.key.kind {
            _ if !axis.is_numeric() => ColumnKind::Text,
            Kind::Whole(..) => ColumnKind::Whole,
            _ => ColumnKind::Number,
        };
        if let Some(factor) = axis.factor_column() {
            columns.push(column(&factor, ColumnKind::Number));
        }
        columns.push(column(&axis.key.path(), kind));
    }
    columns.extend(STATUS_COLUMNS.map(|(name, kind)| column(name, kind)));
    columns.extend(SUMMARY_FIGURES.map(|figure| {
        let kind = match figure.whole {
            true => ColumnKind::Whole,
            false => ColumnKind::Number,
        };
        column(figure.key, kind)
    }));
    if study.feeding {
        columns.push(column("limit_cycle_fed_by", ColumnKind::Text));
    }
    if study.differences {
        columns.extend(DIFFERENCES.map(|name| column(name, ColumnKind::Number)));
    }
    let theory = study.theory.iter().flat_map(|theory| theory.columns());
    columns.extend(theory.map(|name| column(name, ColumnKind::Number)));
    columns
}

/// A row before its run, as the plan alone decides it.
#[derive(Debug)]
pub struct PlannedRow<C = Case> {
    /// Its number.
    pub number: u64,
    /// Its point.
    pub point: Point,
    /// Number of its rung.
    pub rung: usize,
    /// Its run, or why there is none.
    pub case: Result<C, (Status, String)>,
}

impl Study {
    /// A row, 0 ≤ `number` < rows of the study.
    pub fn planned_row(&self, number: u64) -> PlannedRow {
        let rungs = self.rungs.len() as u64;
        let point = self.point(number / rungs);
        // A remainder of a small number.
        let rung = usize::try_from(number % rungs).unwrap_or(0);
        let case = match self.broken_constraint(&point) {
            Some(constraint) => Err((Status::Excluded, constraint.to_string())),
            None => self.case(&point, rung).map_err(|errors| {
                let lines: Vec<String> = errors.entries().iter().map(ToString::to_string).collect();
                (Status::Refused, lines.join("; "))
            }),
        };
        PlannedRow {
            number,
            point,
            rung,
            case,
        }
    }
}

/// Makes the rows of a study on one thread.
#[derive(Debug)]
pub struct RowMaker<'s> {
    study: &'s Study,
    /// Columns of a row.
    width: usize,
    runs: Runs,
}

impl<'s> RowMaker<'s> {
    /// For a study.
    pub fn new(study: &'s Study) -> Self {
        Self {
            study,
            width: columns(study).len(),
            runs: Runs::new(),
        }
    }

    /// The rows of these numbers, which begin with the first rung of a point.
    pub fn rows(&mut self, numbers: core::ops::Range<u64>) -> Vec<Vec<Cell>> {
        let study = self.study;
        let mut cases = Vec::new();
        let planned = numbers.map(|number| {
            let row = study.planned_row(number);
            // Its place among the cases of the block.
            let case = row.case.map(|mut case| {
                case.run.events = false;
                cases.push(case);
                cases.len() - 1
            });
            PlannedRow {
                number,
                point: row.point,
                rung: row.rung,
                case,
            }
        });
        let planned: Vec<PlannedRow<usize>> = planned.collect();
        let mut summaries = Vec::with_capacity(cases.len());
        self.runs.figures(&cases, &mut summaries);
        let fed_by = study.feeding.then(|| feeding(&cases, &summaries));
        let places = planned.iter().map(|row| (row.rung, row.case.as_ref().ok()));
        let differences = study.differences.then(|| differences(&cases, places));
        let rows = planned.iter().map(|planned| {
            let mut row = self.head(planned);
            let place = match &planned.case {
                Ok(place) => *place,
                Err((status, reason)) => {
                    self.not_made(*status, reason.clone(), &mut row);
                    return row;
                }
            };
            match &summaries[place] {
                Ok(summary) => {
                    made(summary, &mut row);
                    row.extend(fed_by.iter().map(|cells| cells[place].clone()));
                    row.extend(differences.iter().flat_map(|cells| cells[place].clone()));
                    for theory in &study.theory {
                        row.extend(theory.cells(&cases[place]));
                    }
                }
                Err(error) if error.is_refusal() => {
                    let reason = self.refusal(planned, &cases[place], error);
                    self.not_made(Status::Refused, reason, &mut row);
                }
                Err(error) => self.not_made(Status::Failed, error.to_string(), &mut row),
            }
            row
        });
        rows.collect()
    }

    /// Number, axes and rung.
    fn head(&self, planned: &PlannedRow<usize>) -> Vec<Cell> {
        let mut row = Vec::with_capacity(self.width);
        row.push(Cell::number(planned.number as f64));
        let Point { chosen, values } = &planned.point;
        for ((axis, chosen), value) in self.study.axes.iter().zip(chosen).zip(values) {
            let AxisValue::Number(number) = chosen else {
                row.push(Cell::text(chosen.to_string()));
                continue;
            };
            if axis.times.is_some() && !axis.is_of_base() {
                row.push(Cell::number(*number));
            }
            let value = value.number();
            row.push(match axis.is_numeric() {
                true => Cell::number(value),
                false => Cell::text(value.map_or_else(String::new, |value| value.to_string())),
            });
        }
        row.push(Cell::text(self.study.rungs[planned.rung].0.name()));
        row
    }

    /// The sentence that the single run of a refused case gives.
    fn refusal(&self, planned: &PlannedRow<usize>, case: &Case, error: &RunError) -> String {
        let keys = self.study.axes.iter().map(|axis| &axis.key);
        let (_, template) = &self.study.rungs[planned.rung];
        let words = match template.file(keys.zip(&planned.point.values)) {
            Ok(file) if file.case.controller.gains == case.controller.gains => {
                explain(&file, error)
            }
            // Gains that keep the loop stand in no file.
            _ => error.to_string(),
        };
        words.replace('\n', "; ")
    }

    fn not_made(&self, status: Status, reason: String, row: &mut Vec<Cell>) {
        row.extend([Cell::text(status.name()), Cell::text(reason)]);
        // What was asked for and is not there does not pass; what was left out
        // was not asked for.
        row.push(match status {
            Status::Excluded => Cell::Empty,
            _ => Cell::Flag(false),
        });
        row.resize(self.width, Cell::Empty);
    }
}

/// Status, verdict and figures of a run.
fn made(summary: &Summary, row: &mut Vec<Cell>) {
    let failed = summary.verdicts.iter().filter(|verdict| !verdict.pass);
    let failed: Vec<&str> = failed.map(|verdict| verdict.figure).collect();
    row.extend([
        Cell::text(Status::Ok.name()),
        Cell::Empty,
        Cell::Flag(failed.is_empty()),
        match failed.is_empty() {
            true => Cell::Empty,
            false => Cell::text(failed.join(" ")),
        },
        Cell::number(least_relative_margin(&summary.verdicts)),
    ]);
    let figures = SUMMARY_FIGURES.iter();
    row.extend(figures.map(|figure| Cell::number(summary.figure(figure.key))));
}
