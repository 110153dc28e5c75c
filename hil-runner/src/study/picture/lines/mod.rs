//! Kind `lines`: curves over a parameter, simulated and of theory.

mod data;
mod looks;
mod plot;

pub(super) use looks::LIMIT_LINE;
pub(super) use plot::{draw_limits, with_limits, with_sign};

use super::axis::{Axis, Direction};
use super::canvas::{Area, Canvas};
use super::frame::{Frame, room_below, room_left, room_right};
use super::legend::Group;
use super::mark::shape;
use super::note::LeftOut;
use super::own;
use super::sheet::{EDGE, Sheet, WIDTH};
use super::spec::{Lines, Panel, Picture};
use super::{Curve, PictureError, Table};
use data::Data;
use looks::Looks;
use plot::Plot;

/// Height of one of so many plots \[px\].
fn height(count: usize) -> f64 {
    match count {
        1 => 400.0,
        2 => 270.0,
        _ => 210.0,
    }
}

/// Room between two plots \[px\].
const BETWEEN: f64 = 16.0;

pub(super) fn draw(
    spec: &Picture,
    lines: &Lines,
    table: &Table,
    curves: &[Curve],
) -> Result<String, PictureError> {
    let data = Data::of(spec, lines, table)?;
    let looks = Looks::of(lines, &data);
    let mut left_out = LeftOut::default();
    let mut x = data.x_axis(lines, &mut left_out)?;
    let mut plots = Vec::new();
    for panel in &lines.panels {
        let given = if plots.is_empty() { curves } else { &[] };
        plots.push(Plot::new(&data, panel, &x, &looks, given, &mut left_out)?);
    }
    let tall = height(plots.len());
    for plot in &mut plots {
        plot.y.fit(tall, Direction::Up);
    }
    let rooms = plots.iter().map(|plot| room_left(&plot.y, tall));
    let left = EDGE + rooms.fold(0.0, f64::max);
    x.fit(WIDTH - EDGE - left - 22.0, Direction::Across);
    let right = WIDTH - room_right(&x);
    let mut groups = looks.legend(lines, table, curves);
    groups.extend(own::line_entry(table, &lines.x, &x).map(Group::of));
    let mut notes = data.notes;
    notes.extend(left_out.notes("Lines: medians, bands: smallest to largest"));
    let sheet = Sheet::new(&spec.title, &groups, &notes);
    let area = |at: usize| {
        let top = sheet.top() + at as f64 * (tall + BETWEEN);
        Area {
            left,
            top,
            right,
            bottom: top + tall,
        }
    };
    let lowest = plots.len().saturating_sub(1);
    let bottom = area(lowest).bottom + room_below(&x, right - left);
    sheet.draw(bottom, &spec.words(), |canvas: &mut Canvas| {
        for (at, plot) in plots.iter().enumerate() {
            let frame = Frame {
                area: area(at),
                x: &x,
                y: &plot.y,
            };
            frame.draw_grid(canvas);
            frame.draw_axes(canvas, at == lowest);
            own::draw_line(canvas, &frame, table, &lines.x);
            plot.draw(canvas, &frame);
            if plot.is_empty() {
                frame.draw_nothing(canvas);
            }
        }
    })
}
