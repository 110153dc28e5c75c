//! What is wrong with a specification: by the rules of Vega-Lite, and against the rows
//! that it shows.

use std::collections::BTreeSet;

use hil_runner::study::picture::{Kind, Picture};
use serde_json::Value;

const MARKS: [&str; 7] = ["area", "bar", "line", "point", "rect", "rule", "text"];
const CHANNELS: [&str; 16] = [
    "x",
    "y",
    "x2",
    "y2",
    "yOffset",
    "color",
    "fill",
    "stroke",
    "strokeDash",
    "shape",
    "opacity",
    "detail",
    "order",
    "text",
    "tooltip",
    "size",
];
const OF_PLACES: [&str; 5] = ["field", "type", "title", "axis", "scale"];

/// Everything that is wrong with a specification, whatever it shows.
pub(crate) fn wrong(spec: &Value) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut names = BTreeSet::new();
    let views = spec["vconcat"].as_array().cloned();
    for view in views.unwrap_or_else(|| vec![spec.clone()]) {
        let Some(layers) = view["layer"].as_array().filter(|layers| !layers.is_empty()) else {
            wrong.push("a view without layers".to_owned());
            continue;
        };
        if !(view["width"].is_number()
            && (view["height"].is_number() || view["height"]["step"].is_number()))
        {
            wrong.push("a view without a size".to_owned());
        }
        for layer in layers {
            // A legend of its own scale.
            let inner = layer["layer"].as_array().cloned();
            for layer in inner.unwrap_or_else(|| vec![layer.clone()]) {
                of_layer(spec, &layer, &mut names, &mut wrong);
            }
        }
    }
    for name in chosen(spec) {
        if !names.contains(&name) {
            wrong.push(format!("no parameter {name}"));
        }
    }
    if spec["$schema"] != "https://vega.github.io/schema/vega-lite/v6.json" {
        wrong.push("no schema".to_owned());
    }
    wrong
}

fn of_layer(spec: &Value, layer: &Value, names: &mut BTreeSet<String>, wrong: &mut Vec<String>) {
    let kind = layer["mark"]["type"].as_str().or(layer["mark"].as_str());
    if kind.is_none_or(|kind| !MARKS.contains(&kind)) {
        wrong.push(format!("no mark: {}", layer["mark"]));
    }
    let data = match layer["data"]["name"].as_str() {
        Some(name) => spec["datasets"][name].as_array(),
        None => layer["data"]["values"].as_array(),
    };
    let Some(data) = data else {
        return wrong.push(format!("no data: {}", layer["data"]));
    };
    for (channel, of) in layer["encoding"].as_object().into_iter().flatten() {
        if !CHANNELS.contains(&channel.as_str()) {
            wrong.push(format!("no channel: {channel}"));
        }
        let field = of["field"].as_str();
        let filtered = layer["transform"].is_array();
        let has = |datum: &Value, field: &str| {
            !datum[field].is_null() || channel == "fill" || channel == "stroke" || filtered
        };
        if let Some(field) = field.filter(|_| kind != Some("text"))
            && let Some(datum) = data.iter().find(|datum| !has(datum, field))
        {
            wrong.push(format!("{channel} of {field}, which is not in {datum}"));
        }
        let ends = of["scale"]["domain"].as_array();
        if let (Some("linear" | "log"), Some(ends)) = (of["scale"]["type"].as_str(), ends) {
            let [low, high] =
                [0, 1].map(|at| ends.get(at).and_then(Value::as_f64).unwrap_or(f64::NAN));
            let least = if of["scale"]["type"] == "log" {
                0.0
            } else {
                f64::NEG_INFINITY
            };
            if !(low > least && low < high && high.is_finite()) {
                wrong.push(format!("{channel} from {low} to {high}"));
            }
        }
        if channel == "x" || channel == "y" {
            let keys: Vec<&String> = of
                .as_object()
                .into_iter()
                .flatten()
                .map(|(key, _)| key)
                .collect();
            let known = |key: &&String| {
                OF_PLACES.contains(&key.as_str()) || *key == "stack" || *key == "sort"
            };
            if let Some(key) = keys.iter().find(|key| !known(key)) {
                wrong.push(format!("{channel} has a key {key}"));
            }
        }
    }
    for param in layer["params"].as_array().into_iter().flatten() {
        let name = param["name"].as_str().unwrap_or_default();
        if !names.insert(name.to_owned()) {
            wrong.push(format!("two parameters {name}"));
        }
    }
}

