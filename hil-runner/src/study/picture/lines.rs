//! Kind `lines`: curves over a parameter, simulated and of theory.

use serde_json::{Value, json};

use super::axis::{Axis, Margin, Spacing, extent};
use super::colour::{INK, MUTED, SERIES, series};
use super::group::{Different, Spread};
use super::label::{Label, within};
use super::map::CROSS;
use super::note::{Chosen, LeftOut};
use super::reference::{
    Sign, add_base_line, add_limits, legend_of_lines, limit_sign, limits, with_limits,
};
use super::sheet::{Plot, WIDTH, brush, choice, fading, of_some_marks};
use super::spec::{Lines, Panel};
use super::unit::power_of_ten;
use super::{PictureError, Table};

/// Height of one of so many plots \[px\].
fn height(count: usize) -> f64 {
    match count {
        1 => 400.0,
        2 => 270.0,
        _ => 210.0,
    }
}

/// Dashes of theory \[px\], by column.
const THEORY: [&[f64]; 3] = [&[8.0, 5.0], &[2.5, 3.5], &[14.0, 4.0, 3.0, 4.0]];
/// Marks, one shape per series.
const SHAPES: [&str; 7] = [
    "circle",
    "square",
    "triangle-up",
    "diamond",
    "triangle-down",
    CROSS,
    "cross",
];
/// Points closer than this have small marks \[px\].
const MARK_ROOM: f64 = 9.0;

pub(super) fn plots(lines: &Lines, chosen: &mut Chosen<'_>) -> Result<Vec<Plot>, PictureError> {
    let (rows, left_out) = (&chosen.rows, &mut chosen.left_out);
    let data = Data::of(lines, chosen.table, rows)?;
    let x = data.x_axis(lines)?;
    let names = Names::of(lines, &data);
    let mut plots = Vec::new();
    let mut signs = names.signs(lines);
    signs.extend(limit_signs(lines));
    let last = lines.panels.len().saturating_sub(1);
    for (at, panel) in lines.panels.iter().enumerate() {
        let mut drawing = Drawing {
            plot: Plot::new(height(lines.panels.len())),
            data: &data,
            lines,
            panel,
            names: &names,
            x: x.clone(),
            place: at,
            has_legend: plots.iter().all(|plot: &Plot| plot.marks.is_empty()),
        };
        drawing.x.is_bare = at != last;
        let base = drawing.fill(left_out)?;
        if at == 0 {
            signs.extend(base);
            drawing.plot.layers.extend(legend_of_lines(&signs));
        }
        plots.push(drawing.plot);
    }
    chosen.tell_left_out("Lines: medians, bands: smallest to largest");
    Ok(plots)
}

/// One explanation per limit; where panels differ it says of what.
fn limit_signs(lines: &Lines) -> Vec<Sign> {
    let several = lines.panels.len() > 1;
    let sign = |panel: &Panel| {
        let label = Label::of(panel.first_column());
        let mut sign = limit_sign(panel.limit.as_ref()?, &label);
        if several {
            sign.words += &format!(" ({})", within(&panel.y_axis.words(&label)));
        }
        Some(sign)
    };
    lines.panels.iter().filter_map(sign).collect()
}

/// Title and unit of the axis: those of the column if there is only one.
fn title(panel: &Panel) -> Label {
    let mut label = Label::of(panel.first_column());
    if panel.y.len() > 1 || panel.y.is_empty() && panel.theory.len() > 1 {
        label.words = "Value".to_owned();
    }
    label
}

/// What the curves are told apart by: the series, or without them the columns.
struct Names {
    simulated: Vec<String>,
    theory: Vec<String>,
    /// Words of the legend of colours, in order.
    coloured: Vec<String>,
    /// Title of that legend; without series there is none.
    heading: Option<String>,
    colours: [Vec<&'static str>; 2],
    /// One simulated column and one of theory at most per panel: the titles of
    /// the axes say which.
    alike: bool,
}

impl Names {
    fn of(lines: &Lines, data: &Data) -> Self {
        let columns = |of: fn(&Panel) -> &Vec<String>| {
            let mut names: Vec<String> = Vec::new();
            for name in lines.panels.iter().flat_map(of) {
                if !names.contains(name) {
                    names.push(name.clone());
                }
            }
            names
        };
        let single = |panel: &Panel| panel.y.len() < 2 && panel.theory.len() < 2;
        let alike = lines.panels.iter().all(single);
        let simulated = columns(|panel| &panel.y);
        let theory = columns(|panel| &panel.theory);
        let heading = lines.series.as_ref();
        let heading = heading.map(|column| format!("{}:", Label::of(column).words));
        let words = simulated.iter().map(|column| Label::of(column).words);
        let coloured = match &heading {
            Some(_) => data.series.names.clone(),
            None if alike => vec!["simulated".to_owned()],
            None => words.collect(),
        };
        Self {
            colours: series(coloured.len(), data.series.numbers.is_some()),
            simulated,
            theory,
            coloured,
            heading,
            alike,
        }
    }

