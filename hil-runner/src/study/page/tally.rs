//! Sums over all rows of a study, row by row: no more memory for more rows.

use super::pictures::PictureRows;
use super::rows::PageRows;
use crate::study::plan::Study;
use crate::study::rows::cell::{Cell, Column};
use crate::study::rows::{LEAST_MARGIN, Status};
use hil_core::number;

/// Passing runs of a rung that are listed as its best.
const BEST: usize = 5;

/// Least, mean and most of a column over the runs that were made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spread {
    /// Name of the column.
    pub column: String,
    /// Runs that have a value.
    pub count: u64,
    /// Runs that were made and have none.
    pub empty: u64,
    /// Least value, and the row of its first run.
    pub least: Option<(f64, u64)>,
    /// Greatest value, and the row of its first run.
    pub most: Option<(f64, u64)>,
    sum: f64,
}

impl Spread {
    /// Arithmetic mean.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }

    fn add(&mut self, value: Option<f64>, row: u64) {
        let Some(value) = value else {
            self.empty += 1;
            return;
        };
        self.count += 1;
        self.sum += value;
        if self.least.is_none_or(|(least, _)| value < least) {
            self.least = Some((value, row));
        }
        if self.most.is_none_or(|(most, _)| value > most) {
            self.most = Some((value, row));
        }
    }
}

/// A run within all its limits, and what is left of the tightest of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// Its row.
    pub row: u64,
    /// Least relative margin over its limits, 0 to 1.
    pub margin: f64,
    /// Its values in the columns of the axes.
    pub axes: Vec<String>,
}

/// The runs of one rung.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RungTally {
    /// Name of the rung.
    pub rung: String,
    /// Runs that were made.
    pub made: u64,
    /// Points that a constraint leaves out.
    pub excluded: u64,
    /// Points whose values make no run, or whose run failed.
    pub not_made: u64,
    /// Runs within all limits.
    pub passed: u64,
    /// Runs whose linear loop is unstable in contact or in the gap: their
    /// figures may not hold.
    pub unstable: u64,
    /// Those of them that are within all limits.
    pub unstable_passed: u64,
    /// The runs with the largest least margin of those that are within all
    /// limits and not unstable, best first.
    pub best: Vec<Best>,
    /// Reason of the first run that was not made.
    pub first_reason: Option<(u64, String)>,
    /// The figures.
    pub figures: Vec<Spread>,
}

impl RungTally {
    /// Part of the runs within all limits \[%\]; what was asked for and could not
    /// be made counts as outside.
    pub fn yield_percent(&self) -> Option<f64> {
        percent(self.passed, self.made + self.not_made)
    }

    /// Takes a run among the best, if it is; of equal ones the first stays.
    fn add_to_best(&mut self, row: u64, margin: f64, axes: &[Cell]) {
        let place = self.best.partition_point(|best| best.margin >= margin);
        if place >= BEST {
            return;
        }
        let shown = |cell: &Cell| match cell {
            Cell::Number(value) => number::table(*value),
            Cell::Text(text) => text.to_string(),
            Cell::Flag(flag) => flag.to_string(),
            Cell::Empty => number::MISSING.to_owned(),
        };
        let axes = axes.iter().map(shown).collect();
        self.best.insert(place, Best { row, margin, axes });
        self.best.truncate(BEST);
    }
}

/// All rows of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// By rung, in the order in which they appear.
    pub rungs: Vec<RungTally>,
    /// Names of the columns of the axes.
    pub axes: Vec<String>,
    /// The rows that pictures show.
    pub pictures: PictureRows,
    /// The rows that the page carries.
    pub rows: PageRows,
    /// Places of `rung`, `status`, `reason` and `pass`.
    places: [usize; 4],
    /// Places of the two stability margins, and of the least margin.
    margins: [usize; 3],
    /// Places and names of the figures.
    figures: Vec<(usize, String)>,
}

impl Tally {
    /// Nothing added yet, for rows with these columns, of which the first is the
    /// row's number, and axes and rung follow.
    pub fn new(study: &Study, columns: &[Column]) -> Self {
        let place = |name: &str| {
            let place = columns.iter().position(|column| column.name == name);
            place.unwrap_or(usize::MAX)
        };
        let places = ["rung", "status", "reason", "pass"].map(place);
        let figures = (columns.iter().enumerate())
            .filter(|(place, column)| *place > places[3] && column.kind.is_number())
            .map(|(place, column)| (place, column.name.clone()));
        let axes = columns.get(1..places[0]).unwrap_or_default();
        Self {
            rungs: Vec::new(),
            axes: axes.iter().map(|column| column.name.clone()).collect(),
            pictures: PictureRows::new(study, columns),
            rows: PageRows::new(columns),
            places,
            margins: ["modulus_margin_contact", "modulus_margin_gap", LEAST_MARGIN].map(place),
            figures: figures.collect(),
        }
    }

    /// Adds a row.
    pub fn add(&mut self, row: &[Cell]) {
        self.pictures.add(row);
        self.rows.add(row);
        let [rung, status, reason, pass] = self.places.map(|place| row.get(place));
        let text = |cell: Option<&Cell>| match cell {
            Some(Cell::Text(text)) => text.clone(),
            _ => "".into(),
        };
        let number = row.first().and_then(Cell::as_whole);
        let number = number.and_then(|number| u64::try_from(number).ok());
        let (number, rung) = (number.unwrap_or(0), text(rung));
        let place = self.rungs.iter().position(|known| known.rung == rung);
        let place = place.unwrap_or_else(|| {
            let figures = self.figures.iter().map(|(_, column)| Spread {
                column: column.clone(),
                ..Spread::default()
            });
            self.rungs.push(RungTally {
                rung: rung.into_owned(),
                figures: figures.collect(),
                ..RungTally::default()
            });
            self.rungs.len() - 1
        });
        let tally = &mut self.rungs[place];
        let status = text(status);
        if status == Status::Excluded.name() {
            tally.excluded += 1;
            return;
        }
        if status != Status::Ok.name() {
            tally.not_made += 1;
            let first = || (number, text(reason).into_owned());
            tally.first_reason.get_or_insert_with(first);
            return;
        }
        tally.made += 1;
        let value = |place: usize| row.get(place).and_then(Cell::as_number);
        let passed = pass == Some(&Cell::Flag(true));
        let [contact, gap, least] = self.margins.map(value);
        let unstable = [contact, gap].into_iter().flatten().any(|it| it < 0.0);
        tally.passed += u64::from(passed);
        tally.unstable += u64::from(unstable);
        tally.unstable_passed += u64::from(unstable && passed);
        if let (true, false, Some(margin)) = (passed, unstable, least) {
            let axes = row.get(1..self.places[0]).unwrap_or_default();
            tally.add_to_best(number, margin, axes);
        }
        for ((place, _), spread) in self.figures.iter().zip(&mut tally.figures) {
            spread.add(value(*place), number);
        }
    }

    /// Part of all runs within all limits \[%\].
    pub fn yield_percent(&self) -> Option<f64> {
        let sum = |of: fn(&RungTally) -> u64| self.rungs.iter().map(of).sum::<u64>();
        let asked = sum(|rung| rung.made + rung.not_made);
        percent(sum(|rung| rung.passed), asked)
    }
}

/// A part of what was asked for \[%\]; none where nothing was.
fn percent(part: u64, asked: u64) -> Option<f64> {
    (asked > 0).then(|| 100.0 * part as f64 / asked as f64)
}
