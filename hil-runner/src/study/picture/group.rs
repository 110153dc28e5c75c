//! Rows that belong together: the values of a column, and their spread.

use super::PictureError;
use std::collections::BTreeMap;

use super::label::Label;
use super::table::{Column, Table, Values};
use super::unit::power_of_ten;
use hil_core::number;

/// Seven shapes, filled and hollow, and as many colours.
const MOST_SERIES: usize = 14;

/// The different values of a column among some rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Different {
    /// The value of each row of the table, by its place among them; `None` without
    /// a value, or where the row is not among those asked for.
    pub(super) of_row: Vec<Option<usize>>,
    /// The values in words, numbers with their unit.
    pub(super) names: Vec<String>,
    /// The values where they are numbers, ascending.
    pub(super) numbers: Option<Vec<f64>>,
}

impl Different {
    /// Numbers that differ by rounding alone are one value; words keep the
    /// order in which they first stand.
    pub(super) fn of(column: &Column, rows: &[usize]) -> Result<Self, PictureError> {
        match &column.values {
            Values::Number(_) => Self::numbers(column, rows),
            Values::Text(words) => Ok(Self::words(words, rows)),
        }
    }

    fn numbers(column: &Column, rows: &[usize]) -> Result<Self, PictureError> {
        let values = column.numbers()?;
        let mut sorted: Vec<f64> = rows.iter().filter_map(|&row| values[row]).collect();
        sorted.sort_by(f64::total_cmp);
        sorted.dedup_by(|next, first| (*next - *first).abs() <= 1e-9 * first.abs());
        let mut of_row = vec![None; values.len()];
        for &row in rows {
            of_row[row] = values[row].map(|value| {
                // The last that is not larger; a value merged into its
                // neighbour is a rounding above it.
                sorted.partition_point(|&known| known <= value).max(1) - 1
            });
        }
        let label = Label::of(&column.name);
        let names = sorted.iter().map(|&value| in_words(value, &label));
        Ok(Self {
            of_row,
            names: names.collect(),
            numbers: Some(sorted),
        })
    }

    fn words(words: &[String], rows: &[usize]) -> Self {
        let mut names: Vec<String> = Vec::new();
        let mut known: BTreeMap<&str, usize> = BTreeMap::new();
        let mut of_row = vec![None; words.len()];
        for &row in rows {
            let word = words[row].as_str();
            let at = known.entry(word).or_insert_with(|| {
                names.push(word.to_owned());
                names.len() - 1
            });
            of_row[row] = Some(*at);
        }
        Self {
            of_row,
            names,
            numbers: None,
        }
    }

    /// The values of a column as series, so many that a legend can tell them apart; one
    /// without a name where the picture names no column.
    pub(super) fn series(
        name: Option<&String>,
        table: &Table,
        rows: &[usize],
    ) -> Result<Self, PictureError> {
        let Some(name) = name else {
            return Ok(Self {
                of_row: vec![Some(0); table.rows()],
                names: vec![String::new()],
                numbers: None,
            });
        };
        let series = Self::of(table.column(name)?, rows)?;
        if series.len() > MOST_SERIES {
            return Err(PictureError::new(format!(
                "column \"{name}\" has {} different values, more series than a legend can tell apart",
                series.len()
            )));
        }
        Ok(series)
    }

    /// The value of a row where the values are numbers, else its place among them.
    pub(super) fn value(&self, row: usize) -> Option<f64> {
        let at = self.of_row[row]?;
        Some(self.numbers.as_ref().map_or(at as f64, |of| of[at]))
    }

    /// Number of different values.
    pub(super) fn len(&self) -> usize {
        self.names.len()
    }
}

/// A number with its unit, by a prefix where that reads better.
pub(super) fn in_words(value: f64, label: &Label) -> String {
    // A power of ten before the unit of a single number would look odd.
    let (shift, symbol) = label.unit().suited(value.abs(), false);
    let text = number::rounded(value * power_of_ten(shift), 4);
    match symbol.as_str() {
        "" => text,
        symbol => format!("{text}\u{a0}{symbol}"),
    }
}

/// Several runs of one place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spread {
    pub(super) median: f64,
    pub(super) low: f64,
    pub(super) high: f64,
    /// The runs, by their value.
    pub(super) rows: Vec<usize>,
}

impl Spread {
    /// The spread of some runs and their values, if there are any.
    pub(super) fn of(mut runs: Vec<(usize, f64)>) -> Option<Self> {
        runs.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let ((_, low), (_, high)) = (*runs.first()?, *runs.last()?);
        let count = runs.len();
        let median = f64::midpoint(runs[(count - 1) / 2].1, runs[count / 2].1);
        Some(Self {
            median,
            low,
            high,
            rows: runs.into_iter().map(|(row, _)| row).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(values: &[f64]) -> Column {
        Column {
            name: "controller.sample_time_s".into(),
            values: Values::Number(values.iter().map(|&value| Some(value)).collect()),
            own: None,
        }
    }

    #[test]
    fn rounding_makes_no_new_value() {
        let column = column(&[0.3, 0.1 + 0.2, 0.000_25, f64::NAN]);
        let different = Different::of(&column, &[0, 1, 2, 3]).unwrap();
        assert_eq!(different.names, ["250\u{a0}µs", "0.3\u{a0}s"]);
        assert_eq!(different.of_row, [Some(1), Some(1), Some(0), None]);
        let different = Different::of(&column, &[2]).unwrap();
        assert_eq!(different.of_row, [None, None, Some(0), None]);
    }

    #[test]
    fn medians_of_even_and_odd_counts() {
        let spread = |values: &[f64]| Spread::of(values.iter().copied().enumerate().collect());
        assert_eq!(spread(&[]), None);
        assert_eq!(spread(&[3.0, 1.0, 2.0]).unwrap().median, 2.0);
        let even = spread(&[4.0, 1.0, 2.0, 3.0]).unwrap();
        assert_eq!((even.median, even.low, even.high), (2.5, 1.0, 4.0));
        assert_eq!(even.rows, [1, 2, 3, 0]);
    }
}
