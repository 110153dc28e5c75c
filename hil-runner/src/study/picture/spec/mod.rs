//! Keys of a picture in a study file: `[[picture]]`.
//!
//! Keys of every kind: `file` (stem of the specification's name), `title`, `kind`,
//! `caption`, and `where`, a table of columns and the value or values that a
//! row must have to be shown. The others are those of the kind.

mod kinds;
mod wanted;

use std::borrow::Cow;

pub use kinds::{Bars, Border, Histogram, Limit, Lines, Map, Panel, Scatter};
pub use wanted::{Atom, Condition};

use kinds::LinesKeys;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{DeserializeOwned, Error};
use serde_json::json;

use super::axis::AxisKeys;

/// True of words that can stand in pictures and pages.
pub(in crate::study) fn is_text(words: &str) -> bool {
    let fits = |c: char| {
        (!c.is_control() || matches!(c, '\n' | '\t')) && !matches!(c, '\u{fffe}' | '\u{ffff}')
    };
    words.chars().all(fits)
}

/// True of the stem of a file's name, which is also that of a folder: letters, digits, - and _.
pub(in crate::study) fn is_stem(name: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    !name.is_empty() && name.len() <= 100 && name.chars().all(plain)
}

/// One picture of a study.
///
/// ```
/// use hil_runner::study::picture::{Kind, Picture};
///
/// let picture: Picture = toml::from_str(
///     r#"
///     kind = "lines"
///     file = "following-error"
///     title = "Following error over the sample time"
///     x = "controller.sample_time_s"
///     x_scale = "log"
///     y = "peak_following_error_mm"
///     series = "drive.dac_bits"
///     limit = 0.5
///     where = { controller.law = "quantised" }
///     "#,
/// )?;
/// assert!(matches!(picture.kind, Kind::Lines(_)));
///
/// let error = toml::from_str::<Picture>("kind = \"pie\"\nfile = \"p\"\ntitle = \"P\"");
/// assert!(error.unwrap_err().to_string().contains("picture \"p\": there is no kind \"pie\""));
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Stem of the file's name.
    pub file: String,
    /// Title, shown above the plots.
    pub title: String,
    /// Words for the report on the thing to be seen.
    pub caption: Option<String>,
    /// Conditions that a row must fulfil to be shown.
    pub conditions: Vec<Condition>,
    /// Kind of drawing, with its keys.
    pub kind: Kind,
}

/// The kinds of pictures.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// Curves over a parameter, in one or several panels.
    Lines(Lines),
    /// A figure as colour over two parameters.
    Map(Map),
    /// A figure by categories.
    Bars(Bars),
    /// Distribution of a figure.
    Histogram(Histogram),
    /// One mark per run.
    Scatter(Scatter),
}

impl<'de> Deserialize<'de> for Picture {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = toml::Table::deserialize(deserializer)?;
        read(table).map_err(D::Error::custom)
    }
}

impl JsonSchema for Picture {
    fn schema_name() -> Cow<'static, str> {
        "Picture".into()
    }

    /// The keys of each kind with those of every picture; `x_*` stands for the keys of
    /// an axis, as in the structures.
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let kinds = [
            ("lines", LinesKeys::json_schema(generator)),
            ("map", Map::json_schema(generator)),
            ("bars", Bars::json_schema(generator)),
            ("histogram", Histogram::json_schema(generator)),
            ("scatter", Scatter::json_schema(generator)),
        ];
        let of_kind = |(kind, mut keys): (&str, Schema)| {
            let object = keys.ensure_object();
            let stem = r"^[\p{L}\p{N}_-]{1,100}$";
            let of_all = json!({
                "kind": {"const": kind},
                "file": {"type": "string", "pattern": stem, "description": "Stem of the file's name"},
                "title": {"type": "string", "description": "Title, shown above the plots"},
                "caption": {"type": "string", "description": "Words for the report on the thing to be seen"},
                "where": {"type": "object", "description": "Columns, each with the value or the values that a row must have to be shown"},
            });
            for key in ["kind", "file", "title", "caption", "where"] {
                object["properties"][key] = of_all[key].clone();
            }
            if let Some(required) = object["required"].as_array_mut() {
                required.extend(["kind", "file", "title"].map(serde_json::Value::from));
            }
            keys
        };
        json_schema!({"oneOf": kinds.map(of_kind)})
    }
}

/// Splits the keys of every picture from those of its kind, so that each part
/// refuses what it does not know.
fn read(mut table: toml::Table) -> Result<Picture, String> {
    if let Some(words) = table.values().find_map(no_text) {
        return Err(format!(
            "a picture has characters that are no text: {words:?}"
        ));
    }
    let file = text(&mut table, "file").map_err(|error| format!("a picture {error}"))?;
    if !is_stem(&file) {
        return Err(format!(
            "picture {file:?}: file is the stem of a file's name: letters, digits, - and _"
        ));
    }
    rest(table, &file).map_err(|error| format!("picture \"{file}\": {error}"))
}

