//! References in a picture beside its data: the limit of a figure, and the place
//! of the study's base, a line across plots over one of its keys and a diamond in
//! maps over two.

use serde_json::{Value, json};

use super::axis::{Axis, Span, extent};
use super::colour::{INK, LIMIT};
use super::group::in_words;
use super::label::{Label, capital};
use super::sheet::Plot;
use super::spec::Limit;
use super::table::Table;

/// A line that the legend explains.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sign {
    pub(super) words: String,
    pub(super) colour: &'static str,
    pub(super) dash: &'static [f64],
}

impl Sign {
    pub(super) fn new(words: String, colour: &'static str, dash: &'static [f64]) -> Self {
        Self {
            words,
            colour,
            dash,
        }
    }
}

/// Dashes of limits, and of the base's place.
const LIMIT_DASH: &[f64] = &[12.0, 4.0, 2.0, 4.0];
const BASE_DASH: &[f64] = &[1.5, 4.0];

/// Style, colour, dash and width of a line.
type Look = (&'static str, &'static str, &'static [f64], f64);
const OF_LIMIT: Look = ("limit", LIMIT, LIMIT_DASH, 1.8);
const OF_BASE: Look = ("base", INK, BASE_DASH, 1.4);

/// A layer without marks whose legend explains lines.
pub(super) fn legend_of_lines(signs: &[Sign]) -> Option<Value> {
    let of = |value: fn(&Sign) -> Value| signs.iter().map(value).collect::<Vec<Value>>();
    let words = of(|sign| json!(sign.words));
    let channel = |range: Vec<Value>| {
        json!({
            "field": "sign", "type": "nominal", "title": null,
            "scale": {"domain": words, "range": range},
            "legend": {"symbolType": "stroke", "symbolSize": 900, "columns": 3},
        })
    };
    (!signs.is_empty()).then(|| {
        json!({
            "data": {"values": []}, "mark": "rule",
            "encoding": {
                "stroke": channel(of(|sign| json!(sign.colour))),
                "strokeDash": channel(of(|sign| json!(if sign.dash.is_empty() { &[1.0, 0.0] } else { sign.dash }))),
            },
        })
    })
}

/// A limit holds for the magnitude: where data are below 0 it has two lines.
pub(super) fn limits(limit: Option<&Limit>, span: Option<Span>, log: bool) -> Vec<f64> {
    let Some(limit) = limit.filter(|limit| !log || limit.value > 0.0) else {
        return Vec::new();
    };
    let both_sides = !limit.at_least && span.is_some_and(|(low, _)| low < 0.0);
    match both_sides && limit.value > 0.0 {
        true => vec![limit.value, -limit.value],
        false => vec![limit.value],
    }
}

/// The span with the limits that are near it; one far off would press the data
/// into a line, and the legend tells it anyway.
pub(super) fn with_limits(span: Option<Span>, limits: &[f64], log: bool) -> Option<Span> {
    let near = |&limit: &f64| match span {
        None => true,
        Some((low, high)) if log => limit >= 0.01 * low && limit <= 100.0 * high,
        Some((low, high)) => limit.abs() <= 4.0 * low.abs().max(high.abs()),
    };
    let ends = span.into_iter().flat_map(|(low, high)| [low, high]);
    extent(limits.iter().copied().filter(near).chain(ends))
}

/// Adds lines at limits, across the axis of that channel.
pub(super) fn add_limits(plot: &mut Plot, limits: &[f64], axis: &Axis, channel: &str) {
    add_rules(plot, limits, axis, channel, OF_LIMIT);
}

/// Explanation of a limit of a column with that label.
pub(super) fn limit_sign(limit: &Limit, label: &Label) -> Sign {
    let words = format!("{}: {}", limit.label, in_words(limit.value, label));
    Sign::new(capital(&words), LIMIT, LIMIT_DASH)
}

fn add_rules(plot: &mut Plot, values: &[f64], axis: &Axis, channel: &str, look: Look) {
    let (name, colour, dash, width) = look;
    let inside = values.iter().filter(|value| axis.holds(**value));
    let data: Vec<Value> = inside
        .map(|value| json!({channel: axis.shown(*value)}))
        .collect();
    let mark = json!({"type": "rule", "style": name, "color": colour, "strokeDash": dash, "strokeWidth": width});
    plot.add(&data, mark, json!({channel: axis.channel(channel)}));
}

/// The base's value of a column, where the axis has a place for it.
fn own_value(table: &Table, column: &str, axis: &Axis) -> Option<f64> {
    let own = table.find(column)?.own?;
    (axis.names.is_none() && axis.holds(own)).then_some(own)
}

/// Adds a line at the base's value of `x`; its explanation, if it has one.
pub(super) fn add_base_line(plot: &mut Plot, table: &Table, x: &str, axis: &Axis) -> Option<Sign> {
    let own = own_value(table, x, axis)?;
    add_rules(plot, &[own], axis, "x", OF_BASE);
    let words = format!("the base, {}", in_words(own, &Label::of(x)));
    Some(Sign::new(words, INK, BASE_DASH))
}

/// The base's values of `x` and `y`, in the shown units, and the words for them.
pub(super) fn base_point(
    table: &Table,
    [x, y]: [&str; 2],
    axes: [&Axis; 2],
) -> Option<(Value, String)> {
    let (own_x, own_y) = (own_value(table, x, axes[0])?, own_value(table, y, axes[1])?);
    let words = |value: f64, column: &str| in_words(value, &Label::of(column));
    let words = format!("the base, {} and {}", words(own_x, x), words(own_y, y));
    let place = json!({"x": axes[0].shown(own_x), "y": axes[1].shown(own_y)});
    Some((place, words))
}
