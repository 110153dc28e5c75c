//! Kind `bars`: a figure by categories. The bars lie level, since names of any
//! length have room on their left and any number of bars below each other.

use serde_json::{Value, json};

use super::PictureError;
use super::axis::{Axis, Margin, Spacing, extent};
use super::colour::{INK, SERIES, series};
use super::group::{Different, Spread};
use super::label::Label;
use super::note::Chosen;
use super::reference::{add_limits, legend_of_lines, limit_sign, limits, with_limits};
use super::sheet::{Plot, WIDTH, brush, choice, fading, of_marks, of_some_marks};
use super::spec::Bars;
use hil_core::number;

/// Height of a bar \[px\].
const BAR: f64 = 19.0;
/// Room for the number behind the longest bar, as a share of the plot.
const ROOM: f64 = 74.0 / WIDTH;
/// More bars than this need another picture.
const MOST_BARS: usize = 400;

/// Categories, series and the values of their bars.
struct Data {
    categories: Different,
    /// One without a name if the picture names no column.
    series: Different,
    /// Category by category, one per series.
    bars: Vec<Option<Spread>>,
}

impl Data {
    fn of(bars: &Bars, chosen: &mut Chosen<'_>) -> Result<Self, PictureError> {
        let (table, rows, left_out) = (chosen.table, &chosen.rows, &mut chosen.left_out);
        let categories = Different::of(table.column(&bars.category)?, rows)?;
        let series = Different::series(bars.series.as_ref(), table, rows)?;
        let count = series.len();
        let all = categories.len() * count;
        if all > MOST_BARS {
            return Err(PictureError::new(format!(
                "{all} bars are more than a picture can show; kind \"histogram\" or \"lines\" can"
            )));
        }
        let values = table.column(&bars.y)?.numbers()?;
        let log = bars.y_axis.spacing == Spacing::Log;
        let mut of_bar: Vec<Vec<(usize, f64)>> = vec![Vec::new(); all];
        for &row in rows.iter() {
            left_out.of += 1;
            match (categories.of_row[row], series.of_row[row], values[row]) {
                (Some(_), Some(_), Some(value)) if log && value <= 0.0 => left_out.not_above_0 += 1,
                (Some(category), Some(within), Some(value)) => {
                    of_bar[category * count + within].push((row, value));
                }
                _ => left_out.missing += 1,
            }
        }
        left_out.shared = of_bar.iter().map(Vec::len).max().unwrap_or(0);
        Ok(Self {
            categories,
            series,
            bars: of_bar.into_iter().map(Spread::of).collect(),
        })
    }

    fn spreads(&self) -> impl Iterator<Item = &Spread> {
        self.bars.iter().flatten()
    }
}

pub(super) fn plot(bars: &Bars, chosen: &mut Chosen<'_>) -> Result<Plot, PictureError> {
    let data = Data::of(bars, chosen)?;
    let label = Label::of(&bars.y);
    let log = bars.y_axis.spacing == Spacing::Log;
    let span = extent(data.spreads().flat_map(|bar| [bar.low, bar.high]));
    let limits = limits(bars.limit.as_ref(), span, log);
    let span = with_limits(span, &limits, log).map(|span| with_room(span, log));
    let axis = Axis::new(&bars.y_axis, &label, span, Margin::None)?;
    let is_beyond = |bar: &&Spread| !(axis.holds(bar.low) && axis.holds(bar.high));
    let beyond = data.spreads().filter(is_beyond);
    chosen.left_out.beyond = beyond.map(|bar| bar.rows.len()).sum();
    chosen.tell_left_out("Bars and numbers: medians, lines: smallest to largest");
    let logarithmic = "The axis is logarithmic: compare where bars end, not how long they are.";
    chosen.notes.extend(log.then(|| logarithmic.to_owned()));
    let mut plot = Plot::new(60.0);
    if !data.bars.is_empty() {
        plot.height =
            json!({"step": BAR, "for": if bars.series.is_some() { "offset" } else { "position" }});
    }
    plot.marks = marks(bars, &data, &axis);
    add_layers(&mut plot, bars, &data, &axis);
    add_limits(&mut plot, &limits, &axis, "x");
    let sign = bars.limit.as_ref().map(|limit| limit_sign(limit, &label));
    plot.layers.extend(legend_of_lines(sign.as_slice()));
    Ok(plot)
}

