//! The kinds of pictures, and the limit of a figure.

use std::borrow::Cow;

use hil_core::figures;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer};

use super::kind_keys;
use crate::study::picture::axis::AxisKeys;
use crate::study::picture::colour::ColourScale;

/// Curves over a parameter.
///
/// Rows that share x and series are one point: their median, with a band from
/// the smallest to the largest.
#[derive(Debug, Clone, PartialEq)]
pub struct Lines {
    /// Column along x; words are places in the order of the rows.
    pub x: String,
    /// The axis of x: `x_scale`, `x_label`, `x_unit`, `x_range`.
    pub x_axis: AxisKeys,
    /// Column whose values are the series.
    pub series: Option<String>,
    /// Words for what has marks, in the legend; without this key `simulated`,
    /// or the columns' own where a plot has several.
    pub marks: Option<String>,
    /// Words for what is dashed; without this key `theory`, or as above.
    pub dashes: Option<String>,
    /// The plots from top to bottom; the keys of a panel may stand in the
    /// picture itself if there is only one.
    pub panels: Vec<Panel>,
}

/// One plot of a picture of lines.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Simulated columns: marks and lines.
    #[serde(default, deserialize_with = "columns")]
    #[schemars(with = "Columns")]
    pub y: Vec<String>,
    /// Columns of theory: dashed lines.
    #[serde(default, deserialize_with = "columns")]
    #[schemars(with = "Columns")]
    pub theory: Vec<String>,
    /// The axis of y: `y_scale`, `y_label`, `y_unit`, `y_range`.
    #[serde(default, rename = "y_*")]
    pub y_axis: AxisKeys,
    /// Limit of the columns.
    pub limit: Option<Limit>,
}

impl Panel {
    fn check(&self) -> Result<(), String> {
        match self.y.is_empty() && self.theory.is_empty() {
            true => Err("y or theory must name at least one column".to_owned()),
            false => Ok(()),
        }
    }

    /// The column whose words and unit the axis of y has.
    pub(in crate::study::picture) fn first_column(&self) -> &str {
        let first = self.y.first().or(self.theory.first());
        first.map_or("", String::as_str)
    }
}

/// One column or several.
#[derive(Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a column or a list of columns")]
enum Columns {
    One(String),
    Several(Vec<String>),
}

fn columns<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    Ok(match Columns::deserialize(deserializer)? {
        Columns::One(name) => vec![name],
        Columns::Several(names) => names,
    })
}

/// Keys of a picture of lines, among them those of its only panel.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct LinesKeys {
    x: String,
    #[serde(default, rename = "x_*")]
    x_axis: AxisKeys,
    series: Option<String>,
    marks: Option<String>,
    dashes: Option<String>,
    #[serde(default, deserialize_with = "columns")]
    #[schemars(with = "Columns")]
    y: Vec<String>,
    #[serde(default, deserialize_with = "columns")]
    #[schemars(with = "Columns")]
    theory: Vec<String>,
    #[serde(rename = "y_*")]
    y_axis: Option<AxisKeys>,
    limit: Option<Limit>,
    #[serde(default)]
    #[schemars(with = "Vec<Panel>")]
    panel: Vec<toml::Table>,
}

impl Lines {
    pub(super) fn read(table: toml::Table) -> Result<Self, String> {
        let keys: LinesKeys = kind_keys(table, &["x", "y"], |_| Ok(()))?;
        let has_axis = keys.y_axis.is_some();
        let own = Panel {
            y: keys.y,
            theory: keys.theory,
            y_axis: keys.y_axis.unwrap_or_default(),
            limit: keys.limit,
        };
        let panels = if keys.panel.is_empty() {
            own.check()?;
            vec![own]
        } else if !has_axis && own == Panel::default() {
            let panels = keys.panel.into_iter();
            let panels = panels.map(|table| kind_keys(table, &["y"], Panel::check));
            panels.collect::<Result<_, _>>()?
        } else {
            return Err(
                "with [[picture.panel]] the keys of y, theory and limit belong into the panels"
                    .to_owned(),
            );
        };
        Ok(Self {
            x: keys.x,
            x_axis: keys.x_axis,
            series: keys.series,
            marks: keys.marks,
            dashes: keys.dashes,
            panels,
        })
    }
}

/// A figure as colour over two parameters, one cell per pair of values.
///
/// Rows that share a cell show their median; the cell fails if one of them
/// does.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// Column along x; words are places in the order of the rows.
    pub x: String,
    /// Column along y.
    pub y: String,
    /// Column shown as colour.
    pub z: String,
    /// The axis of x: `x_scale`, `x_label`, `x_unit`, `x_range`.
    #[serde(default, rename = "x_*")]
    pub x_axis: AxisKeys,
    /// The axis of y, alike.
    #[serde(default, rename = "y_*")]
    pub y_axis: AxisKeys,
    /// The scale of colours, alike; beyond `z_range` its ends hold.
    #[serde(default, rename = "z_*")]
    pub z_axis: AxisKeys,
    /// `colours`: which scale.
    #[serde(default)]
    pub colours: ColourScale,
    /// Column of verdicts; a cell that fails has a cross. Without this key a
    /// column `pass` counts, if there is one.
    pub pass: Option<String>,
    /// Column that says in a word what became of a run; words other than
    /// `ok`, `done` and `made` are hatched. Without this key a column `status`
    /// counts, if there is one.
    pub status: Option<String>,
    /// Levels of contour lines, in the unit of their column.
    #[serde(default)]
    pub contours: Vec<f64>,
    /// Column of the contour lines; without this key that of the colours.
    pub contours_of: Option<String>,
    /// Borders of stability that whoever calls is to draw over the map: this
    /// module draws all that it is given.
    #[serde(default)]
    pub border: Vec<Border>,
}

