//! Kind `map`: a figure as colour over two parameters.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::axis::{Axis, AxisKeys, Margin, Spacing, extent, measure, measured};
use super::colour::{INK, MUTED, NO_VALUE, SERIES};
use super::contour::Field;
use super::grid::{Grid, Side};
use super::group::in_words;
use super::label::Label;
use super::note::{Chosen, counted};
use super::reference::{Sign, base_point, legend_of_lines};
use super::sheet::{Plot, WIDTH, brush, of_marks};
use super::spec::Map;
use super::{Curve, PictureError};

/// Height of the plot, and of one of a single row of cells \[px\].
const HEIGHT: f64 = 440.0;
const HEIGHT_OF_ROW: f64 = 200.0;
/// Crosses closer than this run into each other \[px\].
const CROSS_ROOM: f64 = 11.0;
/// A cross, as a filled path.
pub(super) const CROSS: &str =
    "M-1,-.6L-.6,-1L0,-.4L.6,-1L1,-.6L.4,0L1,.6L.6,1L0,.4L-.6,1L-1,.6L-.4,0Z";
/// Colours and dashes of the caller's curves.
const CURVES: [(&str, &[f64]); 3] = [
    (SERIES[1], &[]),
    (SERIES[3], &[9.0, 5.0]),
    (SERIES[6], &[2.5, 3.5]),
];
/// Share of viridis and cividis above which black stands out more than white.
const LIGHT: f64 = 0.52;

pub(super) fn plot(
    map: &Map,
    curves: &[Curve],
    chosen: &mut Chosen<'_>,
) -> Result<Plot, PictureError> {
    let grid = Grid::of(map, chosen)?;
    let x = side_axis(&map.x, &map.x_axis, &grid.x)?;
    let y = side_axis(&map.y, &map.y_axis, &grid.y)?;
    let values = || grid.cells.iter().filter_map(|cell| cell.z);
    let label = Label::of(&map.z);
    let z = Axis::new(&map.z_axis, &label, extent(values()), Margin::None)?;
    chosen.tell_left_out("Cells show medians");
    let notes = &mut chosen.notes;
    notes.extend(empty_cells(&grid));
    let beyond = values().filter(|&value| !z.holds(value)).count();
    notes.extend((beyond > 0).then(|| {
        let cells = counted(beyond, "cell", "cells");
        format!("Beyond the ends of the colour scale, shown as its ends: {cells}.")
    }));
    let tall = match grid.y.values.len() {
        1 => HEIGHT_OF_ROW,
        _ => HEIGHT,
    };
    let mut drawing = Drawing {
        plot: Plot::new(tall),
        grid: &grid,
        x: &x,
        y: &y,
    };
    drawing.add_cells(map, &z);
    drawing.add_states();
    notes.extend(drawing.add_fails(&z, tall));
    let mut signs = Vec::new();
    for &level in &map.contours {
        let words = in_words(level, &Label::of(map.contour_column()));
        let lines = drawing.contour(map, level);
        if lines.is_empty() {
            notes.push(unseen(&grid, level, &words));
        }
        drawing.add_lines(&lines, (INK, &[]));
        drawing.add_words(&lines, &words);
    }
    if !map.contours.is_empty() {
        let words = format!("contours: {}", Label::of(map.contour_column()).words);
        signs.push(Sign::new(words, INK, &[]));
    }
    for (at, curve) in curves.iter().enumerate() {
        let (colour, dash) = CURVES[at % CURVES.len()];
        if drawing.add_lines(std::slice::from_ref(&curve.points), (colour, dash)) {
            signs.push(Sign::new(curve.label.clone(), colour, dash));
        } else {
            notes.push(format!("\"{}\" does not cross this plot.", curve.label));
        }
    }
    let mut marks = Vec::new();
    if grid.cells.iter().any(|cell| cell.fails) {
        let words = "a limit is not kept".to_owned();
        marks.push((words, "M-.6,-.6L.6,.6M-.6,.6L.6,-.6"));
    }
    if let Some((place, words)) = base_point(chosen.table, [&map.x, &map.y], [&x, &y]) {
        for (size, colour, width) in [(190.0, "white", 4.5), (190.0, INK, 1.8)] {
            let mark = json!({"type": "point", "shape": "diamond", "size": size, "color": colour, "strokeWidth": width, "opacity": 1});
            drawing.add_at(&place, mark);
        }
        marks.push((words, "diamond"));
    }
    let mut plot = drawing.plot;
    plot.layers.extend(legend_of_marks(&marks));
    plot.layers.extend(legend_of_lines(&signs));
    Ok(plot)
}