/// Parameters that conditions name.
fn chosen(value: &Value) -> Vec<String> {
    match value {
        Value::Object(fields) => {
            let own = fields.get("condition").and_then(|of| of["param"].as_str());
            let inner = fields.values().flat_map(chosen);
            own.map(str::to_owned).into_iter().chain(inner).collect()
        }
        Value::Array(values) => values.iter().flat_map(chosen).collect(),
        _ => Vec::new(),
    }
}

/// The marks of a specification.
pub(crate) fn marks(spec: &Value) -> Vec<&Value> {
    let datasets = spec["datasets"].as_object().unwrap();
    datasets
        .values()
        .flat_map(|marks| marks.as_array().unwrap())
        .collect()
}

/// The runs behind a mark.
pub(crate) fn rows_of(mark: &Value) -> Vec<usize> {
    let rows = mark["rows"].as_array().into_iter().flatten();
    rows.map(|row| row.as_u64().unwrap() as usize).collect()
}

/// Columns of which every row has a value in the picture.
fn columns(picture: &Picture) -> usize {
    match &picture.kind {
        Kind::Lines(lines) => lines
            .panels
            .iter()
            .map(|panel| panel.y.len() + panel.theory.len())
            .sum(),
        _ => 1,
    }
}

/// Rows that are neither shown nor counted, or twice; what scatters beyond the axes is
/// not among the marks.
pub(crate) fn lost(picture: &Picture, rows: usize, spec: &Value) -> i64 {
    let shown: usize = marks(spec).iter().map(|mark| rows_of(mark).len()).sum();
    let count = |key: &str| spec["usermeta"][key].as_u64().unwrap() as i64;
    let beyond = match picture.kind {
        Kind::Scatter(_) => count("beyond"),
        _ => 0,
    };
    let wanted = rows as i64 - count("unwanted") - count("excluded");
    wanted * columns(picture) as i64
        - shown as i64
        - count("missing")
        - count("not_above_0")
        - beyond
}

/// Marks whose value is not that of their rows: a power of ten times their median.
pub(crate) fn false_marks(
    picture: &Picture,
    value: impl Fn(&str, usize) -> Option<f64>,
    spec: &Value,
) -> Vec<Value> {
    let (column, field) = match &picture.kind {
        Kind::Lines(_) => (None, "y"),
        Kind::Map(map) => (Some(&map.z), "z"),
        Kind::Bars(bars) => (Some(&bars.y), "x"),
        Kind::Scatter(scatter) => (Some(&scatter.y), "y"),
        Kind::Histogram(_) => return Vec::new(),
    };
    let is_false = |mark: &&Value| {
        let column = column
            .map(String::as_str)
            .or(mark["column"].as_str())
            .unwrap();
        let rows = rows_of(mark);
        let Some(shown) = mark[field].as_f64().filter(|_| !rows.is_empty()) else {
            return false;
        };
        let values: Vec<f64> = rows.iter().filter_map(|&row| value(column, row)).collect();
        let ascending = values.windows(2).all(|pair| pair[0] <= pair[1]);
        let middle = f64::midpoint(values[(values.len() - 1) / 2], values[values.len() / 2]);
        let decades = (shown / middle).log10();
        let same = middle.abs() < 1e-99 && shown == 0.0 || (decades - decades.round()).abs() < 1e-5;
        !(ascending && same)
    };
    marks(spec).into_iter().filter(is_false).cloned().collect()
}