fn rest(mut table: toml::Table, file: &str) -> Result<Picture, String> {
    let has_caption = table.contains_key("caption");
    let mut take = |key| text(&mut table, key).map_err(|error| format!("it {error}"));
    let (title, kind) = (take("title")?, take("kind")?);
    let caption = has_caption.then(|| take("caption")).transpose()?;
    let conditions = table.remove("where").map(wanted::conditions);
    let conditions = conditions.transpose()?.unwrap_or_default();
    let kind = match kind.as_str() {
        "lines" => Kind::Lines(Lines::read(table)?),
        "map" => Kind::Map(kind_keys(table, &["x", "y", "z"], Map::check)?),
        "bars" => Kind::Bars(kind_keys(table, &["y"], |_| Ok(()))?),
        "histogram" => Kind::Histogram(kind_keys(table, &["x"], Histogram::check)?),
        "scatter" => Kind::Scatter(kind_keys(table, &["x", "y"], |_| Ok(()))?),
        other => {
            return Err(format!(
                "there is no kind \"{other}\"; the kinds are lines, map, bars, histogram and scatter"
            ));
        }
    };
    Ok(Picture {
        file: file.to_owned(),
        title,
        caption,
        conditions,
        kind,
    })
}

/// The first words within a value that cannot stand in a picture.
fn no_text(value: &toml::Value) -> Option<&str> {
    match value {
        toml::Value::String(words) => Some(words.as_str()).filter(|words| !is_text(words)),
        toml::Value::Array(values) => values.iter().find_map(no_text),
        toml::Value::Table(table) => table.values().find_map(no_text),
        _ => None,
    }
}

/// Reads and checks the keys of a kind. Those of each of its axes, `x_scale`,
/// `x_label` and so on, are one field of its structure, `x_*`.
fn kind_keys<T: DeserializeOwned>(
    mut table: toml::Table,
    axes: &[&str],
    check: impl Fn(&T) -> Result<(), String>,
) -> Result<T, String> {
    let mut found = Vec::new();
    for axis in axes {
        let field = format!("{axis}_*");
        if table.contains_key(&field) {
            return Err(format!("unknown field `{field}`"));
        }
        let keys = AxisKeys::NAMES.iter().filter_map(|key| {
            let value = table.remove(&format!("{axis}_{key}"))?;
            Some(((*key).to_owned(), value))
        });
        let keys: toml::Table = keys.collect();
        if !keys.is_empty() {
            table.insert(field, toml::Value::Table(keys.clone()));
            found.push((axis, keys));
        }
    }
    let kind: T = read_as(table).map_err(|message| {
        axes.iter().fold(message, |message, axis| {
            let names = AxisKeys::NAMES.map(|key| format!("`{axis}_{key}`"));
            message.replace(&format!("`{axis}_*`"), &names.join(", "))
        })
    })?;
    check(&kind)?;
    for (axis, keys) in found {
        read_as::<AxisKeys>(keys)?.check(axis)?;
    }
    Ok(kind)
}

fn read_as<T: DeserializeOwned>(table: toml::Table) -> Result<T, String> {
    let value = toml::Value::Table(table).try_into();
    value.map_err(|error: toml::de::Error| error.message().trim_end().to_owned())
}

/// Takes a text out of the table.
fn text(table: &mut toml::Table, key: &str) -> Result<String, String> {
    match table.remove(key) {
        Some(toml::Value::String(text)) => Ok(text),
        Some(_) => Err(format!("has a {key} that is no text")),
        None => Err(format!("lacks {key}")),
    }
}

impl Picture {
    /// Puts limits of the budget where the picture asks for them; `budget` gives
    /// that of a column.
    pub fn take_budget(&mut self, budget: impl Fn(&str) -> Option<f64>) {
        match &mut self.kind {
            Kind::Lines(lines) => {
                for panel in &mut lines.panels {
                    let column = panel.first_column().to_owned();
                    Limit::resolve(&mut panel.limit, &column, &budget);
                }
            }
            Kind::Bars(bars) => Limit::resolve(&mut bars.limit, &bars.y, &budget),
            Kind::Histogram(figure) => Limit::resolve(&mut figure.limit, &figure.x, &budget),
            Kind::Scatter(scatter) => Limit::resolve(&mut scatter.limit, &scatter.y, &budget),
            Kind::Map(_) => {}
        }
    }

    /// The columns that the picture needs, so that a study file can be held
    /// against its results before they exist.
    pub fn columns(&self) -> Vec<&str> {
        let (named, others): (Vec<&String>, Vec<&Option<String>>) = match &self.kind {
            Kind::Lines(lines) => {
                let panels = lines.panels.iter();
                let of_panels = panels.flat_map(|panel| panel.y.iter().chain(&panel.theory));
                (of_panels.chain([&lines.x]).collect(), vec![&lines.series])
            }
            Kind::Map(map) => (
                vec![&map.x, &map.y, &map.z],
                vec![&map.pass, &map.status, &map.contours_of],
            ),
            Kind::Bars(bars) => (vec![&bars.category, &bars.y], vec![&bars.series]),
            Kind::Histogram(histogram) => (vec![&histogram.x], Vec::new()),
            Kind::Scatter(scatter) => (vec![&scatter.x, &scatter.y], vec![&scatter.pass]),
        };
        let conditions = self.conditions.iter().map(|of| &of.column);
        let names = named.into_iter().chain(others.into_iter().flatten());
        let mut names: Vec<&str> = names.chain(conditions).map(String::as_str).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}
