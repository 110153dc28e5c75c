//! References in a picture beside its data: the limit of a figure, and the place
//! of the study's base, a line across plots over one of its keys and a diamond in
//! maps over two.

use super::axis::{Axis, Direction, extent};
use super::canvas::{Canvas, Point, Stroke};
use super::clip::clipped;
use super::colour::{INK, LIMIT, WHITE};
use super::frame::Frame;
use super::group::in_words;
use super::label::{Label, capital};
use super::legend::{Entry, Key};
use super::mark::{Mark, Shape};
use super::spec::Limit;
use super::table::Table;

/// The line of a limit.
pub(super) const LIMIT_LINE: Stroke = Stroke::dashed(LIMIT, 1.6, &[16.0, 4.0, 2.0, 4.0]);

/// A limit holds for the magnitude: where data are below 0 it has two lines.
pub(super) fn limits(limit: Option<&Limit>, span: Option<(f64, f64)>, log: bool) -> Vec<f64> {
    let mut limits = Vec::new();
    if let Some(&Limit {
        value, at_least, ..
    }) = limit
    {
        limits.extend((!log || value > 0.0).then_some(value));
        let both_sides = !at_least && span.is_some_and(|(low, _)| low < 0.0) && value > 0.0;
        limits.extend(both_sides.then_some(-value));
    }
    limits
}

/// The span with the limits that are near it; one far off would press the data
/// into a line, and the legend tells it anyway.
pub(super) fn with_limits(
    span: Option<(f64, f64)>,
    limits: &[f64],
    log: bool,
) -> Option<(f64, f64)> {
    let Some((low, high)) = span else {
        return extent(limits.iter().copied());
    };
    let near = |limit: f64| match log {
        true => limit >= 0.01 * low && limit <= 100.0 * high,
        false => limit.abs() <= 4.0 * low.abs().max(high.abs()),
    };
    let limits = limits.iter().copied().filter(|&limit| near(limit));
    extent(limits.chain([low, high]))
}

/// Draws limits across a plot, of values that run in a direction.
pub(super) fn draw_limits(
    canvas: &mut Canvas,
    frame: &Frame,
    limits: &[f64],
    direction: Direction,
) {
    let area = &frame.area;
    for &limit in limits {
        let line = match direction {
            Direction::Across => frame
                .across(limit)
                .map(|x| [(x, area.top), (x, area.bottom)]),
            Direction::Up => frame.up(limit).map(|y| [(area.left, y), (area.right, y)]),
        };
        for part in line.iter().flat_map(|line| clipped(line, area)) {
            canvas.path(&part, &LIMIT_LINE);
        }
    }
}

/// Entry of the legend for a limit of a column with that label.
pub(super) fn limit_entry(limit: &Limit, label: &Label) -> Entry {
    let words = format!("{}: {}", limit.label, in_words(limit.value, label));
    Entry::new(Key::Line(LIMIT_LINE, None), capital(&words))
}

/// Line at the base's own value.
const BASE_LINE: Stroke = Stroke::dashed(INK, 1.2, &[1.5, 4.0]);
const DIAMOND: Mark = Mark {
    shape: Shape::Diamond,
    colour: INK,
    hollow: true,
};
/// Radius of the diamond, and of the light edge around it \[px\].
const RADIUS: f64 = 7.0;
const EDGE: f64 = 9.0;

/// The base's value of a column, where the axis has a place for it.
fn value(table: &Table, column: &str, axis: &Axis) -> Option<f64> {
    let own = table.find(column)?.own?;
    (!axis.has_places() && axis.holds(own)).then_some(own)
}

/// The same in words.
fn words(table: &Table, column: &str, axis: &Axis) -> Option<String> {
    Some(in_words(value(table, column, axis)?, &Label::of(column)))
}

/// Entry of the legend for a line at the base's value of `x`.
pub(super) fn base_line_entry(table: &Table, x: &str, axis: &Axis) -> Option<Entry> {
    let words = format!("the base, {}", words(table, x, axis)?);
    Some(Entry::new(Key::Line(BASE_LINE, None), words))
}

/// Draws that line over the whole height of a plot.
pub(super) fn draw_base_line(canvas: &mut Canvas, frame: &Frame, table: &Table, x: &str) {
    let place = value(table, x, frame.x).and_then(|own| frame.across(own));
    if let Some(x) = place {
        canvas.path(&[(x, frame.area.top), (x, frame.area.bottom)], &BASE_LINE);
    }
}

/// Entry of the legend for a diamond at the base's values of `x` and `y`.
pub(super) fn diamond_entry(table: &Table, [x, y]: [&str; 2], axes: [&Axis; 2]) -> Option<Entry> {
    let (x, y) = (words(table, x, axes[0])?, words(table, y, axes[1])?);
    let words = format!("the base, {x} and {y}");
    Some(Entry::new(Key::Mark(DIAMOND), words))
}

/// Draws that diamond.
pub(super) fn draw_diamond(canvas: &mut Canvas, frame: &Frame, table: &Table, [x, y]: [&str; 2]) {
    let place =
        || -> Option<Point> { frame.point(value(table, x, frame.x)?, value(table, y, frame.y)?) };
    if let Some(at) = place() {
        let edge = Mark {
            colour: WHITE,
            ..DIAMOND
        };
        edge.draw(canvas, at, EDGE);
        DIAMOND.draw(canvas, at, RADIUS);
    }
}
