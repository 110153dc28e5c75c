//! Reasons for a picture that cannot be drawn.

/// Reason for a missing picture. Every one is a mistake in the study file or
/// in the table; the other pictures of a study are not touched by it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The table has no column of this name.
    #[error("{}", no_column(.0))]
    UnknownColumn(String),
    /// This column has words where numbers are needed.
    #[error("column \"{0}\" has words, and this needs numbers")]
    NotNumbers(String),
    /// A column with more or fewer rows than the first one.
    #[error("column \"{column}\" has {rows} rows where the first column has {expected}")]
    Lengths {
        /// Its name.
        column: String,
        /// Its rows.
        rows: usize,
        /// The rows of the first column.
        expected: usize,
    },
    /// Columns with different units that should share an axis.
    #[error(
        "\"{first}\" is in {} and \"{other}\" in {}: they cannot share an axis",
        unit_words(.first_unit),
        unit_words(.other_unit)
    )]
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
    #[error(
        "a map needs a regular grid, but {across} values along x and {up} along y make {} cells \
         of which at most {filled} have a run; kind \"scatter\" can show such a plan",
        .across * .up
    )]
    NoGrid {
        /// Different values along x.
        across: usize,
        /// Different values along y.
        up: usize,
        /// Cells with a row, at most.
        filled: usize,
    },
    /// The words beside a plot leave no room for it.
    #[error("the words beside the plot leave no room for it")]
    NoRoom,
    /// More bars than a picture can show.
    #[error("{0} bars are more than a picture can show; kind \"histogram\" or \"lines\" can")]
    TooManyBars(usize),
    /// More series than a legend can tell apart.
    #[error(
        "column \"{column}\" has {values} different values, more series than a legend can tell \
         apart"
    )]
    TooManySeries {
        /// The column whose values are the series.
        column: String,
        /// Its different values.
        values: usize,
    },
    /// The drawing library refused.
    #[error("the picture could not be drawn: {0}")]
    Drawing(String),
    /// An error in the picture with this file name.
    #[error("picture \"{0}\": {1}")]
    In(String, Box<PictureError>),
}

/// A unit in a sentence, where "no unit" must be said.
fn unit_words(unit: &str) -> &str {
    if unit.is_empty() { "no unit" } else { unit }
}

/// The sentence on a column that is not there, with its name today if it was
/// renamed.
fn no_column(name: &str) -> String {
    match hil_core::runfile::renamed(name) {
        Some(now) => format!("{name} is now {now}"),
        None => format!("the results have no column \"{name}\""),
    }
}
