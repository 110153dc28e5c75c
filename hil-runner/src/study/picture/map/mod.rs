//! Kind `map`: a figure as colour over two parameters.

mod cells;
mod contour;
mod grid;
mod over;

pub(in crate::study) use contour::Field;

use super::axis::{Axis, AxisKeys, Direction, Margin, extent};
use super::canvas::{Area, Canvas};
use super::colour::INK;
use super::frame::{Frame, room_below, room_left};
use super::label::Label;
use super::legend::{Entry, Group, Key};
use super::mark::{Hatch, Mark, Shape};
use super::note::{Chosen, LeftOut, counted};
use super::reference::{diamond_entry, draw_diamond};
use super::sheet::{EDGE, Sheet, WIDTH};
use super::spec::{Map, Picture};
use super::{Curve, PictureError, Table};
use cells::{Painting, bar_room, draw_bar};
use grid::{Grid, Side};
use over::Overlay;

pub(super) use over::parts;

/// Height of the plot \[px\].
const HEIGHT: f64 = 440.0;
/// The same for a single row of cells \[px\].
const HEIGHT_OF_ROW: f64 = 200.0;

/// Least width of a plot \[px\].
const LEAST_WIDTH_PX: f64 = 150.0;

pub(super) fn draw(
    spec: &Picture,
    map: &Map,
    table: &Table,
    curves: &[Curve],
) -> Result<String, PictureError> {
    let Chosen { rows, mut notes } = Chosen::of(spec, table)?;
    let mut left_out = LeftOut::default();
    let grid = Grid::of(map, table, &rows, &mut left_out)?;
    let mut x = side_axis(&map.x, &map.x_axis, &grid.x)?;
    let mut y = side_axis(&map.y, &map.y_axis, &grid.y)?;
    let values = || grid.cells.iter().filter_map(|cell| cell.z);
    let label = Label::of(&map.z);
    let mut z = Axis::new(&map.z_axis, &label, extent(values()), Margin::None)?;
    let beyond = values().filter(|&value| !z.holds(value)).count();
    let tall = match grid.y.values.len() {
        1 => HEIGHT_OF_ROW,
        _ => HEIGHT,
    };
    z.fit(tall, Direction::Up);
    y.fit_values(&grid.y.values, tall, Direction::Up);
    let left = EDGE + room_left(&y, tall);
    let right = WIDTH - EDGE - bar_room(&z, tall);
    x.fit_values(&grid.x.values, right - left, Direction::Across);
    // Nothing of the overlay depends on how far down the plot begins.
    let at = |top: f64| Area::of([left, right], [top, top + tall]);
    if right - left < LEAST_WIDTH_PX {
        let sentence = "the words beside the plot leave no room for it";
        return Err(PictureError::new(sentence));
    }
    let frame = |area: Area| Frame { area, x: &x, y: &y };
    let draft = Overlay::new(map, &grid, &frame(at(0.0)), curves);
    let states = grid.states();
    let sides = [map.x.as_str(), map.y.as_str()];
    let base = diamond_entry(table, sides, [&x, &y]);
    let groups = [
        Group::of(legend(map, &grid, &states, &draft)),
        Group::of(base.into_iter().collect()),
    ];
    notes.extend(left_out.notes("Cells show medians"));
    notes.extend(empty_cells(&grid));
    notes.extend((beyond > 0).then(|| {
        let cells = counted(beyond, "cell", "cells");
        format!("Beyond the ends of the colour scale, shown as its ends: {cells}.")
    }));
    notes.extend(cells::note(&grid, &at(0.0)));
    notes.extend(draft.notes());
    let sheet = Sheet::new(&spec.title, &groups, &notes);
    let frame = frame(at(sheet.top()));
    let overlay = Overlay::new(map, &grid, &frame, curves);
    let bottom = frame.area.bottom + room_below(&x, right - left);
    sheet.draw(bottom, &spec.words(), |canvas: &mut Canvas| {
        let painting = Painting {
            frame: &frame,
            grid: &grid,
            z: &z,
            colours: map.colours,
            states: &states,
        };
        painting.draw(canvas);
        overlay.draw(canvas, &frame.area);
        draw_diamond(canvas, &frame, table, sides);
        frame.draw_axes(canvas, true);
        draw_bar(canvas, &frame.area, &z, map.colours);
        if grid.cells.iter().all(|cell| cell.runs == 0) {
            frame.draw_nothing(canvas);
        }
    })
}

/// The axis of one side of the grid, from edge to edge of its cells.
fn side_axis(column: &str, keys: &AxisKeys, side: &Side) -> Result<Axis, PictureError> {
    let label = Label::of(column);
    match &side.names {
        Some(names) => Ok(Axis::of_places(keys.words(&label), names)),
        None => Axis::new(keys, &label, side.span(), Margin::None),
    }
}

fn legend(map: &Map, grid: &Grid, states: &[&str], overlay: &Overlay) -> Vec<Entry> {
    let mut entries = Vec::new();
    if grid.cells.iter().any(|cell| cell.fails) {
        let mark = Mark::filled(Shape::Cross, INK);
        entries.push(Entry::new(Key::Mark(mark), "a limit is not kept"));
    }
    let of_state = |(at, state): (usize, &&str)| Entry::new(Key::Hatched(Hatch::of(at)), *state);
    entries.extend(states.iter().enumerate().map(of_state));
    entries.extend(overlay.legend(map.colours.at(0.45)));
    entries
}

/// Cells without a run are white: who reads that must know.
fn empty_cells(grid: &Grid) -> Option<String> {
    let empty = grid.cells.iter().filter(|cell| cell.runs == 0).count();
    (empty > 0).then(|| {
        let cells = counted(grid.cells.len(), "cell", "cells");
        format!("White: no run ({empty} of {cells}).")
    })
}
