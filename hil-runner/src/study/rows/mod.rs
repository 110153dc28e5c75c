//! From points to rows of results: a block of runs at a time.

use std::borrow::Cow;

use super::cell::{Cell, Column, ColumnKind};
use super::definition::{Point, Study};
use super::differences;
use super::feeding;
use super::margins::{COLUMNS as MARGINS, Margins};
use hil_core::budget::least_relative_margin;
use hil_core::case::Case;
use hil_core::error::RunError;
use hil_core::explain::explain;
use hil_core::figures::SUMMARY_FIGURES;
use hil_core::lanes::Runs;
use hil_core::runfile::Kind;
use hil_core::summary::Summary;

/// Whether a run was made.
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
pub(super) const LEAST_MARGIN: &str = "least_relative_margin";

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
    columns.extend(MARGINS.map(|name| column(name, ColumnKind::Number)));
    if study.differences {
        columns.extend(differences::COLUMNS.map(|name| column(name, ColumnKind::Number)));
    }
    for theory in &study.theory {
        columns.extend(
            theory
                .columns()
                .iter()
                .map(|name| column(name, ColumnKind::Number)),
        );
    }
    columns
}

/// A row before its run, as the plan alone decides it.
#[derive(Debug)]
pub struct PlannedRow {
    /// Its point.
    pub point: Point,
    /// Number of its rung.
    pub rung: usize,
    /// Its run, or why there is none.
    pub case: Result<Case, (Status, String)>,
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
        PlannedRow { point, rung, case }
    }
}

/// A row of a block before its run.
#[derive(Debug)]
struct Planned {
    number: u64,
    point: Point,
    rung: usize,
    /// Place among the block's cases, or why there is none.
    case: Result<usize, (Status, String)>,
}

/// Makes the rows of a study on one thread.
#[derive(Debug)]
pub struct RowMaker<'s> {
    study: &'s Study,
    runs: Runs,
    margins: Margins,
}

/// What a row has besides its summary.
#[derive(Debug, Default)]
struct Besides {
    fed_by: Option<Cell>,
    difference: Option<[Cell; 2]>,
}

impl<'s> RowMaker<'s> {
    /// For a study.
    pub fn new(study: &'s Study) -> Self {
        Self {
            study,
            runs: Runs::new(),
            margins: Margins::default(),
        }
    }

    /// The rows of these numbers, which begin with the first rung of a point.
    pub fn rows(&mut self, numbers: core::ops::Range<u64>) -> Vec<Vec<Cell>> {
        let study = self.study;
        let mut cases = Vec::new();
        let planned: Vec<Planned> = numbers
            .map(|number| plan(study, number, &mut cases))
            .collect();
        let mut summaries = Vec::with_capacity(cases.len());
        self.runs.figures(&cases, &mut summaries);
        let mut besides: Vec<Besides> = cases.iter().map(|_| Besides::default()).collect();
        if study.feeding {
            feeding::find(&cases, &summaries, |place, cell| {
                besides[place].fed_by = Some(cell)
            });
        }
        if study.differences {
            let places = planned
                .iter()
                .map(|planned| (planned.rung, planned.case.as_ref().ok()));
            differences::find(&cases, places, |place, cells| {
                besides[place].difference = Some(cells)
            });
        }
        planned
            .iter()
            .map(|planned| {
                let mut row = self.head(planned);
                match &planned.case {
                    Ok(place) => match &summaries[*place] {
                        Ok(summary) => {
                            let besides = std::mem::take(&mut besides[*place]);
                            self.made(&cases[*place], summary, besides, &mut row);
                        }
                        Err(error) if error.is_refusal() => {
                            let reason = self.refusal(planned, &cases[*place], error);
                            self.not_made(Status::Refused, reason, &mut row);
                        }
                        Err(error) => self.not_made(Status::Failed, error.to_string(), &mut row),
                    },
                    Err((status, reason)) => self.not_made(*status, reason.clone(), &mut row),
                }
                row
            })
            .collect()
    }

    /// Number, axes and rung.
    fn head(&self, planned: &Planned) -> Vec<Cell> {
        let mut row = Vec::with_capacity(64);
        row.push(Cell::number(planned.number as f64));
        let axes = self
            .study
            .axes
            .iter()
            .zip(&planned.point.chosen)
            .zip(&planned.point.values);
        for ((axis, chosen), value) in axes {
            use super::axis::Chosen;
            let text = |text: &str| Cell::Text(Cow::Owned(text.to_owned()));
            match chosen {
                Chosen::Number(number) => {
                    if axis.times.is_some() && !axis.is_of_base() {
                        row.push(Cell::number(*number));
                    }
                    let value = value.number();
                    row.push(if axis.is_numeric() {
                        Cell::number(value)
                    } else {
                        text(&value.map_or_else(String::new, |value| value.to_string()))
                    });
                }
                Chosen::Other { label, .. } => row.push(text(label)),
            }
        }
        row.push(Cell::Text(Cow::Borrowed(
            self.study.rungs[planned.rung].0.name(),
        )));
        row
    }

    /// The sentence that the single run of a refused case gives.
    fn refusal(&self, planned: &Planned, case: &Case, error: &RunError) -> String {
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
        row.push(Cell::Text(Cow::Borrowed(status.name())));
        row.push(Cell::Text(Cow::Owned(reason)));
        // What was asked for and is not there does not pass; what was left out
        // was not asked for.
        row.push(if status == Status::Excluded {
            Cell::Empty
        } else {
            Cell::Flag(false)
        });
        row.resize(columns(self.study).len(), Cell::Empty);
    }

    fn made(&mut self, case: &Case, summary: &Summary, besides: Besides, row: &mut Vec<Cell>) {
        row.push(Cell::Text(Cow::Borrowed(Status::Ok.name())));
        row.push(Cell::Empty);
        row.push(Cell::Flag(
            summary.verdicts.iter().all(|verdict| verdict.pass),
        ));
        let failed = summary.verdicts.iter().filter(|verdict| !verdict.pass);
        let failed: Vec<&str> = failed.map(|verdict| verdict.figure.as_str()).collect();
        row.push(match failed.as_slice() {
            [] => Cell::Empty,
            failed => Cell::Text(Cow::Owned(failed.join(" "))),
        });
        row.push(Cell::number(least_relative_margin(&summary.verdicts)));
        row.extend(
            SUMMARY_FIGURES
                .iter()
                .map(|figure| Cell::number(summary.figure(figure.key))),
        );
        if self.study.feeding {
            row.push(besides.fed_by.unwrap_or(Cell::Empty));
        }
        row.extend(self.margins.cells(case));
        if self.study.differences {
            row.extend(besides.difference.unwrap_or([Cell::Empty, Cell::Empty]));
        }
        for theory in &self.study.theory {
            row.extend(theory.cells(case));
        }
    }
}

fn plan(study: &Study, number: u64, cases: &mut Vec<Case>) -> Planned {
    let PlannedRow { point, rung, case } = study.planned_row(number);
    let case = case.map(|mut case| {
        case.run.events = false;
        cases.push(case);
        cases.len() - 1
    });
    Planned {
        number,
        point,
        rung,
        case,
    }
}
