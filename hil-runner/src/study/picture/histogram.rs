//! Kind `histogram`: how a figure is distributed over the runs, and the yield.

use super::axis::{Axis, AxisKeys, Direction, Margin, Spacing, extent};
use super::canvas::{Area, Canvas, Stroke};
use super::colour::{FAIL, PASS, WHITE};
use super::frame::{Frame, room_below, room_left, room_right};
use super::label::Label;
use super::legend::{Entry, Group, Key};
use super::mark::Hatch;
use super::note::{Chosen, LeftOut};
use super::reference::{draw_limits, limit_entry, limits, with_limits};
use super::sheet::{EDGE, Sheet, WIDTH};
use super::spec::{Histogram, Limit, Picture};
use super::unit::{decade_below, power_of_ten};
use super::{PictureError, Table};

/// Height of the plot \[px\].
const HEIGHT: f64 = 360.0;
/// Intervals that are still to be told apart.
const MOST_BINS: f64 = 80.0;

pub(super) fn draw(
    spec: &Picture,
    histogram: &Histogram,
    table: &Table,
) -> Result<String, PictureError> {
    let Chosen { rows, mut notes } = Chosen::of(spec, table)?;
    let column = table.column(&histogram.x)?;
    let all = column.numbers()?;
    let log = histogram.x_axis.spacing == Spacing::Log;
    let values: Vec<f64> = rows.iter().filter_map(|&row| all[row]).collect();
    let mut left_out = LeftOut {
        of: rows.len(),
        missing: rows.len() - values.len(),
        ..LeftOut::default()
    };
    let mut shown = values.clone();
    shown.retain(|value| !log || *value > 0.0);
    shown.sort_by(f64::total_cmp);
    left_out.not_above_0 = values.len() - shown.len();
    let label = Label::of(&histogram.x);
    let span = extent(shown.iter().copied());
    let limits = limits(histogram.limit.as_ref(), span, log);
    let bins = bins(&shown, histogram, log);
    let ends = extent(bins.iter().flat_map(|bin| [bin.from, bin.to]));
    let span = with_limits(ends.or(span), &limits, log);
    let mut x = Axis::new(&histogram.x_axis, &label, span, Margin::Around)?;
    left_out.beyond = shown.iter().filter(|&&value| !x.holds(value)).count();
    let tallest = bins.iter().map(|bin| bin.within + bin.beyond).max();
    let mut y = count_axis(tallest.unwrap_or(0))?;
    y.fit(HEIGHT, Direction::Up);
    let left = EDGE + room_left(&y, HEIGHT);
    x.fit(WIDTH - EDGE - left - 22.0, Direction::Across);
    let right = WIDTH - room_right(&x);
    let limit = histogram.limit.as_ref();
    let groups = limit.map(|limit| legend(limit, &values, rows.len(), &label));
    let groups = groups.unwrap_or_default();
    notes.extend(left_out.notes(""));
    let sheet = Sheet::new(&spec.title, &groups, &notes);
    let up = [sheet.top(), sheet.top() + HEIGHT];
    let frame = Frame::of([left, right], up, [&x, &y]);
    let bottom = frame.area.bottom + room_below(&x, right - left);
    sheet.draw(bottom, &spec.words(), |canvas: &mut Canvas| {
        frame.draw_grid(canvas);
        for bin in &bins {
            draw_bin(canvas, &frame, bin);
        }
        frame.draw_axes(canvas, true);
        if bins.is_empty() {
            return frame.draw_nothing(canvas);
        }
        draw_limits(canvas, &frame, &limits, Direction::Across);
    })
}

/// The axis of counts.
fn count_axis(tallest: usize) -> Result<Axis, PictureError> {
    let label = Label {
        words: "Runs".to_owned(),
        unit: String::new(),
    };
    let keys = AxisKeys {
        // A count below 4 needs no tenths between its numbers.
        range: (tallest < 4).then_some([0.0, 4.0]),
        ..AxisKeys::default()
    };
    Axis::new(&keys, &label, Some((0.0, tallest as f64)), Margin::FromZero)
}