/// The axis of one side of the grid, from edge to edge of its cells.
fn side_axis(column: &str, keys: &AxisKeys, side: &Side) -> Result<Axis, PictureError> {
    let label = Label::of(column);
    Ok(match &side.names {
        Some(names) => Axis::of_places(keys.words(&label), names.clone()),
        None => Axis::new(keys, &label, side.span(), Margin::None)?.with_ticks(&side.values),
    })
}

/// Cells without a run are white: who reads that must know.
fn empty_cells(grid: &Grid) -> Option<String> {
    let empty = grid.cells.iter().filter(|cell| cell.runs.is_empty());
    let empty = empty.count();
    (empty > 0).then(|| {
        let cells = counted(grid.cells.len(), "cell", "cells");
        format!("White: no run ({empty} of {cells}).")
    })
}

/// A layer without marks whose legend explains signs.
fn legend_of_marks(marks: &[(String, &str)]) -> Option<Value> {
    let (words, shapes): (Vec<&String>, Vec<&str>) =
        marks.iter().map(|(words, shape)| (words, *shape)).unzip();
    (!marks.is_empty()).then(|| {
        json!({
            "data": {"values": []}, "mark": "point",
            "encoding": {"shape": {
                "field": "sign", "type": "nominal", "title": null,
                "scale": {"domain": words, "range": shapes},
                "legend": {"symbolStrokeColor": INK, "symbolOpacity": 1, "columns": 3},
            }},
        })
    })
}

/// A map on its way.
struct Drawing<'a> {
    plot: Plot,
    grid: &'a Grid,
    x: &'a Axis,
    y: &'a Axis,
}

