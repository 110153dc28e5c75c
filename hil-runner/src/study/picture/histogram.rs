//! Kind `histogram`: how a figure is distributed over the runs, and the yield.

use serde_json::json;

use super::PictureError;
use super::axis::{Axis, Margin, Spacing, extent, measure, measured};
use super::colour::{FAIL, PASS};
use super::label::Label;
use super::note::{Chosen, counted};
use super::reference::{add_limits, legend_of_lines, limit_sign, limits, with_limits};
use super::sheet::{Plot, brush, choice, fading, of_marks};
use super::spec::Histogram;
use super::unit::{decade_below, power_of_ten};

/// Height of the plot \[px\].
const HEIGHT: f64 = 360.0;
/// Intervals that are still to be told apart.
const MOST_BINS: f64 = 80.0;

pub(super) fn plot(histogram: &Histogram, chosen: &mut Chosen<'_>) -> Result<Plot, PictureError> {
    let (rows, left_out) = (&chosen.rows, &mut chosen.left_out);
    let all = chosen.table.column(&histogram.x)?.numbers()?;
    let log = histogram.x_axis.spacing == Spacing::Log;
    let values = rows.iter().filter_map(|&row| Some((row, all[row]?)));
    let values: Vec<(usize, f64)> = values.collect();
    let made = rows.len();
    (left_out.of, left_out.missing) = (made, made - values.len());
    let mut shown = values.clone();
    shown.retain(|(_, value)| !log || *value > 0.0);
    shown.sort_by(|(_, a), (_, b)| a.total_cmp(b));
    left_out.not_above_0 = values.len() - shown.len();
    let label = Label::of(&histogram.x);
    let span = extent(shown.iter().map(|(_, value)| *value));
    let limit = histogram.limit.as_ref();
    let limits = limits(limit, span, log);
    let bins = bins(&shown, histogram, log);
    let ends = extent(bins.iter().flat_map(|bin| [bin.from, bin.to]));
    let span = with_limits(ends.or(span), &limits, log);
    let x = Axis::new(&histogram.x_axis, &label, span, Margin::Around)?;
    left_out.beyond = shown.iter().filter(|(_, value)| !x.holds(*value)).count();
    let kept = |(_, value): &&(usize, f64)| limit.is_none_or(|limit| limit.is_kept(*value));
    let within = values.iter().filter(kept).count();
    if limit.is_some() && made > 0 {
        let (share, runs) = (percent(within, made), counted(made, "run", "runs"));
        let words = format!("Yield {share}: {within} of {runs} keep the limit.");
        chosen.notes.insert(0, words);
    }
    chosen.tell_left_out("");
    let beyond = values.len() - within;
    let names = [format!("within: {within}"), format!("beyond: {beyond}")];
    let mut plot = Plot::new(HEIGHT);
    for bin in &bins {
        let mut from = 0;
        let named = bin.rows.iter().zip(&names);
        for (rows, name) in named.filter(|(rows, _)| !rows.is_empty()) {
            let to = from + rows.len();
            plot.marks.push(json!({
                "rows": rows, "name": name,
                "x": x.shown(bin.from), "x2": x.shown(bin.to), "y": from, "y2": to,
            }));
            from = to;
        }
    }
    let legend = limit.map(|_| json!({"symbolType": "square"}));
    let mut y =
        json!({"field": "y", "type": "quantitative", "title": "Runs", "axis": {"tickMinStep": 1}});
    if plot.marks.is_empty() {
        y["scale"] = json!({"domain": [0, 4]});
    }
    let encoding = json!({
        "x": x.channel("x"), "x2": {"field": "x2"}, "y": y, "y2": {"field": "y2"},
        "color": {"field": "name", "type": "nominal", "title": null, "legend": legend,
                  "scale": {"domain": names, "range": [PASS, FAIL]}},
        "opacity": fading(1.0),
        "tooltip": [{"field": "name"}, {"field": "x", "title": "from"}, {"field": "x2", "title": "to"}],
    });
    let mark = json!({"type": "rect", "clip": true, "stroke": "white", "strokeWidth": 0.8});
    let mut layer = of_marks(mark, encoding);
    brush(&mut layer, 0, &["x"]);
    choice(&mut layer);
    plot.layers.push(layer);
    add_limits(&mut plot, &limits, &x, "x");
    let sign = limit.map(|limit| limit_sign(limit, &label));
    plot.layers.extend(legend_of_lines(sign.as_slice()));
    Ok(plot)
}

/// One interval.
#[derive(Debug, Clone, PartialEq)]
struct Bin {
    from: f64,
    to: f64,
    /// Runs that keep the limit, or all if there is none; and runs that do not.
    rows: [Vec<usize>; 2],
}

