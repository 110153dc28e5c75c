//! Why a picture cannot be drawn.

use std::fmt;

/// Why a picture cannot be drawn. Every one is a mistake in the study file or
/// in the table; the other pictures of a study are not touched by it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum PictureError {
    /// The table has no column of this name.
    UnknownColumn(String),
    /// This column has words where numbers are needed.
    NotNumbers(String),
    /// A column with more or fewer rows than the first one.
    Lengths {
        /// Its name.
        column: String,
        /// Its rows.
        rows: usize,
        /// The rows of the first column.
        expected: usize,
    },
    /// Columns with different units that should share an axis.
    Units {
        /// The first column.
        first: String,
        /// Its unit.
        first_unit: String,
        /// The other column, or the unit that was asked for.
        other: String,
        /// The other unit.
        other_unit: String,
    },
    /// The rows of a map fill too little of the grid that their values span.
    NoGrid {
        /// Different values along x.
        across: usize,
        /// Different values along y.
        up: usize,
        /// Cells with a row, at most.
        filled: usize,
    },
    /// The words beside a plot leave no room for it.
    NoRoom,
    /// More bars than a picture can show.
    TooManyBars(usize),
    /// More series than a legend can tell apart.
    TooManySeries {
        /// The column whose values are the series.
        column: String,
        /// Its different values.
        values: usize,
    },
    /// The drawing library refused.
    Drawing(String),
    /// An error in the picture with this file name.
    In(String, Box<PictureError>),
}

impl PictureError {
    /// Names the picture that the error is in.
    pub(super) fn in_picture(self, file: &str) -> Self {
        Self::In(file.to_owned(), Box::new(self))
    }
}

impl fmt::Display for PictureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownColumn(name) => match hil_core::renamed::renamed(name) {
                Some(now) => write!(f, "{name} is now {now}"),
                None => write!(f, "the results have no column \"{name}\""),
            },
            Self::NotNumbers(name) => {
                write!(f, "column \"{name}\" has words, and this needs numbers")
            }
            Self::Lengths {
                column,
                rows,
                expected,
            } => write!(
                f,
                "column \"{column}\" has {rows} rows where the first column has {expected}"
            ),
            Self::Units {
                first,
                first_unit,
                other,
                other_unit,
            } => write!(
                f,
                "\"{first}\" is in {} and \"{other}\" in {}: they cannot share an axis",
                unit_words(first_unit),
                unit_words(other_unit)
            ),
            Self::NoGrid { across, up, filled } => write!(
                f,
                "a map needs a regular grid, but {across} values along x and {up} along y make {} \
                 cells of which at most {filled} have a run; kind \"scatter\" can show such a plan",
                across * up
            ),
            Self::NoRoom => f.write_str("the words beside the plot leave no room for it"),
            Self::TooManyBars(bars) => write!(
                f,
                "{bars} bars are more than a picture can show; kind \"histogram\" or \"lines\" can"
            ),
            Self::TooManySeries { column, values } => write!(
                f,
                "column \"{column}\" has {values} different values, more series than a legend can \
                 tell apart"
            ),
            Self::Drawing(reason) => write!(f, "the picture could not be drawn: {reason}"),
            Self::In(file, error) => write!(f, "picture \"{file}\": {error}"),
        }
    }
}

impl std::error::Error for PictureError {}

/// A unit in a sentence, where "no unit" must be said.
fn unit_words(unit: &str) -> &str {
    if unit.is_empty() { "no unit" } else { unit }
}