/// The span from 0 on (a logarithmic one from below the smallest bar), with
/// room for numbers behind the bars.
fn with_room((low, high): (f64, f64), log: bool) -> (f64, f64) {
    if log {
        let grown = libm::pow(high / low, ROOM / (1.0 - ROOM));
        return (low / 2.0, high * grown.max(1.2));
    }
    let (low, high) = (low.min(0.0), high.max(0.0));
    let more = ROOM / (1.0 - 2.0 * ROOM) * (high - low);
    let below = if low < 0.0 { more } else { 0.0 };
    let above = if high > 0.0 { more } else { 0.0 };
    (low - below, high + above)
}

/// The bars, each with its number in words; one without a run has a dash.
fn marks(bars: &Bars, data: &Data, axis: &Axis) -> Vec<Value> {
    // On a logarithmic axis its lower end.
    let start = 0.0_f64.clamp(axis.ends.0, axis.ends.1);
    let count = data.series.len();
    let mark = |(at, bar): (usize, &Option<Spread>)| {
        let category = &data.categories.names[at / count];
        let mut mark = json!({"category": category, "from": start});
        if bars.series.is_some() {
            mark["name"] = json!(data.series.names[at % count]);
        }
        let Some(bar) = bar else {
            (mark["x"], mark["end"], mark["words"]) =
                (json!(start), json!(start), json!(number::MISSING));
            return mark;
        };
        let [median, low, high] = [bar.median, bar.low, bar.high].map(|value| axis.shown(value));
        let is_left = median < 0.0;
        // A bar beyond a given end has its number there.
        let end = if is_left { low } else { high };
        mark["rows"] = json!(bar.rows);
        (mark["x"], mark["low"], mark["high"]) = (json!(median), json!(low), json!(high));
        mark["end"] = json!(end.clamp(axis.ends.0, axis.ends.1));
        mark["words"] = json!(number::rounded(median, 3));
        mark["left"] = json!(is_left || end > axis.ends.1);
        mark
    };
    data.bars.iter().enumerate().map(mark).collect()
}

/// Bars, spreads and numbers.
fn add_layers(plot: &mut Plot, bars: &Bars, data: &Data, axis: &Axis) {
    let heading = bars.category_label.clone();
    let heading = heading.unwrap_or_else(|| Label::of(&bars.category).words);
    let channels = |x: &str| {
        let mut encoding = json!({
            "x": axis.channel(x),
            "y": {"field": "category", "type": "nominal", "title": heading, "sort": null,
                  "scale": {"domain": data.categories.names, "paddingInner": 0.25, "paddingOuter": 0.15},
                  "axis": {"grid": false, "titleAngle": 0, "titleAlign": "left", "titleAnchor": "start", "titleBaseline": "bottom",
                           "titleX": -180, "titleY": -8, "titleFontWeight": "bold", "titleFontSize": 12}},
        });
        if bars.series.is_some() {
            encoding["yOffset"] = json!({"field": "name", "scale": {"domain": data.series.names}});
        }
        encoding
    };
    let mut encoding = channels("x");
    encoding["x2"] = json!({"field": "from"});
    encoding["x"]["stack"] = Value::Null;
    let mut mark = json!({"type": "bar", "clip": true});
    if let Some(column) = &bars.series {
        let [colours, _] = series(data.series.len(), data.series.numbers.is_some());
        encoding["color"] = json!({
            "field": "name", "type": "nominal", "title": format!("{}:", Label::of(column).words),
            "scale": {"domain": data.series.names, "range": colours}, "legend": {"symbolType": "square", "columns": 6},
        });
        encoding["opacity"] = fading(1.0);
    } else {
        mark["color"] = json!(SERIES[0]);
    }
    encoding["tooltip"] = json!([
        {"field": "rows", "title": "row"}, {"field": "category", "title": heading}, {"field": "name"},
        {"field": "x", "title": axis.title},
    ]);
    let mut layer = of_marks(mark, encoding);
    brush(&mut layer, 0, &["y"]);
    if bars.series.is_some() {
        choice(&mut layer);
    }
    plot.layers.push(layer);
    if data.spreads().any(|bar| bar.high > bar.low) {
        for (colour, width) in [("white", 3.4), (INK, 1.4)] {
            let mut encoding = channels("low");
            encoding["x2"] = json!({"field": "high"});
            let mark = json!({"type": "rule", "clip": true, "color": colour, "strokeWidth": width});
            plot.layers
                .push(of_some_marks("datum.high > datum.low", mark, encoding));
        }
    }
    for (only, align, dx) in [("!datum.left", "left", 5), ("datum.left", "right", -5)] {
        let mut encoding = channels("end");
        encoding["text"] = json!({"field": "words"});
        let mark =
            json!({"type": "text", "align": align, "dx": dx, "fontSize": 11.5, "color": INK});
        plot.layers.push(of_some_marks(only, mark, encoding));
    }
}
