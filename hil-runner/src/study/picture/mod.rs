//! Pictures of the results of a study, as SVG.
//!
//! ```text
//! [[picture]] ──► Picture ─┐
//! results ──► Table ───────┼──► draw ──► SVG text
//! theory ──► Curve ────────┘
//! ```
//!
//! The drawing is deterministic: same picture, table and curves, same bytes on
//! every machine. `plotters` writes the SVG; layout and axes are our own, since
//! a picture must have its units by prefix, its numbers without overlaps, and a
//! legend beside the data, and the library knows no widths of text without
//! fonts. Coordinates are tenths of a pixel; the text of all labels is text.
//!
//! Nothing is left out in silence: values that are missing, not above 0 on a
//! logarithmic axis, or beyond its ends are counted in a remark below the plot.

mod axis;
mod bars;
mod canvas;
mod clip;
mod colour;
mod error;
mod frame;
mod group;
mod histogram;
mod label;
mod legend;
mod lines;
mod map;
mod mark;
mod note;
mod reference;
mod scatter;
mod sheet;
mod spec;
mod table;
mod text;
mod ticks;
mod unit;

pub use axis::{AxisKeys, Spacing};
pub use colour::ColourScale;
pub use error::PictureError;
pub use label::Label;
pub(in crate::study) use map::Field;
pub(in crate::study) use spec::is_text;
pub use spec::{
    Atom, Bars, Border, Condition, Histogram, Kind, Limit, Lines, Map, Panel, Picture, Scatter,
};
pub use table::{Column, Table, Values};

/// A curve that is drawn over a picture, such as a border that theory knows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Words for the legend.
    pub label: String,
    /// Points in the units of the columns of x and y; what is not finite
    /// parts the curve.
    pub points: Vec<(f64, f64)>,
}

/// Draws a picture.
///
/// The curves are drawn where there are two axes for them: in the first panel
/// of kind `lines`, in `map` and in `scatter`.
///
/// ```
/// use hil_runner::study::picture::{Column, Picture, Table, Values, draw};
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
/// let svg = draw(&picture, &table, &[])?;
/// assert!(svg.contains("Sample time Δt [ms]"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// A mistake, with the name of the picture: a column that the table lacks, words
/// where numbers are needed, two units on one axis, a map of rows that are no
/// grid.
pub fn draw(spec: &Picture, table: &Table, curves: &[Curve]) -> Result<String, PictureError> {
    let drawn = table.check().and_then(|()| match &spec.kind {
        Kind::Lines(lines) => lines::draw(spec, lines, table, curves),
        Kind::Map(map) => map::draw(spec, map, table, curves),
        Kind::Bars(bars) => bars::draw(spec, bars, table),
        Kind::Histogram(histogram) => histogram::draw(spec, histogram, table),
        Kind::Scatter(scatter) => scatter::draw(spec, scatter, table, curves),
    });
    drawn.map_err(|error| PictureError::new(format!("picture \"{}\": {error}", spec.file)))
}

impl Picture {
    /// The picture in words, for those who cannot see it.
    fn words(&self) -> String {
        match &self.caption {
            Some(caption) => format!("{}. {caption}", self.title),
            None => self.title.clone(),
        }
    }
}
