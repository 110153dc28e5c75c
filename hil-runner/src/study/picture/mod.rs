//! Pictures of the results of a study, as Vega-Lite specifications.
//!
//! ```text
//! [[picture]] ──► Picture ─┐
//! results ──► Table ───────┼──► specify ──► Vega-Lite specification
//! theory ──► Curve ────────┘
//! ```
//!
//! What a mark stands for is decided here: rows that share a place, bins, cells,
//! contours, units by prefix, what is left out. A mark has `rows`, the runs behind
//! it by their value, so that a reader can ask for them; Vega only draws. The
//! specification is deterministic: same picture, table and curves, same bytes on
//! every machine.
//!
//! Nothing is left out in silence: values that are missing, not above 0 on a
//! logarithmic axis, or beyond its ends are counted below the title, and as numbers
//! in `usermeta`.

mod axis;
mod bars;
mod colour;
mod contour;
mod grid;
mod group;
mod histogram;
mod label;
mod lines;
mod map;
mod note;
mod reference;
mod scatter;
mod sheet;
mod spec;
mod table;
mod unit;

use serde_json::Value;

use note::Chosen;

pub use axis::{AxisKeys, Spacing};
pub use colour::ColourScale;
pub(in crate::study) use contour::Field;
pub use label::Label;
pub use spec::{
    Atom, Bars, Border, Condition, Histogram, Kind, Limit, Lines, Map, Panel, Picture, Scatter,
};
pub(in crate::study) use spec::{is_stem, is_text};
pub use table::{Column, Table, Values};

/// Reason for a missing picture, as a sentence. Every one is a mistake in the
/// study file or in the table; the other pictures of a study are not touched by
/// it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct PictureError(String);

impl PictureError {
    fn new(sentence: impl Into<String>) -> Self {
        Self(sentence.into())
    }

    /// Columns, or a column and the unit that was asked for, with units that
    /// cannot share an axis.
    fn units([(one, its), (other, others)]: [(&str, &str); 2]) -> Self {
        let words = |unit| match unit {
            "" => "no unit",
            unit => unit,
        };
        let [its, others] = [its, others].map(words);
        Self(format!(
            "\"{one}\" is in {its} and \"{other}\" in {others}: they cannot share an axis"
        ))
    }
}

/// A curve that is drawn over a picture, such as a border that theory knows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Words for the legend.
    pub label: String,
    /// Points in the units of the columns of x and y; what is not finite
    /// parts the curve.
    pub points: Vec<(f64, f64)>,
}

/// Specifies a picture.
///
/// The curves are drawn over a `map`.
///
/// ```
/// use hil_runner::study::picture::{Column, Picture, Table, Values, specify};
///
/// let column = |name: &str, values: [f64; 3]| Column {
///     name: name.to_owned(),
///     values: Values::Number(values.map(Some).to_vec()),
///     own: None,
/// };
/// let table = Table {
///     columns: vec![
///         column("controller.sample_time_s", [0.000_25, 0.000_5, 0.001]),
///         column("peak_following_error_mm", [0.31, 0.33, 0.38]),
///     ],
/// };
/// let picture: Picture = toml::from_str(
///     "kind = \"lines\"\nfile = \"error\"\ntitle = \"Error\"\n\
///      x = \"controller.sample_time_s\"\ny = \"peak_following_error_mm\"",
/// )?;
/// let specification = specify(&picture, &table, &[])?;
/// let first = &specification["datasets"]["runs_0"][0];
/// assert_eq!((&first["rows"][0], &first["x"]), (&0.into(), &0.25.into()));
/// assert!(specification.to_string().contains("Sample time Δt [ms]"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// A mistake, with the name of the picture: a column that the table lacks, words
/// where numbers are needed, two units on one axis, a map of rows that are no
/// grid.
pub fn specify(spec: &Picture, table: &Table, curves: &[Curve]) -> Result<Value, PictureError> {
    let specified = || {
        table.check()?;
        let mut chosen = Chosen::of(spec, table)?;
        let plots = match &spec.kind {
            Kind::Lines(lines) => lines::plots(lines, &mut chosen)?,
            Kind::Map(map) => vec![map::plot(map, curves, &mut chosen)?],
            Kind::Bars(bars) => vec![bars::plot(bars, &mut chosen)?],
            Kind::Histogram(histogram) => vec![histogram::plot(histogram, &mut chosen)?],
            Kind::Scatter(scatter) => vec![scatter::plot(scatter, &mut chosen)?],
        };
        Ok(sheet::whole(spec, &chosen, plots))
    };
    let file = &spec.file;
    specified().map_err(|error: PictureError| PictureError(format!("picture \"{file}\": {error}")))
}
