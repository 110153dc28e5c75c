//! The cells of a map, from rows in any order.

use crate::study::picture::axis::{AxisKeys, Spacing};
use crate::study::picture::group::{Different, Spread};
use crate::study::picture::note::{Chosen, LeftOut};
use crate::study::picture::table::{Column, is_made};
use crate::study::picture::{Map, PictureError};

/// One direction of the grid.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Side {
    /// The values, ascending; the numbers of words.
    pub(super) values: Vec<f64>,
    /// Edges of the cells, one more than there are values.
    pub(super) edges: Vec<f64>,
    /// Words, if the column has words.
    pub(super) names: Option<Vec<String>>,
    /// The value that each row of the table has, by its place in `values`.
    of_row: Vec<Option<usize>>,
}

/// The contents of a cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Cell {
    /// Median of the figure.
    pub(super) z: Option<f64>,
    /// Median of the column of the contour lines.
    pub(super) level: Option<f64>,
    /// A run of the cell fails.
    pub(super) fails: bool,
    /// Reason for a missing figure; `None` where there is one or no run at all.
    pub(super) state: Option<String>,
    /// The runs, those with a figure by its size.
    pub(super) runs: Vec<usize>,
}

/// Cells row by row from below, `across` of them in each.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    pub(super) x: Side,
    pub(super) y: Side,
    pub(super) cells: Vec<Cell>,
}

/// Less of the grid filled than this and the rows are no grid.
const LEAST_FILLED: f64 = 0.2;

/// Word for a run without a figure, if nothing else is said of it.
const NO_VALUE: &str = "no value";
/// Word for a figure that a logarithmic scale does not have.
const NOT_ABOVE_0: &str = "not above 0";

impl Side {
    fn of(
        column: &Column,
        keys: &AxisKeys,
        rows: &[usize],
        left_out: &mut LeftOut,
    ) -> Result<Self, PictureError> {
        let Different {
            mut of_row,
            names,
            numbers,
        } = Different::of(column, rows)?;
        let has_words = numbers.is_none();
        let places = || (0..names.len()).map(|at| at as f64).collect();
        let mut values = numbers.unwrap_or_else(places);
        let log = keys.spacing == Spacing::Log && !has_words;
        if log {
            let dropped = values.partition_point(|&value| value <= 0.0);
            values.drain(..dropped);
            for at in &mut of_row {
                let before = *at;
                *at = before.and_then(|at| at.checked_sub(dropped));
                left_out.not_above_0 += usize::from(before.is_some() && at.is_none());
            }
        }
        Ok(Self {
            edges: edges(&values, log),
            values,
            names: has_words.then_some(names),
            of_row,
        })
    }

    /// First and last edge.
    pub(super) fn span(&self) -> Option<(f64, f64)> {
        Some((*self.edges.first()?, *self.edges.last()?))
    }
}

/// Edges half way between the values, by ratio where the axis is logarithmic.
fn edges(values: &[f64], log: bool) -> Vec<f64> {
    let between = |a: f64, b: f64| match log {
        true => a.sqrt() * b.sqrt(),
        false => f64::midpoint(a, b),
    };
    let beyond = |end: f64, next: f64| match log {
        true => end / (next / end).sqrt(),
        false => end - 0.5 * (next - end),
    };
    match values {
        [] => Vec::new(),
        // A single value has a cell of any width.
        [0.0] => vec![-0.5, 0.5],
        [value] if log => vec![value / 2.0, value * 2.0],
        [value] => vec![value - 0.5 * value.abs(), value + 0.5 * value.abs()],
        [first, second, ..] => {
            let last = values.len() - 1;
            let inner = values.windows(2).map(|pair| between(pair[0], pair[1]));
            let inner = [beyond(*first, *second)].into_iter().chain(inner);
            inner
                .chain([beyond(values[last], values[last - 1])])
                .collect()
        }
    }
}

