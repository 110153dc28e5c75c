//! Remarks below the plots: what is left out, and what stands for what.

use serde::Serialize;

use super::PictureError;
use super::spec::{Kind, Picture};
use super::table::Table;

/// The rows that a picture shows, and what there is to say about them.
pub(super) struct Chosen<'t> {
    pub(super) table: &'t Table,
    pub(super) rows: Vec<usize>,
    pub(super) notes: Vec<String>,
    pub(super) left_out: LeftOut,
}

impl<'t> Chosen<'t> {
    /// The rows that fulfil the picture's conditions.
    pub(super) fn of(spec: &Picture, table: &'t Table) -> Result<Self, PictureError> {
        let mut kept = vec![true; table.rows()];
        for condition in &spec.conditions {
            for (kept, holds) in kept.iter_mut().zip(condition.holds(table)?) {
                *kept &= holds;
            }
        }
        // Points that the study itself leaves out are no runs that went wrong. A map shows
        // them as cells like any others.
        let is_map = matches!(spec.kind, Kind::Map(_));
        let status = table.find("status").filter(|_| !is_map);
        let rows = (0..table.rows()).filter(|&row| kept[row]);
        let (excluded, rows): (Vec<usize>, Vec<usize>) =
            rows.partition(|&row| status.and_then(|status| status.word(row)) == Some("excluded"));
        let conditions: Vec<String> = spec.conditions.iter().map(ToString::to_string).collect();
        let conditions = conditions.join(" and ");
        let mut notes = Vec::new();
        if !conditions.is_empty() && rows.is_empty() {
            let runs = counted(table.rows(), "run", "runs");
            notes.push(format!("None of the {runs} has {conditions}."));
        } else if !conditions.is_empty() {
            notes.push(format!("Only runs with {conditions} are shown."));
        }
        if !excluded.is_empty() {
            let points = counted(excluded.len(), "point", "points");
            notes.push(format!("The study's constraints leave out {points}."));
        }
        let left_out = LeftOut {
            unwanted: kept.iter().filter(|kept| !**kept).count(),
            excluded: excluded.len(),
            ..LeftOut::default()
        };
        Ok(Self {
            table,
            rows,
            notes,
            left_out,
        })
    }

    /// Adds the remarks on what is left out; `shared` says how several runs of a place
    /// are shown.
    pub(super) fn tell_left_out(&mut self, shared: &str) {
        let (left_out, notes) = (&self.left_out, &mut self.notes);
        if left_out.shared > 1 {
            notes.push(format!("{shared} of up to {} runs.", left_out.shared));
        }
        if left_out.missing > 0 {
            let (missing, of) = (left_out.missing, counted(left_out.of, "value", "values"));
            let verb = if missing == 1 { "is" } else { "are" };
            notes.push(format!(
                "{missing} of {of} {verb} missing: the run was not made or has no such figure."
            ));
        }
        if left_out.not_above_0 > 0 {
            let values = counted(left_out.not_above_0, "value is", "values are");
            notes.push(format!(
                "{values} not above 0 and not shown: the axis is logarithmic."
            ));
        }
        if left_out.beyond > 0 {
            let values = counted(left_out.beyond, "value lies", "values lie");
            notes.push(format!("{values} beyond the ends of the axes."));
        }
    }
}

/// Counts of the values that a picture does not show, or not one by one, as a
/// specification carries them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub(super) struct LeftOut {
    /// Runs that `where` leaves out, and points that the study's constraints do.
    pub(super) unwanted: usize,
    pub(super) excluded: usize,
    /// Runs or values that are none.
    pub(super) missing: usize,
    /// Of so many.
    #[serde(skip)]
    pub(super) of: usize,
    /// Values that a logarithmic axis does not have.
    pub(super) not_above_0: usize,
    /// Values beyond the ends of an axis.
    pub(super) beyond: usize,
    /// Most runs that share a place, where it is more than one.
    #[serde(skip)]
    pub(super) shared: usize,
}

/// `1 value` or `3 values`.
pub(super) fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}