    /// The name of a curve that the colours go by.
    fn name(&self, column: &str, series: usize) -> String {
        match &self.heading {
            Some(_) => self.coloured[series].clone(),
            None if self.alike => "simulated".to_owned(),
            None => Label::of(column).words,
        }
    }

    /// Place of a column among those of its kind, where columns look different.
    fn place(&self, of: &[String], column: &str) -> usize {
        match self.alike {
            true => 0,
            false => of.iter().position(|name| name == column).unwrap_or(0),
        }
    }

    /// What the dashes of theory mean, and beside series of other colours full lines,
    /// where titles of axes and colours do not say it.
    fn signs(&self, lines: &Lines) -> Vec<Sign> {
        let words = |column: &str, own: &Option<String>, usual: &str| match (self.alike, own) {
            (false, _) => Label::of(column).words,
            (true, Some(own)) => own.clone(),
            (true, None) => usual.to_owned(),
        };
        let most = if self.alike { 1 } else { usize::MAX };
        let [marks, dashes] = match self.heading {
            Some(_) => [MUTED, MUTED],
            None => [SERIES[0], INK],
        };
        let simulated = self.simulated.iter().take(most);
        let simulated =
            simulated.map(|column| Sign::new(words(column, &lines.marks, "simulated"), marks, &[]));
        let theory = self.theory.iter().zip(THEORY.into_iter().cycle());
        let theory = theory
            .take(most)
            .map(|(column, dash)| Sign::new(words(column, &lines.dashes, "theory"), dashes, dash));
        let says_marks = match self.alike {
            true => !self.theory.is_empty(),
            false => self.heading.is_some(),
        };
        simulated.filter(|_| says_marks).chain(theory).collect()
    }

    /// The channels of colour and shape; the legend stands in one plot only.
    fn channels(&self, with_legend: bool) -> [Value; 2] {
        let least = usize::from(self.heading.is_none());
        let legend = (with_legend && self.coloured.len() > least).then(|| json!({"columns": 6}));
        let channel = |range: Value| {
            json!({
                "field": "name", "type": "nominal", "title": self.heading,
                "scale": {"domain": self.coloured, "range": range}, "legend": legend,
            })
        };
        let shapes: Vec<&&str> = SHAPES.iter().cycle().take(self.coloured.len()).collect();
        [channel(json!(self.colours[0])), channel(json!(shapes))]
    }
}

/// A panel on its way.
struct Drawing<'a> {
    plot: Plot,
    data: &'a Data<'a>,
    lines: &'a Lines,
    panel: &'a Panel,
    names: &'a Names,
    x: Axis,
    place: usize,
    /// The legend of the colours, and the choice in it, are those of this plot: the
    /// first that has marks.
    has_legend: bool,
}

