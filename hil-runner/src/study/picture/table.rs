//! The results of a study as pictures and reports take them: named columns.

use super::PictureError;
use hil_core::runfile::renamed;

/// Largest magnitude that is shown; a run that left all bounds has no figure.
const LARGEST: f64 = 1e100;
/// Smaller magnitudes are shown as 0.
const SMALLEST: f64 = 1e-100;

/// Columns of equal length; one row is one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The columns, in the order of the results.
    pub columns: Vec<Column>,
}

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name with the unit as suffix: `controller.sample_time_s`,
    /// `peak_following_error_mm`.
    pub name: String,
    /// One value per row.
    pub values: Values,
    /// The value of the study's base, in the unit of the name: pictures mark
    /// it along their axes.
    pub own: Option<f64>,
}

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers in the unit of the column's name; `None` where a run has no such
    /// figure. What is not finite or beyond 10¹⁰⁰ counts as none.
    Number(Vec<Option<f64>>),
    /// Words.
    Text(Vec<String>),
}

impl Values {
    /// Number of rows.
    fn len(&self) -> usize {
        match self {
            Self::Number(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }
}

impl Table {
    /// Number of rows: those of the first column.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// The column of that name.
    pub fn find(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Every column has as many rows as the first.
    pub(super) fn check(&self) -> Result<(), PictureError> {
        let rows = self.rows();
        let mut columns = self.columns.iter();
        match columns.find(|column| column.values.len() != rows) {
            Some(column) => Err(PictureError::new(format!(
                "column \"{}\" has {} rows where the first column has {rows}",
                column.name,
                column.values.len()
            ))),
            None => Ok(()),
        }
    }

    /// The column of that name, or the one that counts without a name.
    pub(super) fn column_or(
        &self,
        name: Option<&String>,
        usual: &str,
    ) -> Result<Option<&Column>, PictureError> {
        match name {
            Some(name) => self.column(name).map(Some),
            None => Ok(self.find(usual)),
        }
    }

    /// The column of that name, or the sentence that there is none.
    pub(super) fn column(&self, name: &str) -> Result<&Column, PictureError> {
        // With its name today if it was renamed.
        let missing = || match renamed(name) {
            Some(now) => format!("{name} is now {now}"),
            None => format!("the results have no column \"{name}\""),
        };
        self.find(name).ok_or_else(|| PictureError::new(missing()))
    }
}

impl Column {
    /// The numbers of the column; what no axis can span is none.
    pub(super) fn numbers(&self) -> Result<Vec<Option<f64>>, PictureError> {
        match &self.values {
            Values::Number(values) => {
                // Differences and ratios of what is left neither overflow nor vanish.
                let fit = |value: f64| match value.abs() {
                    size if size < SMALLEST => Some(0.0),
                    size => (size <= LARGEST).then_some(value),
                };
                Ok(values.iter().map(|value| value.and_then(fit)).collect())
            }
            Values::Text(_) => Err(PictureError::new(format!(
                "column \"{}\" has words, and this needs numbers",
                self.name
            ))),
        }
    }

    /// The word of a row, if the column has words.
    pub(super) fn word(&self, row: usize) -> Option<&str> {
        match &self.values {
            Values::Text(words) => words.get(row).map(String::as_str),
            Values::Number(_) => None,
        }
    }

    /// The verdict that a cell of this column tells: 1 or 0, or a word for it.
    pub(super) fn verdict(&self, row: usize) -> Option<bool> {
        match &self.values {
            Values::Number(values) => match values.get(row).copied().flatten() {
                Some(1.0) => Some(true),
                Some(0.0) => Some(false),
                _ => None,
            },
            Values::Text(_) => match self.word(row)? {
                "pass" | "true" | "yes" | "1" => Some(true),
                "fail" | "false" | "no" | "0" => Some(false),
                _ => None,
            },
        }
    }
}

/// True of a word in a column of states that says that the run was made.
pub(super) fn is_made(word: &str) -> bool {
    matches!(word, "" | "ok" | "done" | "made")
}
