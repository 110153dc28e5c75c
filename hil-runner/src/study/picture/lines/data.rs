//! The data of the curves: rows, places along x, series.

use crate::study::picture::axis::{Axis, Margin, Spacing, extent};
use crate::study::picture::group::{Different, Spread};
use crate::study::picture::label::Label;
use crate::study::picture::note::{Chosen, LeftOut};
use crate::study::picture::spec::{Lines, Picture};
use crate::study::picture::{PictureError, Table};

/// A place along x with the values there; none where every run lacks one.
pub(super) type Points = Vec<(f64, Option<Spread>)>;

/// Rows with their places and series.
pub(super) struct Data<'a> {
    pub(super) table: &'a Table,
    pub(super) rows: Vec<usize>,
    /// Remarks about the choice of rows.
    pub(super) notes: Vec<String>,
    /// The series; one without a name if the picture names no column.
    pub(super) series: Different,
    /// Value of x per row of the table; the number of a word.
    x_of_row: Vec<Option<f64>>,
    /// Words of x, if it has words.
    x_names: Option<Vec<String>>,
}

impl<'a> Data<'a> {
    pub(super) fn of(
        spec: &Picture,
        lines: &Lines,
        table: &'a Table,
    ) -> Result<Self, PictureError> {
        let Chosen { rows, notes } = Chosen::of(spec, table)?;
        let series = match &lines.series {
            Some(name) => Different::series(table.column(name)?, &rows)?,
            None => Different {
                of_row: vec![Some(0); table.rows()],
                names: vec![String::new()],
                numbers: None,
            },
        };
        let x = Different::of(table.column(&lines.x)?, &rows)?;
        let value = |at: usize| match &x.numbers {
            Some(numbers) => numbers[at],
            None => at as f64,
        };
        let x_of_row = x.of_row.iter().map(|at| at.map(value)).collect();
        let x_names = x.numbers.is_none().then_some(x.names);
        Ok(Self {
            table,
            rows,
            notes,
            series,
            x_of_row,
            x_names,
        })
    }

    /// The axis along x, over all rows, whether they have values or not.
    pub(super) fn x_axis(
        &self,
        lines: &Lines,
        left_out: &mut LeftOut,
    ) -> Result<Axis, PictureError> {
        let label = Label::of(&lines.x);
        if let Some(names) = &self.x_names {
            return Ok(Axis::of_places(lines.x_axis.words(&label), names));
        }
        let log = lines.x_axis.spacing == Spacing::Log;
        let values = || self.rows.iter().filter_map(|&row| self.x_of_row[row]);
        let drawn = |value: &f64| !log || *value > 0.0;
        left_out.not_above_0 += values().filter(|value| !drawn(value)).count();
        let span = extent(values().filter(drawn));
        Axis::new(&lines.x_axis, &label, span, Margin::Around)
    }

    /// The points of one series of a column, ascending in x.
    pub(super) fn points(
        &self,
        values: &[Option<f64>],
        series: usize,
        x: &Axis,
        left_out: &mut LeftOut,
    ) -> Points {
        let mut rows: Vec<(f64, Option<f64>)> = Vec::new();
        for &row in &self.rows {
            if self.series.of_row[row] != Some(series) {
                continue;
            }
            match self.x_of_row[row] {
                Some(at) if x.share(at).is_some() => rows.push((at, values[row])),
                Some(_) => {}
                None => {
                    left_out.of += 1;
                    left_out.missing += 1;
                }
            }
        }
        rows.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        // Values of x are those of `Different`.
        let places = rows.chunk_by(|(a, _), (b, _)| a == b);
        let mut points = Points::new();
        for place in places {
            let Some(&(at, _)) = place.first() else {
                continue;
            };
            let values: Vec<f64> = place.iter().filter_map(|&(_, value)| value).collect();
            left_out.of += place.len();
            left_out.missing += place.len() - values.len();
            left_out.shared = left_out.shared.max(values.len());
            points.push((at, Spread::of(values)));
        }
        points
    }
}