impl Drawing<'_> {
    /// Ends of a cell, in the shown units.
    fn ends(&self, i: usize, j: usize) -> Value {
        let (x, y) = (&self.grid.x.edges, &self.grid.y.edges);
        json!({
            "x": self.x.shown(x[i]), "x2": self.x.shown(x[i + 1]),
            "y": self.y.shown(y[j]), "y2": self.y.shown(y[j + 1]),
        })
    }

    /// The channels of what has ends.
    fn channels(&self) -> Value {
        json!({"x": self.x.channel("x"), "x2": {"field": "x2"}, "y": self.y.channel("y"), "y2": {"field": "y2"}})
    }

    /// The cells that have a run, with their figure or their state.
    fn add_cells(&mut self, map: &Map, z: &Axis) {
        for (i, j) in self.grid.places() {
            let Some(cell) = self.grid.cell(i, j).filter(|cell| !cell.runs.is_empty()) else {
                continue;
            };
            let mut mark = self.ends(i, j);
            mark["rows"] = json!(cell.runs);
            mark["z"] = json!(cell.z.map(|value| z.shown(value)));
            if let Some(state) = &cell.state {
                mark["state"] = json!(state);
            }
            self.plot.marks.push(mark);
        }
        let (low, high) = z.ends;
        let kind = if z.log { "log" } else { "linear" };
        let scale = json!({"type": kind, "scheme": map.colours.name(), "domain": [low, high], "clamp": true, "nice": false});
        let mut legend = json!({"orient": "right", "titleOrient": "right", "titleFontWeight": "normal", "titleFontSize": 13, "gradientLength": self.plot.height});
        if z.log {
            legend["values"] = z.channel("z")["axis"]["values"].clone();
            legend["format"] = json!("~g");
        }
        let colour = |legend: Value| {
            json!({
                "condition": {"test": "!isValid(datum.z)", "value": NO_VALUE},
                "field": "z", "type": "quantitative", "title": z.title, "scale": scale, "legend": legend,
            })
        };
        let mut encoding = self.channels();
        encoding["fill"] = colour(legend);
        // Without an edge of its own colour white would shine between two cells.
        encoding["stroke"] = colour(Value::Null);
        encoding["tooltip"] = json!([
            {"field": "rows", "title": "row"}, {"field": "z", "title": z.title}, {"field": "state"},
        ]);
        let mark = json!({"type": "rect", "clip": true, "strokeWidth": 0.7});
        let mut layer = of_marks(mark, encoding);
        brush(&mut layer, 0, &["x", "y"]);
        self.plot.layers.push(layer);
    }

    /// Hatches over the cells without a figure, one for each state: diagonals.
    fn add_states(&mut self) {
        let cells = self.grid.cells.iter();
        let states: BTreeSet<&str> = cells.filter_map(|cell| cell.state.as_deref()).collect();
        let mut lines = Vec::new();
        for (i, j) in self.grid.places() {
            let state = self.grid.cell(i, j).and_then(|cell| cell.state.as_deref());
            let Some(at) = state.and_then(|state| states.iter().position(|known| *known == state))
            else {
                continue;
            };
            let rising = self.ends(i, j);
            let mut falling = rising.clone();
            (falling["y"], falling["y2"]) = (rising["y2"].clone(), rising["y"].clone());
            lines.extend((at % 4 != 1 && at % 4 != 3).then_some(rising));
            lines.extend((at % 4 == 1 || at % 4 == 2).then_some(falling));
        }
        let mark = json!({"type": "rule", "clip": true, "color": MUTED, "strokeWidth": 1});
        let encoding = self.channels();
        self.plot.add(&lines, mark, encoding);
        let hatches = ["M-1,1L1,-1", "M-1,-1L1,1", "M-1,1L1,-1M-1,-1L1,1", "square"];
        let words = states.iter().map(|state| (*state).to_owned());
        let signs: Vec<(String, &str)> = words.zip(hatches.into_iter().cycle()).collect();
        if let Some(mut legend) = legend_of_marks(&signs) {
            legend["encoding"]["shape"]["title"] = json!("without a figure:");
            legend["encoding"]["shape"]["legend"]["symbolFillColor"] = json!(NO_VALUE);
            let legend = json!({"layer": [legend], "resolve": {"scale": {"shape": "independent"}}});
            self.plot.layers.push(legend);
        }
    }

    /// A cross in the cells that fail; where cells are too small for that, in one of
    /// several, with a remark. A line runs along the edge of what fails.
    fn add_fails(&mut self, z: &Axis, tall: f64) -> Option<String> {
        let (across, up) = (self.grid.x.values.len(), self.grid.y.values.len());
        let fails = |i: usize, j: usize| self.grid.cell(i, j).is_some_and(|cell| cell.fails);
        let cell_px = [WIDTH / across.max(1) as f64, tall / up.max(1) as f64];
        let [every_x, every_y] =
            cell_px.map(|px| (CROSS_ROOM / px).ceil().clamp(1.0, 1e3) as usize);
        let (mut sides, mut crosses) = (Vec::new(), Vec::new());
        for (i, j) in self.grid.places() {
            let ends = self.ends(i, j);
            let side =
                |x, y| json!({"x": ends[x], "x2": ends["x2"], "y": ends[y], "y2": ends["y2"]});
            if i + 1 < across && fails(i, j) != fails(i + 1, j) {
                sides.push(side("x2", "y"));
            }
            if j + 1 < up && fails(i, j) != fails(i, j + 1) {
                sides.push(side("x", "y2"));
            }
            if fails(i, j) && i % every_x == 0 && j % every_y == 0 {
                let value = self.grid.cell(i, j).and_then(|cell| cell.z);
                let light = value.is_none_or(|value| z.share(value) > LIGHT);
                crosses.push(json!({
                    "x": self.x.shown(self.grid.x.values[i]), "y": self.y.shown(self.grid.y.values[j]),
                    "light": light,
                }));
            }
        }
        for (colour, width) in [("white", 2.6), (INK, 1.0)] {
            let mark = json!({"type": "rule", "clip": true, "color": colour, "strokeWidth": width, "strokeCap": "square"});
            let encoding = self.channels();
            self.plot.add(&sides, mark, encoding);
        }
        let radius = (0.22 * cell_px[0].min(cell_px[1])).clamp(2.6, 6.0);
        let mark = json!({"type": "point", "shape": CROSS, "filled": true, "opacity": 1, "size": 4.0 * radius * radius, "clip": true});
        let encoding = json!({
            "x": self.x.channel("x"), "y": self.y.channel("y"),
            "color": {"condition": {"test": "datum.light", "value": "black"}, "value": "white"},
        });
        self.plot.add(&crosses, mark, encoding);
        let thinned = every_x.max(every_y) > 1 && !crosses.is_empty();
        thinned.then(|| format!("One cross for {every_x} × {every_y} cells."))
    }

    /// Lines with a light edge; true if there is any of them in the plot.
    fn add_lines(&mut self, lines: &[Vec<(f64, f64)>], (colour, dash): (&str, &[f64])) -> bool {
        let drawn = |&(x, y): &(f64, f64)| {
            let above_0 = (!self.x.log || x > 0.0) && (!self.y.log || y > 0.0);
            above_0 && x.is_finite() && y.is_finite()
        };
        let mut data = Vec::new();
        let mut seen = false;
        let parts = lines.iter().flat_map(|line| line.split(|at| !drawn(at)));
        for (part, line) in parts.enumerate() {
            for (n, &(x, y)) in line.iter().enumerate() {
                seen |= self.x.holds(x) && self.y.holds(y);
                data.push(
                    json!({"x": self.x.shown(x), "y": self.y.shown(y), "part": part, "n": n}),
                );
            }
        }
        let encoding = json!({
            "x": self.x.channel("x"), "y": self.y.channel("y"),
            "detail": {"field": "part"}, "order": {"field": "n"},
        });
        for (colour, width, dash) in [("white", 5.2, &[][..]), (colour, 2.8, dash)] {
            let mut mark = json!({"type": "line", "clip": true, "color": colour, "strokeWidth": width, "opacity": 1});
            if !dash.is_empty() {
                mark["strokeDash"] = json!(dash);
            }
            if seen {
                self.plot.add(&data, mark, encoding.clone());
            }
        }
        seen
    }

    /// Words on the middle of the longest of some lines.
    fn add_words(&mut self, lines: &[Vec<(f64, f64)>], words: &str) {
        let longest = lines.iter().max_by_key(|line| line.len());
        let Some(&(x, y)) = longest.and_then(|line| line.get(line.len() / 2)) else {
            return;
        };
        let place = json!({"x": self.x.shown(x), "y": self.y.shown(y)});
        for mark in [
            json!({"type": "text", "text": words, "fontSize": 11, "stroke": "white", "strokeWidth": 4, "strokeJoin": "round"}),
            json!({"type": "text", "text": words, "fontSize": 11, "color": INK}),
        ] {
            self.add_at(&place, mark);
        }
    }

    /// Adds a mark at a place.
    fn add_at(&mut self, place: &Value, mark: Value) {
        let encoding = json!({"x": self.x.channel("x"), "y": self.y.channel("y")});
        self.plot.add(std::slice::from_ref(place), mark, encoding);
    }

    /// The contour lines of a level: straight between the middles of cells, on
    /// logarithmic axes and colours by ratio.
    fn contour(&self, map: &Map, level: f64) -> Vec<Vec<(f64, f64)>> {
        let log = map.contours_of.is_none() && map.z_axis.spacing == Spacing::Log;
        let drawn = |level: f64| (!log || level > 0.0).then(|| measure(level, log));
        let Some(level) = drawn(level) else {
            return Vec::new();
        };
        let places = |side: &Side, axis: &Axis| -> Vec<f64> {
            let values = side.values.iter();
            values.map(|&value| measure(value, axis.log)).collect()
        };
        let (x, y) = (places(&self.grid.x, self.x), places(&self.grid.y, self.y));
        let levels = self.grid.cells.iter().map(|cell| drawn(cell.level?));
        let values: Vec<Option<f64>> = levels.collect();
        let back = |(x, y): (f64, f64)| (measured(x, self.x.log), measured(y, self.y.log));
        let line_back = |line: Vec<(f64, f64)>| line.into_iter().map(back).collect();
        let (x, y, values) = (&x, &y, &values);
        let lines = Field { x, y, values }.lines(level).into_iter();
        lines.map(line_back).collect()
    }
}

/// The reason for which a contour is not to be seen, `words` being its level.
fn unseen(grid: &Grid, level: f64, words: &str) -> String {
    let levels = || grid.cells.iter().filter_map(|cell| cell.level);
    if levels().all(|value| value < level) {
        format!("No cell reaches the contour at {words}.")
    } else if levels().all(|value| value > level) {
        format!("Every cell is above the contour at {words}.")
    } else {
        format!("The contour at {words} lies between cells without a value.")
    }
}
