//! The other kinds: map, bars, histogram, scatter.

use serde::Deserialize;

use super::chart::{Limit, axis};
use crate::study::picture::axis::{AxisKeys, Spacing};
use crate::study::picture::colour::ColourScale;

/// A figure as colour over two parameters, one cell per pair of values.
///
/// Rows that share a cell show their median; the cell fails if one of them
/// does.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "MapKeys")]
pub struct Map {
    /// Column along x; words are places in the order of the rows.
    pub x: String,
    /// Column along y.
    pub y: String,
    /// Column shown as colour.
    pub z: String,
    /// The axis of x: `x_scale`, `x_label`, `x_unit`, `x_range`.
    pub x_axis: AxisKeys,
    /// The axis of y, alike.
    pub y_axis: AxisKeys,
    /// The scale of colours, alike; beyond `z_range` its ends hold.
    pub z_axis: AxisKeys,
    /// `colours`: which scale.
    pub colours: ColourScale,
    /// Column of verdicts; a cell that fails has a cross. Without this key a
    /// column `pass` counts, if there is one.
    pub pass: Option<String>,
    /// Column that says in a word what became of a run; words other than
    /// `ok`, `done` and `made` are hatched. Without this key a column `status`
    /// counts, if there is one.
    pub status: Option<String>,
    /// Levels of contour lines, in the unit of their column.
    pub contours: Vec<f64>,
    /// Column of the contour lines; without this key that of the colours.
    pub contours_of: Option<String>,
    /// Borders of stability that whoever calls is to draw over the map: this
    /// module draws all that it is given.
    pub border: Vec<Border>,
}

/// A border of stability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Border {
    /// Of the loop with the joint closed.
    Closed,
    /// Of the loop with the joint open.
    Open,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapKeys {
    x: String,
    y: String,
    z: String,
    #[serde(default)]
    x_scale: Spacing,
    x_label: Option<String>,
    x_unit: Option<String>,
    x_range: Option<[f64; 2]>,
    #[serde(default)]
    y_scale: Spacing,
    y_label: Option<String>,
    y_unit: Option<String>,
    y_range: Option<[f64; 2]>,
    #[serde(default)]
    z_scale: Spacing,
    z_label: Option<String>,
    z_unit: Option<String>,
    z_range: Option<[f64; 2]>,
    #[serde(default)]
    colours: ColourScale,
    pass: Option<String>,
    status: Option<String>,
    #[serde(default)]
    contours: Vec<f64>,
    contours_of: Option<String>,
    #[serde(default)]
    border: Vec<Border>,
}

impl TryFrom<MapKeys> for Map {
    type Error = String;

    fn try_from(keys: MapKeys) -> Result<Self, String> {
        if keys.x == keys.y {
            return Err(format!("x and y are both \"{}\"", keys.x));
        }
        if let Some(level) = keys.contours.iter().find(|level| !level.is_finite()) {
            return Err(format!("contours has {level}, which is no level"));
        }
        if keys.contours_of.is_some() && keys.contours.is_empty() {
            return Err("contours_of needs levels: contours = […]".to_owned());
        }
        Ok(Self {
            x_axis: axis("x", keys.x_scale, keys.x_label, keys.x_unit, keys.x_range)?,
            y_axis: axis("y", keys.y_scale, keys.y_label, keys.y_unit, keys.y_range)?,
            z_axis: axis("z", keys.z_scale, keys.z_label, keys.z_unit, keys.z_range)?,
            x: keys.x,
            y: keys.y,
            z: keys.z,
            colours: keys.colours,
            pass: keys.pass,
            status: keys.status,
            contours: keys.contours,
            contours_of: keys.contours_of,
            border: keys.border,
        })
    }
}

