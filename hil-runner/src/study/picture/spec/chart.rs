//! Kind `lines`: curves over a parameter.

use serde::{Deserialize, Deserializer};

use crate::study::picture::axis::{AxisKeys, Spacing};

/// Curves over a parameter.
///
/// Rows that share x and series are one point: their median, with a band from
/// the smallest to the largest.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "LinesKeys")]
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
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "PanelKeys")]
pub struct Panel {
    /// Simulated columns: marks and lines.
    pub y: Vec<String>,
    /// Columns of theory: dashed lines.
    pub theory: Vec<String>,
    /// The axis of y: `y_scale`, `y_label`, `y_unit`, `y_range`.
    pub y_axis: AxisKeys,
    /// What is allowed.
    pub limit: Option<Limit>,
}

/// What is allowed of the magnitude of a figure, in the unit of its column.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Largest magnitude.
    pub value: f64,
    /// Words for it.
    pub label: String,
    /// Whether the value is still to be taken from the budget of the study's
    /// base (`limit = "budget"`).
    pub of_budget: bool,
}

impl Limit {
    /// Puts the budget's limit of a column for the value, if it is to be; no
    /// limit where the budget has none.
    pub(super) fn resolve(
        limit: &mut Option<Self>,
        column: &str,
        budget: &impl Fn(&str) -> Option<f64>,
    ) {
        let Some(asked) = limit.as_mut().filter(|limit| limit.of_budget) else {
            return;
        };
        match budget(column) {
            Some(value) => (asked.value, asked.of_budget) = (value, false),
            None => *limit = None,
        }
    }
}

/// One column or several.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a column or a list of columns")]
enum Columns {
    One(String),
    Several(Vec<String>),
}

impl Default for Columns {
    fn default() -> Self {
        Self::Several(Vec::new())
    }
}

impl Columns {
    fn names(self) -> Vec<String> {
        match self {
            Self::One(name) => vec![name],
            Self::Several(names) => names,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LinesKeys {
    x: String,
    #[serde(default)]
    x_scale: Spacing,
    x_label: Option<String>,
    x_unit: Option<String>,
    x_range: Option<[f64; 2]>,
    series: Option<String>,
    marks: Option<String>,
    dashes: Option<String>,
    #[serde(default)]
    y: Columns,
    #[serde(default)]
    theory: Columns,
    y_scale: Option<Spacing>,
    y_label: Option<String>,
    y_unit: Option<String>,
    y_range: Option<[f64; 2]>,
    limit: Option<Limit>,
    #[serde(default)]
    panel: Vec<Panel>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PanelKeys {
    #[serde(default)]
    y: Columns,
    #[serde(default)]
    theory: Columns,
    #[serde(default)]
    y_scale: Spacing,
    y_label: Option<String>,
    y_unit: Option<String>,
    y_range: Option<[f64; 2]>,
    limit: Option<Limit>,
}

impl TryFrom<LinesKeys> for Lines {
    type Error = String;

    fn try_from(keys: LinesKeys) -> Result<Self, String> {
        let x_axis = axis("x", keys.x_scale, keys.x_label, keys.x_unit, keys.x_range)?;
        let own = PanelKeys {
            y: keys.y,
            theory: keys.theory,
            y_scale: keys.y_scale.unwrap_or_default(),
            y_label: keys.y_label,
            y_unit: keys.y_unit,
            y_range: keys.y_range,
            limit: keys.limit,
        };
        let panels = if keys.panel.is_empty() {
            vec![Panel::try_from(own)?]
        } else if own.says_nothing() && keys.y_scale.is_none() {
            keys.panel
        } else {
            return Err(
                "with [[picture.panel]] the keys of y, theory and limit belong into the \
                        panels"
                    .to_owned(),
            );
        };
        Ok(Self {
            x: keys.x,
            x_axis,
            series: keys.series,
            marks: keys.marks,
            dashes: keys.dashes,
            panels,
        })
    }
}

impl PanelKeys {
    fn says_nothing(&self) -> bool {
        let empty =
            |columns: &Columns| matches!(columns, Columns::Several(names) if names.is_empty());
        empty(&self.y)
            && empty(&self.theory)
            && self.y_label.is_none()
            && self.y_unit.is_none()
            && self.y_range.is_none()
            && self.limit.is_none()
    }
}

impl TryFrom<PanelKeys> for Panel {
    type Error = String;

    fn try_from(keys: PanelKeys) -> Result<Self, String> {
        let (y, theory) = (keys.y.names(), keys.theory.names());
        if y.is_empty() && theory.is_empty() {
            return Err("y or theory must name at least one column".to_owned());
        }
        Ok(Self {
            y,
            theory,
            y_axis: axis("y", keys.y_scale, keys.y_label, keys.y_unit, keys.y_range)?,
            limit: keys.limit,
        })
    }
}

/// Narrowest range of an axis, relative to its ends.
const NARROWEST: f64 = 1e-9;

/// Puts the keys of an axis together.
pub(super) fn axis(
    name: &str,
    spacing: Spacing,
    label: Option<String>,
    unit: Option<String>,
    range: Option<[f64; 2]>,
) -> Result<AxisKeys, String> {
    if let Some([low, high]) = range {
        let finite = low.is_finite() && high.is_finite();
        if !(finite && low < high) {
            return Err(format!(
                "{name}_range = [{low}, {high}] must rise from a number to a larger one"
            ));
        }
        if high - low < NARROWEST * low.abs().max(high.abs()) {
            return Err(format!(
                "{name}_range = [{low}, {high}] is too narrow: numbers on it could not be told apart"
            ));
        }
        if spacing == Spacing::Log && low <= 0.0 {
            return Err(format!(
                "{name}_range = [{low}, {high}] must be above 0 on a logarithmic axis"
            ));
        }
    }
    Ok(AxisKeys {
        label,
        unit,
        spacing,
        range: range.map(|[low, high]| (low, high)),
    })
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
        #[serde(deny_unknown_fields)]
        struct Table {
            value: Value,
            label: Option<String>,
        }
        #[derive(Deserialize)]
        #[serde(
            untagged,
            expecting = "limit must be a number, \"budget\" or { value = …, label = \"…\" }"
        )]
        enum Keys {
            Value(Value),
            Table(Table),
        }
        let (value, label) = match Keys::deserialize(deserializer)? {
            Keys::Value(value) => (value, None),
            Keys::Table(table) => (table.value, table.label),
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
            label: label.unwrap_or_else(|| "allowed".to_owned()),
            of_budget,
        })
    }
}
