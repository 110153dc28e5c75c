//! What every specification has: title, remarks, style, data, plots.

use serde_json::{Map, Value, json};

use super::Picture;
use super::colour::{GRID, INK, MUTED};
use super::note::Chosen;

/// Width of a plot \[px\].
pub(super) const WIDTH: f64 = 740.0;

/// Characters of a line of the title, and of a remark.
const TITLE: usize = 84;
const NOTE: usize = 132;

/// Mean width of a letter of an axis' title \[px\].
const LETTER_PX: f64 = 6.6;

/// Layers over one pair of axes.
pub(super) struct Plot {
    /// Height \[px\], or the step of its bars.
    pub(super) height: Value,
    pub(super) layers: Vec<Value>,
    /// What its marks show: objects with `rows`, the runs behind a mark.
    pub(super) marks: Vec<Value>,
}

impl Plot {
    /// A plot without layers.
    pub(super) fn new(height: f64) -> Self {
        Self {
            height: json!(height),
            layers: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// Adds a layer of other data than the marks.
    pub(super) fn add(&mut self, data: &[Value], mark: Value, encoding: Value) {
        if !data.is_empty() {
            self.layers
                .push(json!({"data": {"values": data}, "mark": mark, "encoding": encoding}));
        }
    }
}

/// A layer that shows the marks of its plot.
pub(super) fn of_marks(mark: Value, encoding: Value) -> Value {
    json!({"data": {"name": "runs"}, "mark": mark, "encoding": encoding})
}

/// The same for those marks of which `filter` is true.
pub(super) fn of_some_marks(filter: &str, mark: Value, encoding: Value) -> Value {
    let mut layer = of_marks(mark, encoding);
    layer["transform"] = json!([{"filter": filter}]);
    layer
}

/// The whole specification.
pub(super) fn whole(picture: &Picture, chosen: &Chosen<'_>, mut plots: Vec<Plot>) -> Value {
    let mut datasets = Map::new();
    for (at, plot) in plots.iter_mut().enumerate() {
        let name = format!("runs_{at}");
        // A title longer than its axis would lie beside other plots.
        let room = plot.height.as_f64().map(|px| (px / LETTER_PX) as usize);
        for (place, layer) in plot.layers.iter_mut().enumerate() {
            if let (Some(title), Some(room)) = (layer["encoding"]["y"]["title"].as_str(), room) {
                layer["encoding"]["y"]["title"] = json!(fold(title, room));
            }
            if layer["data"]["name"] == "runs" {
                layer["data"]["name"] = json!(name);
                // What a pointer can ask: the page lets it through all others.
                if !layer["encoding"]["tooltip"].is_null() {
                    layer["name"] = json!(format!("asked_{at}_{place}"));
                }
            }
        }
        if plot.marks.is_empty() {
            plot.layers.push(nothing());
        }
        datasets.insert(name, Value::Array(std::mem::take(&mut plot.marks)));
    }
    let notes = chosen.notes.iter();
    let mut subtitle: Vec<String> = notes.flat_map(|note| fold(note, NOTE)).collect();
    subtitle.dedup();
    let words = match &picture.caption {
        Some(caption) => format!("{}. {caption}", picture.title),
        None => picture.title.clone(),
    };
    let mut spec = json!({
        "$schema": "https://vega.github.io/schema/vega-lite/v6.json",
        "description": words,
        "title": {"text": fold(&picture.title, TITLE), "subtitle": subtitle},
        "background": "white",
        "usermeta": chosen.left_out,
        "config": config(),
        "datasets": datasets,
    });
    let body = |plot: Plot| {
        json!({
            "width": WIDTH, "height": plot.height, "layer": plot.layers,
            "resolve": {"scale": {"stroke": "independent", "strokeDash": "independent"}},
        })
    };
    let mut bodies: Vec<Value> = plots.into_iter().map(body).collect();
    match (bodies.as_mut_slice(), spec.as_object_mut()) {
        ([Value::Object(body)], Some(spec)) => spec.append(body),
        _ => {
            (spec["spacing"], spec["vconcat"]) = (json!(14), json!(bodies));
            // A legend that all plots share could not be clicked.
            spec["resolve"] = json!({"scale": {"color": "independent", "shape": "independent"}});
        }
    }
    spec
}

/// A layer that says that there is none.
fn nothing() -> Value {
    json!({
        "data": {"values": [{}]},
        "mark": {"type": "text", "text": "no values", "fontSize": 14, "color": MUTED,
                 "x": {"expr": "width / 2"}, "y": {"expr": "height / 2"}},
    })
}

/// An interval over the marks of a layer, for the page's table of rows.
pub(super) fn brush(layer: &mut Value, place: usize, channels: &[&str]) {
    let brush = json!({
        "name": format!("brush_{place}"),
        "select": {"type": "interval", "encodings": channels},
    });
    layer["params"] = json!([brush]);
}

/// A choice in the legend of the colours, of the field `name`.
pub(super) fn choice(layer: &mut Value) {
    let choice = json!({
        "name": "chosen",
        "select": {"type": "point", "fields": ["name"], "toggle": "true"},
        "bind": "legend",
    });
    match layer["params"].as_array_mut() {
        Some(params) => params.push(choice),
        None => layer["params"] = json!([choice]),
    }
}

/// What is not chosen in the legend fades.
pub(super) fn fading(opacity: f64) -> Value {
    json!({"condition": {"param": "chosen", "value": opacity}, "value": 0.08 * opacity})
}

fn config() -> Value {
    json!({
        "font": "Liberation Sans, Arial, Helvetica, sans-serif",
        "title": {"anchor": "start", "frame": "group", "fontSize": 16, "color": INK, "offset": 10,
                  "subtitleFontSize": 11.5, "subtitleColor": MUTED, "subtitlePadding": 5},
        "view": {"stroke": MUTED},
        "axis": {"gridColor": GRID, "domain": false, "tickColor": MUTED, "labelColor": INK, "labelFontSize": 12,
                 "labelLimit": 280, "titleColor": INK, "titleFontSize": 13, "titleFontWeight": "normal", "titlePadding": 8},
        "axisX": {"tickCount": 9},
        "axisY": {"minExtent": 48, "tickCount": 7},
        "legend": {"orient": "top", "titleOrient": "left", "titleFontSize": 12, "titleColor": INK,
                   "titleLimit": 400, "labelFontSize": 12, "labelColor": INK, "labelLimit": 480,
                   "symbolStrokeWidth": 2, "symbolSize": 90, "offset": 8, "columnPadding": 18, "rowPadding": 4,
                   "layout": {"expr": "{top: {anchor: 'start', direction: 'vertical', margin: 4}}"}},
        "aria": false,
    })
}

/// A text in lines of at most so many characters, where its words allow it.
fn fold(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let words = text.split([' ', '\n', '\t']);
    for word in words.filter(|word| !word.is_empty()) {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::fold;

    #[test]
    fn lines_are_as_long_as_words_allow() {
        assert_eq!(fold("a bc def", 4), ["a bc", "def"]);
        assert_eq!(fold("abcdef g", 4), ["abcdef", "g"]);
        assert!(fold("", 4).is_empty());
    }
}
