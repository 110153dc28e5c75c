//! The base's own place in a picture of its study: a line across plots over one
//! of its keys, a diamond in maps over two.

use super::axis::Axis;
use super::canvas::{Canvas, Point, Stroke};
use super::colour::{INK, WHITE};
use super::frame::Frame;
use super::group::in_words;
use super::label::Label;
use super::legend::{Entry, Key};
use super::mark::{Mark, Shape};
use super::table::Table;

/// Line at the base's own value.
const LINE: Stroke = Stroke {
    colour: INK,
    width_px: 1.2,
    dash: &[1.5, 4.0],
};
const DIAMOND: Mark = Mark {
    shape: Shape::Diamond,
    colour: INK,
    hollow: true,
};
/// Radius of the diamond, and of the light edge around it \[px\].
const RADIUS: f64 = 7.0;
const EDGE: f64 = 9.0;

/// What the base has for a column, where the axis has a place for it.
fn value(table: &Table, column: &str, axis: &Axis) -> Option<f64> {
    let own = table.find(column)?.own?;
    (!axis.has_places() && axis.holds(own)).then_some(own)
}

fn words(table: &Table, column: &str) -> Option<String> {
    Some(in_words(table.find(column)?.own?, &Label::of(column)))
}

/// Entry of the legend for a line at the base's value of `x`.
pub(super) fn line_entry(table: &Table, x: &str, axis: &Axis) -> Option<Entry> {
    value(table, x, axis)?;
    Some(Entry {
        key: Key::Line(LINE, None),
        words: format!("the base, {}", words(table, x)?),
    })
}

/// Draws that line over the whole height of a plot.
pub(super) fn draw_line(canvas: &mut Canvas, frame: &Frame, table: &Table, x: &str) {
    let place = value(table, x, frame.x).and_then(|own| frame.across(own));
    if let Some(x) = place {
        canvas.path(&[(x, frame.area.top), (x, frame.area.bottom)], &LINE);
    }
}

/// Entry of the legend for a diamond at the base's values of `x` and `y`.
pub(super) fn diamond_entry(table: &Table, [x, y]: [&str; 2], axes: [&Axis; 2]) -> Option<Entry> {
    value(table, x, axes[0])?;
    value(table, y, axes[1])?;
    let (x, y) = (words(table, x)?, words(table, y)?);
    Some(Entry {
        key: Key::Mark(DIAMOND),
        words: format!("the base, {x} and {y}"),
    })
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
