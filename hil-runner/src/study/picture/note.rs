//! Remarks below the plots: what is left out, and what stands for what.

use serde_json::{Value, json};

use super::PictureError;
use super::spec::{Kind, Picture};
use super::table::{Table, Values};

/// The rows that a picture shows, and what there is to say about them.
pub(super) struct Chosen {
    pub(super) rows: Vec<usize>,
    pub(super) notes: Vec<String>,
    pub(super) left_out: LeftOut,
}

impl Chosen {
    /// The rows that fulfil the picture's conditions.
    pub(super) fn of(spec: &Picture, table: &Table) -> Result<Self, PictureError> {
        let mut kept = vec![true; table.rows()];
        for condition in &spec.conditions {
            for (kept, holds) in kept.iter_mut().zip(condition.holds(table)?) {
                *kept &= holds;
            }
        }
        let excluded = excluded(spec, table);
        let dropped = |row: usize| excluded.get(row) == Some(&true);
        let rows = (0..table.rows()).filter(|&row| kept[row]);
        let (left_out, rows): (Vec<usize>, Vec<usize>) = rows.partition(|&row| dropped(row));
        let conditions: Vec<String> = spec.conditions.iter().map(ToString::to_string).collect();
        let conditions = conditions.join(" and ");
        let mut notes = Vec::new();
        if !conditions.is_empty() && rows.is_empty() {
            let runs = counted(table.rows(), "run", "runs");
            notes.push(format!("None of the {runs} has {conditions}."));
        } else if !conditions.is_empty() {
            notes.push(format!("Only runs with {conditions} are shown."));
        }
        if !left_out.is_empty() {
            let points = counted(left_out.len(), "point", "points");
            notes.push(format!("The study's constraints leave out {points}."));
        }
        let left_out = LeftOut {
            unwanted: kept.iter().filter(|kept| !**kept).count(),
            excluded: left_out.len(),
            ..LeftOut::default()
        };
        Ok(Self {
            rows,
            notes,
            left_out,
        })
    }
}

/// The rows of points that the study itself leaves out: they are no runs that
/// went wrong. A map shows them as cells like any others.
fn excluded(spec: &Picture, table: &Table) -> Vec<bool> {
    match table.find("status").map(|status| &status.values) {
        Some(Values::Text(words)) if !matches!(spec.kind, Kind::Map(_)) => {
            words.iter().map(|word| word == "excluded").collect()
        }
        _ => Vec::new(),
    }
}

/// Counts of the values that a picture does not show, or not one by one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct LeftOut {
    /// Runs that `where` leaves out, and points that the study's constraints do.
    pub(super) unwanted: usize,
    pub(super) excluded: usize,
    /// Runs or values that are none.
    pub(super) missing: usize,
    /// Of so many.
    pub(super) of: usize,
    /// Values that a logarithmic axis does not have.
    pub(super) not_above_0: usize,
    /// Values beyond the ends of an axis.
    pub(super) beyond: usize,
    /// Most runs that share a place, where it is more than one.
    pub(super) shared: usize,
}

impl LeftOut {
    /// The counts as a specification carries them.
    pub(super) fn counts(&self) -> Value {
        json!({
            "unwanted": self.unwanted, "excluded": self.excluded, "missing": self.missing,
            "not_above_0": self.not_above_0, "beyond": self.beyond,
        })
    }

    /// The remarks; `shared` says how several runs of a place are shown.
    pub(super) fn notes(&self, shared: &str) -> Vec<String> {
        let mut notes = Vec::new();
        if self.shared > 1 {
            notes.push(format!("{shared} of up to {} runs.", self.shared));
        }
        if self.missing > 0 {
            let (missing, of) = (self.missing, counted(self.of, "value", "values"));
            let verb = if missing == 1 { "is" } else { "are" };
            notes.push(format!(
                "{missing} of {of} {verb} missing: the run was not made or has no such figure."
            ));
        }
        if self.not_above_0 > 0 {
            let values = values(self.not_above_0, "is", "are");
            notes.push(format!(
                "{values} not above 0 and not shown: the axis is logarithmic."
            ));
        }
        if self.beyond > 0 {
            let values = values(self.beyond, "lies", "lie");
            notes.push(format!("{values} beyond the ends of the axes."));
        }
        notes
    }
}

/// `1 value` or `3 values`.
pub(super) fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// The same with a verb.
fn values(count: usize, one: &str, several: &str) -> String {
    counted(count, &format!("value {one}"), &format!("values {several}"))
}