impl Drawing<'_> {
    /// Adds all layers; the explanation of the base's line.
    fn fill(&mut self, left_out: &mut LeftOut) -> Result<Option<Sign>, PictureError> {
        let panel = self.panel;
        let label = title(panel);
        let mut columns = Vec::new();
        let log = panel.y_axis.spacing == Spacing::Log;
        for name in panel.y.iter().chain(&panel.theory) {
            columns.push((name, self.curves(name, left_out)?));
        }
        let points = || columns.iter().flat_map(|(_, curves)| curves).flatten();
        let all =
            || points().filter_map(|(at, spread)| Some((self.x.holds(*at), spread.as_ref()?)));
        let spreads = || all().filter_map(|(on_x, spread)| on_x.then_some(spread));
        let span = extent(spreads().flat_map(|spread| [spread.low, spread.high]));
        let limits = limits(panel.limit.as_ref(), span, log);
        let span = with_limits(span, &limits, log);
        let y = Axis::new(&panel.y_axis, &label, span, Margin::FromZero)?;
        let beyond = all().filter(|(on_x, spread)| !(*on_x && y.holds(spread.median)));
        left_out.beyond += beyond.map(|(_, spread)| spread.rows.len()).sum::<usize>();
        let has_values = spreads().next().is_some();
        let base = add_base_line(&mut self.plot, self.data.table, &self.lines.x, &self.x);
        if has_values {
            add_limits(&mut self.plot, &limits, &y, "y");
        }
        for (at, (column, curves)) in columns.iter().enumerate() {
            self.add_curves(column, curves, at >= panel.y.len(), &y);
        }
        Ok(base)
    }

    /// The points of a column, series by series.
    fn curves(&self, name: &str, left_out: &mut LeftOut) -> Result<Vec<Points>, PictureError> {
        let label = title(self.panel);
        let column = self.data.table.column(name)?;
        let unit = Label::of(name).unit();
        let first = (self.panel.first_column(), label.unit.as_str());
        let apart = || PictureError::units([first, (name, &unit.symbol)]);
        let factor = power_of_ten(unit.shift_to(&label.unit()).ok_or_else(apart)?);
        let values = column.numbers()?.into_iter();
        let values: Vec<Option<f64>> = values.map(|value| Some(value? * factor)).collect();
        let of_none = |row: &&usize| self.data.series.of_row[**row].is_none();
        let of_none = self.data.rows.iter().filter(of_none).count();
        left_out.of += of_none;
        left_out.missing += of_none;
        let of_series = |series| self.points(&values, series, left_out);
        Ok((0..self.data.series.len()).map(of_series).collect())
    }

    /// The points of one series of a column, ascending in x; what a logarithmic axis does
    /// not have is left out.
    fn points(&self, values: &[Option<f64>], series: usize, left_out: &mut LeftOut) -> Points {
        let log = self.panel.y_axis.spacing == Spacing::Log;
        let mut rows: Vec<(f64, usize)> = Vec::new();
        for &row in self.data.rows {
            if self.data.series.of_row[row] != Some(series) {
                continue;
            }
            match self.data.x.value(row) {
                Some(at) if !self.x.log || at > 0.0 => rows.push((at, row)),
                Some(_) => left_out.not_above_0 += 1,
                None => left_out.missing += 1,
            }
            left_out.of += 1;
        }
        rows.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        // Values of x are those of `Different`.
        let places = rows.chunk_by(|(a, _), (b, _)| a == b);
        let points = places.map(|place| {
            let there = |&(_, row): &(f64, usize)| Some((row, values[row]?));
            let runs: Vec<(usize, f64)> = place.iter().filter_map(there).collect();
            left_out.missing += place.len() - runs.len();
            left_out.shared = left_out.shared.max(runs.len());
            let mut spread = Spread::of(runs);
            if log && let Some(seen) = spread.take_if(|spread| spread.low <= 0.0) {
                left_out.not_above_0 += seen.rows.len();
            }
            (place[0].0, spread)
        });
        points.collect()
    }

    /// Band, line and marks of a column.
    fn add_curves(&mut self, column: &str, curves: &[Points], is_theory: bool, y: &Axis) {
        let mut marks = Vec::new();
        let (mut has_band, mut crowded) = (false, false);
        for (series, points) in curves.iter().enumerate() {
            let name = self.names.name(column, series);
            let shown = points.iter().filter(|(_, spread)| spread.is_some()).count();
            crowded |= shown as f64 * MARK_ROOM > WIDTH;
            for (number, part) in points.split(|(_, spread)| spread.is_none()).enumerate() {
                for (at, spread) in part.iter().filter_map(|(at, of)| Some((at, of.as_ref()?))) {
                    has_band |= spread.high > spread.low;
                    let mut mark = json!({
                        "rows": spread.rows, "column": column, "name": name,
                        "part": format!("{series}.{number}"),
                        "x": self.x.shown(*at), "y": y.shown(spread.median),
                    });
                    if spread.rows.len() > 1 {
                        mark["low"] = json!(y.shown(spread.low));
                        mark["high"] = json!(y.shown(spread.high));
                    }
                    if part.len() == 1 {
                        mark["alone"] = json!(true);
                    }
                    marks.push(mark);
                }
            }
        }
        if marks.is_empty() {
            return;
        }
        // A mark at the end of an axis is whole, if none lies beyond.
        let inside = |(at, spread): &(f64, Option<Spread>)| {
            let spread = spread.as_ref();
            spread.is_none_or(|spread| self.x.holds(*at) && y.holds(spread.median))
        };
        let clip = !curves.iter().flatten().all(inside);
        let is_first = self.plot.marks.is_empty();
        self.plot.marks.extend(marks);
        let [colour, shape] = self.names.channels(self.has_legend);
        let only = format!("datum.column === {}", json!(column));
        let channels = |colour: &str, value: Value| {
            let mut encoding = json!({
                "x": self.x.channel("x"), "y": y.channel("y"), "detail": {"field": "part"}, "opacity": fading(1.0),
            });
            encoding[colour] = value;
            encoding
        };
        let mut layers = Vec::new();
        if has_band {
            let mut encoding = channels("color", colour.clone());
            encoding["y"]["field"] = json!("low");
            encoding["y2"] = json!({"field": "high"});
            encoding["opacity"] = fading(0.16);
            let mark = json!({"type": "area", "clip": true});
            layers.push(of_some_marks(&only, mark, encoding));
        }
        let mut mark = json!({"type": "line", "clip": true, "strokeWidth": 2});
        let mut encoding = channels("color", colour.clone());
        if is_theory {
            let place = self.names.place(&self.names.theory, column);
            mark["strokeDash"] = json!(THEORY[place % THEORY.len()]);
            let [without_legend, _] = self.names.channels(false);
            encoding = channels("stroke", without_legend);
            match self.names.heading {
                Some(_) => encoding["stroke"]["scale"]["range"] = json!(self.names.colours[1]),
                None => {
                    encoding["stroke"] = json!({"value": INK});
                    mark["style"] = json!("ink");
                }
            }
        }
        layers.push(of_some_marks(&only, mark, encoding));
        let place = self.names.place(&self.names.simulated, column);
        let hollow = self.names.heading.is_some() && place > 0;
        let size = if crowded { 12 } else { 60 };
        let mut mark = json!({"type": "point", "clip": clip, "filled": !hollow, "size": size});
        let mut encoding = channels("color", colour);
        if is_theory {
            // There for the pointer; to be seen where a point stands alone.
            mark["size"] = json!(24);
            encoding["color"] = json!({"value": INK});
            encoding["opacity"] =
                json!({"condition": {"test": "datum.alone", "value": 1}, "value": 0});
        } else {
            encoding["shape"] = shape;
        }
        encoding["tooltip"] = json!([
            {"field": "rows", "title": "row"}, {"field": "name"},
            {"field": "x", "title": self.x.title}, {"field": "y", "title": y.title},
        ]);
        let mut points = of_some_marks(&only, mark, encoding);
        if is_first {
            brush(&mut points, self.place, &["x"]);
            // The legend is that of the first layer, and so must its choice be.
            if self.has_legend {
                choice(&mut layers[0]);
            }
        }
        layers.push(points);
        self.plot.layers.extend(layers);
    }
}