/// Intervals of equal width (of equal ratio where the axis is logarithmic)
/// whose edges are round.
fn bins(sorted: &[(usize, f64)], histogram: &Histogram, log: bool) -> Vec<Bin> {
    let places = sorted.iter().map(|&(_, value)| measure(value, log));
    let places: Vec<f64> = places.collect();
    let (Some(&low), Some(&high)) = (places.first(), places.last()) else {
        return Vec::new();
    };
    let size = low.abs().max(high.abs());
    let span = high - low;
    // All equal: one interval about them.
    let (step, first) = if span <= 1e-12 * size {
        let step = if size > 0.0 { 0.1 * size } else { 0.1 };
        (step, low - 0.5 * step)
    } else {
        let step = round_step(wanted_step(&places, span, histogram.bins));
        (step, (low / step).floor() * step)
    };
    // What an edge stands for; multiples are formed anew, not summed.
    let edge = |count: f64| measured(first + count * step, log);
    let limit = histogram.limit.as_ref();
    let within = |value: f64| limit.is_none_or(|limit| limit.is_kept(value));
    let mut found: Vec<Bin> = Vec::new();
    for (&(row, value), &place) in sorted.iter().zip(&places) {
        let at = ((place - first) / step).floor().max(0.0);
        let from = edge(at);
        if found.last().is_none_or(|bin| bin.from < from) {
            found.push(Bin {
                from,
                to: edge(at + 1.0),
                rows: [Vec::new(), Vec::new()],
            });
        }
        if let Some(bin) = found.last_mut() {
            bin.rows[usize::from(!within(value))].push(row);
        }
    }
    found
}

/// Width after Freedman and Diaconis (1981), 2·IQR/∛n, within what can be
/// drawn; where the quartiles coincide, a share of the whole.
fn wanted_step(sorted: &[f64], span: f64, wanted: Option<usize>) -> f64 {
    if let Some(bins) = wanted {
        return span / bins as f64;
    }
    let count = sorted.len();
    let quartiles = sorted[(3 * (count - 1)) / 4] - sorted[(count - 1) / 4];
    let step = 2.0 * quartiles / libm::cbrt(count as f64);
    step.clamp(span / (0.5 * MOST_BINS), span / 5.0)
}

/// The nearest of 1, 2 and 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = power_of_ten(decade_below(step));
    let digit = match step / power {
        digit if digit < 1.5 => 1.0,
        digit if digit < 3.5 => 2.0,
        digit if digit < 7.5 => 5.0,
        _ => 10.0,
    };
    digit * power
}

/// A share in percent with as many digits as it takes not to say 0 or 100 of
/// what is neither.
fn percent(part: usize, whole: usize) -> String {
    let share = 100.0 * part as f64 / whole as f64;
    let text = (1..6).map(|digits| format!("{share:.digits$}"));
    let exact = part == 0 || part == whole;
    let mut honest = text.filter(|text| {
        let rounded: f64 = text.parse().unwrap_or(share);
        exact || (rounded > 0.0 && rounded < 100.0)
    });
    let text = honest.next().unwrap_or_else(|| share.to_string());
    format!("{}\u{a0}%", text.strip_suffix(".0").unwrap_or(&text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::picture::{AxisKeys, Limit};

    fn of(values: &[f64], limit: Option<f64>, log: bool) -> Vec<Bin> {
        let histogram = Histogram {
            x: "x".into(),
            x_axis: AxisKeys::default(),
            bins: Some(10),
            limit: limit.map(|value| Limit {
                value,
                at_least: false,
                label: String::new(),
                of_budget: false,
            }),
        };
        let mut values: Vec<(usize, f64)> = values.iter().copied().enumerate().collect();
        values.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        bins(&values, &histogram, log)
    }

    #[test]
    fn every_value_is_in_one_interval_that_holds_it() {
        let values: Vec<f64> = (0..500).map(|i| libm::sin(f64::from(i)) + 1.5).collect();
        for log in [false, true] {
            let bins = of(&values, Some(1.7), log);
            let sum: usize = bins.iter().flat_map(|bin| &bin.rows).map(Vec::len).sum();
            assert_eq!(sum, 500);
            for bin in &bins {
                let rounding = 1e-9 * bin.to;
                let inside = values
                    .iter()
                    .filter(|&&v| v >= bin.from - rounding && v < bin.to - rounding);
                let inside = inside.count();
                let counted = bin.rows[0].len() + bin.rows[1].len();
                assert!(inside.abs_diff(counted) <= 1, "{bin:?} {inside}");
            }
            let within: usize = bins.iter().map(|bin| bin.rows[0].len()).sum();
            assert_eq!(within, values.iter().filter(|&&v| v <= 1.7).count());
            assert!(within < 500, "the limit must part the values");
        }
    }

    #[test]
    fn one_value_has_one_interval() {
        for value in [0.0, 3.0, -7e5] {
            let bins = of(&[value, value], None, false);
            assert_eq!(bins.len(), 1);
            assert!(bins[0].from <= value && value <= bins[0].to);
        }
        assert!(of(&[], None, false).is_empty());
    }

    #[test]
    fn a_yield_is_not_rounded_to_all_or_nothing() {
        assert_eq!(percent(1000, 1000), "100\u{a0}%");
        assert_eq!(percent(0, 10), "0\u{a0}%");
        assert_eq!(percent(9_999, 10_000), "99.99\u{a0}%");
        assert_eq!(percent(1, 3), "33.3\u{a0}%");
        assert_eq!(percent(1, 2), "50\u{a0}%");
    }
}