impl Grid {
    /// Sorts the rows into cells.
    pub(super) fn of(map: &Map, chosen: &mut Chosen<'_>) -> Result<Self, PictureError> {
        let (table, rows, left_out) = (chosen.table, &chosen.rows, &mut chosen.left_out);
        let x = Side::of(table.column(&map.x)?, &map.x_axis, rows, left_out)?;
        let y = Side::of(table.column(&map.y)?, &map.y_axis, rows, left_out)?;
        let (across, up) = (x.values.len(), y.values.len());
        // A plan that is no grid has rows² cells: they must not even be formed.
        let check = |filled: usize| {
            let enough = LEAST_FILLED * (across as f64 * up as f64);
            match across.min(up) > 2 && (filled as f64) < enough {
                true => Err(PictureError::new(format!(
                    "a map needs a regular grid, but {across} values along x and {up} along y \
                     make {} cells of which at most {filled} have a run; kind \"scatter\" can \
                     show such a plan",
                    across * up
                ))),
                false => Ok(()),
            }
        };
        check(rows.len())?;
        let mut of_cell: Vec<Vec<usize>> = vec![Vec::new(); across * up];
        for &row in rows.iter() {
            left_out.of += 1;
            match (x.of_row[row], y.of_row[row]) {
                (Some(i), Some(j)) => of_cell[j * across + i].push(row),
                _ => left_out.missing += 1,
            }
        }
        // Rows that the logarithmic axes leave out are told of already.
        left_out.missing = left_out.missing.saturating_sub(left_out.not_above_0);
        check(of_cell.iter().filter(|rows| !rows.is_empty()).count())?;
        let z = table.column(&map.z)?.numbers()?;
        let level = table.column(map.contour_column())?.numbers()?;
        let pass = table.column_or(map.pass.as_ref(), "pass")?;
        let state = table.column_or(map.status.as_ref(), "status")?;
        // What became of a run that was not made.
        let word = |row: &usize| state?.word(*row).filter(|word| !is_made(word));
        let log = map.z_axis.spacing == Spacing::Log;
        let cells = of_cell.iter().map(|rows| {
            left_out.shared = left_out.shared.max(rows.len());
            let mut made = rows.clone();
            made.retain(|row| word(row).is_none());
            let spread = |values: &[Option<f64>]| {
                let runs = made.iter().filter_map(|&row| Some((row, values[row]?)));
                Spread::of(runs.collect())
            };
            let seen = spread(&z);
            let value = seen.as_ref().map(|spread| spread.median);
            let z = value.filter(|&z| !log || z > 0.0);
            let why = || match value {
                Some(_) => NOT_ABOVE_0.to_owned(),
                None => rows.iter().find_map(word).unwrap_or(NO_VALUE).to_owned(),
            };
            let fails = |row: &usize| pass.and_then(|pass| pass.verdict(*row)) == Some(false);
            Cell {
                z,
                level: spread(&level).map(|spread| spread.median),
                fails: made.iter().any(fails),
                state: (z.is_none() && !rows.is_empty()).then(why),
                runs: seen.map_or_else(|| rows.clone(), |spread| spread.rows),
            }
        });
        let cells = cells.collect();
        Ok(Self { x, y, cells })
    }

    /// The cell at a place of the grid.
    pub(super) fn cell(&self, i: usize, j: usize) -> Option<&Cell> {
        self.cells.get(j * self.x.values.len() + i)
    }

    /// The places of the cells, row by row.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (across, up) = (self.x.values.len(), self.y.values.len());
        (0..up).flat_map(move |j| (0..across).map(move |i| (i, j)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_lie_half_way() {
        assert_eq!(edges(&[1.0, 2.0, 4.0], false), [0.5, 1.5, 3.0, 5.0]);
        assert_eq!(edges(&[1.0, 4.0], true), [0.5, 2.0, 8.0]);
        assert_eq!(edges(&[0.0], false), [-0.5, 0.5]);
        assert_eq!(edges(&[2.0], true), [1.0, 4.0]);
        assert!(edges(&[], true).is_empty());
    }
}