/// A figure by categories: level bars with the number behind each.
///
/// Rows that share category and series are one bar: their median, with a line
/// from the smallest to the largest.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "BarsKeys")]
pub struct Bars {
    /// Column of the categories.
    pub category: String,
    /// Words for it instead of those of the column's name.
    pub category_label: Option<String>,
    /// Column whose values are the bars of a category.
    pub series: Option<String>,
    /// Column of the bars' lengths.
    pub y: String,
    /// Its axis: `y_scale`, `y_label`, `y_unit`, `y_range`.
    pub y_axis: AxisKeys,
    /// What is allowed.
    pub limit: Option<Limit>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BarsKeys {
    category: String,
    category_label: Option<String>,
    series: Option<String>,
    y: String,
    #[serde(default)]
    y_scale: Spacing,
    y_label: Option<String>,
    y_unit: Option<String>,
    y_range: Option<[f64; 2]>,
    limit: Option<Limit>,
}

impl TryFrom<BarsKeys> for Bars {
    type Error = String;

    fn try_from(keys: BarsKeys) -> Result<Self, String> {
        Ok(Self {
            category: keys.category,
            category_label: keys.category_label,
            series: keys.series,
            y: keys.y,
            y_axis: axis("y", keys.y_scale, keys.y_label, keys.y_unit, keys.y_range)?,
            limit: keys.limit,
        })
    }
}

/// How a figure is distributed over the runs.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "HistogramKeys")]
pub struct Histogram {
    /// Column of the figure.
    pub x: String,
    /// Its axis: `x_scale`, `x_label`, `x_unit`, `x_range`.
    pub x_axis: AxisKeys,
    /// Number of intervals, about; without this key by the rule of Freedman
    /// and Diaconis.
    pub bins: Option<usize>,
    /// What is allowed; the picture then tells the yield.
    pub limit: Option<Limit>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HistogramKeys {
    x: String,
    #[serde(default)]
    x_scale: Spacing,
    x_label: Option<String>,
    x_unit: Option<String>,
    x_range: Option<[f64; 2]>,
    bins: Option<usize>,
    limit: Option<Limit>,
}

impl TryFrom<HistogramKeys> for Histogram {
    type Error = String;

    fn try_from(keys: HistogramKeys) -> Result<Self, String> {
        if let Some(bins) = keys.bins.filter(|bins| !(1..=200).contains(bins)) {
            return Err(format!("bins = {bins} must be from 1 to 200"));
        }
        Ok(Self {
            x: keys.x,
            x_axis: axis("x", keys.x_scale, keys.x_label, keys.x_unit, keys.x_range)?,
            bins: keys.bins,
            limit: keys.limit,
        })
    }
}

/// One mark per run, by verdict.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "ScatterKeys")]
pub struct Scatter {
    /// Column along x.
    pub x: String,
    /// Column along y.
    pub y: String,
    /// The axis of x: `x_scale`, `x_label`, `x_unit`, `x_range`.
    pub x_axis: AxisKeys,
    /// The axis of y, alike.
    pub y_axis: AxisKeys,
    /// Column of verdicts. Without this key a column `pass` counts, if there
    /// is one.
    pub pass: Option<String>,
    /// What is allowed of y.
    pub limit: Option<Limit>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScatterKeys {
    x: String,
    y: String,
    #[serde(default)]
    x_scale: Spacing,
    x_label: Option<String>,
    x_unit: Option<String>,
    x_range: Option<[f64; 2]>,
    #[serde(default)]
    y_scale: Spacing,
    y_label: Option<String>,
    y_unit: Option<String>,
    y_range: Option<[f64; 2]>,
    pass: Option<String>,
    limit: Option<Limit>,
}

impl TryFrom<ScatterKeys> for Scatter {
    type Error = String;

    fn try_from(keys: ScatterKeys) -> Result<Self, String> {
        Ok(Self {
            x_axis: axis("x", keys.x_scale, keys.x_label, keys.x_unit, keys.x_range)?,
            y_axis: axis("y", keys.y_scale, keys.y_label, keys.y_unit, keys.y_range)?,
            x: keys.x,
            y: keys.y,
            pass: keys.pass,
            limit: keys.limit,
        })
    }
}