/// A place along x with the values there; none where every run lacks one.
type Points = Vec<(f64, Option<Spread>)>;

/// Rows with their places and series.
struct Data<'a> {
    table: &'a Table,
    rows: &'a [usize],
    /// The series; one without a name if the picture names no column.
    series: Different,
    x: Different,
}

impl<'a> Data<'a> {
    fn of(lines: &Lines, table: &'a Table, rows: &'a [usize]) -> Result<Self, PictureError> {
        Ok(Self {
            table,
            rows,
            series: Different::series(lines.series.as_ref(), table, rows)?,
            x: Different::of(table.column(&lines.x)?, rows)?,
        })
    }

    /// The axis along x, over all rows, whether they have values or not.
    fn x_axis(&self, lines: &Lines) -> Result<Axis, PictureError> {
        let label = Label::of(&lines.x);
        if self.x.numbers.is_none() {
            let words = lines.x_axis.words(&label);
            return Ok(Axis::of_places(words, self.x.names.clone()));
        }
        let log = lines.x_axis.spacing == Spacing::Log;
        let values = || self.rows.iter().filter_map(|&row| self.x.value(row));
        let span = extent(values().filter(|value| !log || *value > 0.0));
        Ok(Axis::new(&lines.x_axis, &label, span, Margin::Around)?.of_values(values()))
    }
}