impl Map {
    pub(super) fn check(&self) -> Result<(), String> {
        if self.x == self.y {
            return Err(format!("x and y are both \"{}\"", self.x));
        }
        if let Some(level) = self.contours.iter().find(|level| !level.is_finite()) {
            return Err(format!("contours has {level}, which is no level"));
        }
        if self.contours_of.is_some() && self.contours.is_empty() {
            return Err("contours_of needs levels: contours = […]".to_owned());
        }
        Ok(())
    }

    /// The column of the contour lines.
    pub(in crate::study::picture) fn contour_column(&self) -> &str {
        self.contours_of.as_ref().unwrap_or(&self.z)
    }
}

/// A border of stability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Border {
    /// Of the loop in contact.
    Contact,
    /// Of the loop in the gap.
    Gap,
}

/// A figure by categories: level bars with the number behind each.
///
/// Rows that share category and series are one bar: their median, with a line
/// from the smallest to the largest.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
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
    #[serde(default, rename = "y_*")]
    pub y_axis: AxisKeys,
    /// Limit of y.
    pub limit: Option<Limit>,
}

/// Distribution of a figure over the runs.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Histogram {
    /// Column of the figure.
    pub x: String,
    /// Its axis: `x_scale`, `x_label`, `x_unit`, `x_range`.
    #[serde(default, rename = "x_*")]
    pub x_axis: AxisKeys,
    /// Number of intervals, about; without this key by the rule of Freedman
    /// and Diaconis.
    pub bins: Option<usize>,
    /// Limit of the figure; the picture then tells the yield.
    pub limit: Option<Limit>,
}

impl Histogram {
    pub(super) fn check(&self) -> Result<(), String> {
        match self.bins.filter(|bins| !(1..=200).contains(bins)) {
            Some(bins) => Err(format!("bins = {bins} must be from 1 to 200")),
            None => Ok(()),
        }
    }
}

/// One mark per run, by verdict.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Column along x.
    pub x: String,
    /// Column along y.
    pub y: String,
    /// The axis of x: `x_scale`, `x_label`, `x_unit`, `x_range`.
    #[serde(default, rename = "x_*")]
    pub x_axis: AxisKeys,
    /// The axis of y, alike.
    #[serde(default, rename = "y_*")]
    pub y_axis: AxisKeys,
    /// Column of verdicts. Without this key a column `pass` counts, if there
    /// is one.
    pub pass: Option<String>,
    /// Limit of y.
    pub limit: Option<Limit>,
}

/// Limit of the magnitude of a figure, in the unit of its column.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Largest magnitude, or least value.
    pub value: f64,
    /// It is a least value.
    pub at_least: bool,
    /// Words for it.
    pub label: String,
    /// The value is still to be taken from the budget of the study's base
    /// (`limit = "budget"`).
    pub of_budget: bool,
}

impl Limit {
    /// Takes from the column whether the limit is a least value, and from the budget the
    /// value, if it is to be; no limit where the budget has none.
    pub(super) fn resolve(
        limit: &mut Option<Self>,
        column: &str,
        budget: &impl Fn(&str) -> Option<f64>,
    ) {
        *limit = limit.take().and_then(|mut limit| {
            limit.at_least = figures::find(column).is_some_and(|figure| figure.at_least);
            if limit.of_budget {
                (limit.value, limit.of_budget) = (budget(column)?, false);
            }
            Some(limit)
        });
    }

    /// True if a value keeps it.
    pub fn is_kept(&self, value: f64) -> bool {
        match self.at_least {
            true => value >= self.value,
            false => value.abs() <= self.value,
        }
    }
}

impl JsonSchema for Limit {
    fn schema_name() -> Cow<'static, str> {
        "Limit".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let value =
            json_schema!({"anyOf": [{"type": "number", "minimum": 0}, {"const": "budget"}]});
        json_schema!({"anyOf": [
            value,
            {
                "type": "object",
                "properties": {"value": value, "label": {"type": "string"}},
                "required": ["value"],
                "additionalProperties": false,
            },
        ]})
    }
}

impl<'de> Deserialize<'de> for Limit {
    /// A number or `"budget"`, or a table of `value` and `label`.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Value {
            Number(f64),
            Word(Budget),
        }
        #[derive(Deserialize)]
        #[serde(rename_all = "lowercase")]
        enum Budget {
            Budget,
        }
        #[derive(Deserialize)]
        #[serde(
            untagged,
            deny_unknown_fields,
            expecting = "limit must be a number, \"budget\" or { value = …, label = \"…\" }"
        )]
        enum Keys {
            Value(Value),
            Table { value: Value, label: Option<String> },
        }
        let (value, label) = match Keys::deserialize(deserializer)? {
            Keys::Value(value) => (value, None),
            Keys::Table { value, label } => (value, label),
        };
        let (value, of_budget) = match value {
            Value::Number(value) => (value, false),
            Value::Word(Budget::Budget) => (0.0, true),
        };
        if !(value.is_finite() && value >= 0.0) {
            return Err(serde::de::Error::custom(format!(
                "limit = {value} must be a number of at least 0: it holds for the magnitude"
            )));
        }
        Ok(Self {
            value,
            at_least: false,
            label: label.unwrap_or_else(|| "allowed".to_owned()),
            of_budget,
        })
    }
}
