//! Kind `histogram`: how a figure is distributed over the runs, and the yield.

mod bins;

use super::axis::{Axis, AxisKeys, Direction, Margin, Spacing, extent, label_of};
use super::canvas::{Area, Canvas, Stroke};
use super::clip::clipped;
use super::colour::{FAIL, PASS, WHITE};
use super::frame::{Frame, room_below, room_left, room_right};
use super::group::in_words;
use super::label::{Label, capital};
use super::legend::{Entry, Group, Key};
use super::lines::{LIMIT_LINE, with_limits, with_sign};
use super::note::{Chosen, LeftOut};
use super::sheet::{EDGE, Sheet, WIDTH};
use super::spec::{Histogram, Limit, Picture};
use super::{PictureError, Table};
use bins::{Bin, bins};

/// Height of the plot \[px\].
const HEIGHT: f64 = 360.0;
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
    let mut shown: Vec<f64> = values
        .iter()
        .copied()
        .filter(|value| !log || *value > 0.0)
        .collect();
    shown.sort_by(f64::total_cmp);
    left_out.not_above_0 = values.len() - shown.len();
    let label = label_of(column, histogram.x_axis.label.as_ref());
    let span = extent(shown.iter().copied());
    let limits = match &histogram.limit {
        Some(limit) => with_sign(limit.value, span, log),
        None => Vec::new(),
    };
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
    let groups = match &histogram.limit {
        Some(limit) => legend(limit, &values, rows.len(), &label),
        None => Vec::new(),
    };
    notes.extend(left_out.notes(""));
    let sheet = Sheet::new(&spec.title, &groups, &notes);
    let frame = Frame {
        area: Area {
            left,
            top: sheet.top(),
            right,
            bottom: sheet.top() + HEIGHT,
        },
        x: &x,
        y: &y,
    };
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
        for x in limits.iter().filter_map(|&limit| frame.across(limit)) {
            let line = [(x, frame.area.top), (x, frame.area.bottom)];
            for part in clipped(&line, &frame.area) {
                canvas.path(&part, &LIMIT_LINE);
            }
        }
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
        range: (tallest < 4).then_some((0.0, 4.0)),
        ..AxisKeys::default()
    };
    Axis::new(&keys, &label, Some((0.0, tallest as f64)), Margin::FromZero)
}

/// What keeps the limit stands on the axis, what does not on top of it.
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
            let field = Area {
                left,
                top,
                right,
                bottom,
            };
            canvas.fill(&field, colour);
            canvas.outline(&field, &Stroke::solid(WHITE, 0.8));
        }
    }
}

/// The yield over all runs: one without a figure does not keep the limit.
fn legend(limit: &Limit, values: &[f64], runs: usize, label: &Label) -> Vec<Group> {
    let within = values.iter().filter(|value| value.abs() <= limit.value);
    let within = within.count();
    let beyond = values.len() - within;
    let missing = runs - values.len();
    let heading = if runs == 0 {
        String::new()
    } else {
        format!(
            "Yield {}: {within} of {runs} runs keep the limit",
            percent(within, runs)
        )
    };
    let mut entries = vec![
        Entry {
            key: Key::Line(LIMIT_LINE, None),
            words: capital(&format!(
                "{}: {}",
                limit.label,
                in_words(limit.value, label)
            )),
        },
        Entry {
            key: Key::Field(PASS),
            words: format!("within: {within}"),
        },
        Entry {
            key: Key::Field(FAIL),
            words: format!("beyond: {beyond}"),
        },
    ];
    if missing > 0 {
        entries.push(Entry {
            key: Key::Hatched(super::hatch::Hatch::Plain),
            words: format!("without a value, not in the plot: {missing}"),
        });
    }
    vec![
        Group {
            heading,
            entries: Vec::new(),
        },
        Group {
            heading: String::new(),
            entries,
        },
    ]
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
    use super::percent;

    #[test]
    fn a_yield_is_not_rounded_to_all_or_nothing() {
        assert_eq!(percent(1000, 1000), "100\u{a0}%");
        assert_eq!(percent(0, 10), "0\u{a0}%");
        assert_eq!(percent(9_999, 10_000), "99.99\u{a0}%");
        assert_eq!(percent(1, 3), "33.3\u{a0}%");
        assert_eq!(percent(1, 2), "50\u{a0}%");
    }
}