/// Draws the runs that keep the limit from the axis up, the others on top.
fn draw_bin(canvas: &mut Canvas, frame: &Frame, bin: &Bin) {
    let area = &frame.area;
    let inside = |x: f64| x.clamp(area.left, area.right);
    let (Some(left), Some(right)) = (frame.across(bin.from), frame.across(bin.to)) else {
        return;
    };
    let (left, right) = (inside(left), inside(right));
    if right <= left {
        return;
    }
    let mut counted = 0;
    for (count, colour) in [(bin.within, PASS), (bin.beyond, FAIL)] {
        let (from, to) = (counted, counted + count);
        counted = to;
        let (Some(bottom), Some(top)) = (frame.up(from as f64), frame.up(to as f64)) else {
            continue;
        };
        if count > 0 {
            let field = Area::of([left, right], [top, bottom]);
            canvas.fill(&field, colour);
            canvas.outline(&field, &Stroke::solid(WHITE, 0.8));
        }
    }
}

/// The yield over all runs: one without a figure does not keep the limit.
fn legend(limit: &Limit, values: &[f64], runs: usize, label: &Label) -> Vec<Group> {
    let within = values.iter().filter(|value| limit.is_kept(**value));
    let within = within.count();
    let beyond = values.len() - within;
    let missing = runs - values.len();
    let mut heading = String::new();
    if runs > 0 {
        let share = percent(within, runs);
        heading = format!("Yield {share}: {within} of {runs} runs keep the limit");
    }
    let mut entries = vec![
        limit_entry(limit, label),
        Entry::new(Key::Field(PASS), format!("within: {within}")),
        Entry::new(Key::Field(FAIL), format!("beyond: {beyond}")),
    ];
    if missing > 0 {
        let words = format!("without a value, not in the plot: {missing}");
        entries.push(Entry::new(Key::Hatched(Hatch::Plain), words));
    }
    let yielded = Group {
        heading,
        entries: Vec::new(),
    };
    vec![yielded, Group::of(entries)]
}

/// One interval.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bin {
    from: f64,
    to: f64,
    /// Runs that keep the limit, or all if there is none.
    within: usize,
    /// Runs that do not.
    beyond: usize,
}

/// Intervals of equal width (of equal ratio where the axis is logarithmic)
/// whose edges are round.
fn bins(sorted: &[f64], histogram: &Histogram, log: bool) -> Vec<Bin> {
    let measure = |value: f64| if log { libm::log10(value) } else { value };
    let places: Vec<f64> = sorted.iter().map(|&value| measure(value)).collect();
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
    let edge = |count: f64| {
        let place = first + count * step;
        if log { libm::pow(10.0, place) } else { place }
    };
    let within = |value: f64| {
        let limit = histogram.limit.as_ref();
        limit.is_none_or(|limit| limit.is_kept(value))
    };
    let mut found: Vec<Bin> = Vec::new();
    for (&value, &place) in sorted.iter().zip(&places) {
        let at = ((place - first) / step).floor().max(0.0);
        let from = edge(at);
        if found.last().is_none_or(|bin| bin.from < from) {
            found.push(Bin {
                from,
                to: edge(at + 1.0),
                within: 0,
                beyond: 0,
            });
        }
        if let Some(bin) = found.last_mut() {
            let within = within(value);
            bin.within += usize::from(within);
            bin.beyond += usize::from(!within);
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
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        bins(&values, &histogram, log)
    }

    #[test]
    fn every_value_is_in_one_interval_that_holds_it() {
        let values: Vec<f64> = (0..500).map(|i| libm::sin(f64::from(i)) + 1.5).collect();
        for log in [false, true] {
            let bins = of(&values, Some(1.7), log);
            let sum: usize = bins.iter().map(|bin| bin.within + bin.beyond).sum();
            assert_eq!(sum, 500);
            for bin in &bins {
                let rounding = 1e-9 * bin.to;
                let inside = values
                    .iter()
                    .filter(|&&v| v >= bin.from - rounding && v < bin.to - rounding);
                let inside = inside.count();
                assert!(
                    inside.abs_diff(bin.within + bin.beyond) <= 1,
                    "{bin:?} {inside}"
                );
            }
            let within: usize = bins.iter().map(|bin| bin.within).sum();
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
