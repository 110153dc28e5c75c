//! Kind `lines`: curves over a parameter, simulated and of theory.

mod data;
mod looks;

use super::axis::{Axis, Direction, Margin, Spacing, extent};
use super::canvas::{Canvas, Point, Stroke};
use super::clip::{clipped, thinned};
use super::frame::{Frame, room_below, room_left, room_right};
use super::group::Spread;
use super::label::Label;
use super::legend::Group;
use super::mark::{Mark, RADIUS, shape};
use super::note::LeftOut;
use super::reference::{base_line_entry, draw_base_line, draw_limits, limits, with_limits};
use super::sheet::{EDGE, Sheet, WIDTH};
use super::spec::{Lines, Panel, Picture};
use super::unit::power_of_ten;
use super::{Curve, PictureError, Table};
use data::{Data, Points};
use looks::Looks;

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
    let mut groups = looks.legend(lines, curves);
    let base = base_line_entry(table, &lines.x, &x);
    groups.extend(base.map(|entry| Group::of(vec![entry])));
    let mut notes = data.notes;
    notes.extend(left_out.notes("Lines: medians, bands: smallest to largest"));
    let sheet = Sheet::new(&spec.title, &groups, &notes);
    let ends = |at: usize| {
        let top = sheet.top() + at as f64 * (tall + BETWEEN);
        [top, top + tall]
    };
    let lowest = plots.len().saturating_sub(1);
    let bottom = ends(lowest)[1] + room_below(&x, right - left);
    sheet.draw(bottom, &spec.words(), |canvas: &mut Canvas| {
        for (at, plot) in plots.iter().enumerate() {
            let frame = Frame::of([left, right], ends(at), [&x, &plot.y]);
            frame.draw_grid(canvas);
            frame.draw_axes(canvas, at == lowest);
            draw_base_line(canvas, &frame, table, &lines.x);
            plot.draw(canvas, &frame);
            if plot.is_empty() {
                frame.draw_nothing(canvas);
            }
        }
    })
}

/// A curve of the plot.
struct Drawn {
    points: Points,
    stroke: Stroke,
    mark: Option<Mark>,
}

/// A panel with its data.
struct Plot {
    y: Axis,
    curves: Vec<Drawn>,
    /// Limits on the axis, one or both signs.
    limits: Vec<f64>,
}

/// A point less than this from its neighbour has no mark of its own \[px\].
const MARK_ROOM: f64 = 9.0;

impl Plot {
    fn new(
        data: &Data,
        panel: &Panel,
        x: &Axis,
        looks: &Looks,
        given: &[Curve],
        left_out: &mut LeftOut,
    ) -> Result<Self, PictureError> {
        let names = || panel.y.iter().chain(&panel.theory);
        let label = title(panel);
        let mut curves = Vec::new();
        for (name, at) in names().zip(0_usize..) {
            let column = data.table.column(name)?;
            let unit = Label::of(name).unit();
            let first = (panel.first_column(), label.unit.as_str());
            let apart = || PictureError::units([first, (name, &unit.symbol)]);
            let factor = power_of_ten(unit.shift_to(&label.unit()).ok_or_else(apart)?);
            let values = column.numbers()?;
            for series in 0..data.series.len() {
                let points = data.points(&values, series, x, left_out);
                let scaled = |(at, spread): (f64, Option<Spread>)| {
                    (at, spread.map(|spread| spread.scaled(factor)))
                };
                let (stroke, mark) = if at < panel.y.len() {
                    let (stroke, mark) = looks.simulated(name, series);
                    (stroke, Some(mark))
                } else {
                    (looks.theory(name, series), None)
                };
                curves.push(Drawn {
                    points: points.into_iter().map(scaled).collect(),
                    stroke,
                    mark,
                });
            }
        }
        // Values that stand alone.
        let single = |y: f64| Spread::of(y.is_finite().then_some(y).into_iter().collect());
        curves.extend(given.iter().zip(0_usize..).map(|(curve, at)| Drawn {
            points: curve.points.iter().map(|&(x, y)| (x, single(y))).collect(),
            stroke: looks.given(at),
            mark: None,
        }));
        let log = panel.y_axis.spacing == Spacing::Log;
        if log {
            leave_out(&mut curves, left_out);
        }
        let on_x = |&&(at, _): &&(f64, Option<Spread>)| x.holds(at);
        let spreads = || {
            let points = curves.iter().flat_map(|curve| curve.points.iter());
            points.filter(on_x).filter_map(|&(_, spread)| spread)
        };
        let span = extent(spreads().flat_map(|spread| [spread.low, spread.high]));
        let limits = limits(panel.limit.as_ref(), span, log);
        let span = with_limits(span, &limits, log);
        let y = Axis::new(&panel.y_axis, &label, span, Margin::FromZero)?;
        left_out.beyond += spreads().filter(|spread| !y.holds(spread.median)).count();
        Ok(Self { y, curves, limits })
    }

    fn is_empty(&self) -> bool {
        let mut points = self.curves.iter().flat_map(|curve| &curve.points);
        points.all(|(_, spread)| spread.is_none())
    }

    fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        for curve in &self.curves {
            for part in curve.parts() {
                draw_band(canvas, frame, part, &curve.stroke);
            }
        }
        if !self.is_empty() {
            draw_limits(canvas, frame, &self.limits, Direction::Up);
        }
        // Theory comes last in the list and lies on top.
        for curve in &self.curves {
            for part in curve.parts() {
                let line: Vec<Point> = on_frame(frame, part, |spread| spread.median);
                for line in clipped(&thinned(line), &frame.area) {
                    canvas.path(&line, &curve.stroke);
                }
            }
        }
        for curve in &self.curves {
            curve.draw_marks(canvas, frame);
        }
    }
}

impl Drawn {
    /// The curve between the places that have no value.
    fn parts(&self) -> impl Iterator<Item = &[(f64, Option<Spread>)]> {
        let parts = self.points.split(|(_, spread)| spread.is_none());
        parts.filter(|part| !part.is_empty())
    }

    /// Marks at all points, if there is room, else at points that stand alone.
    fn draw_marks(&self, canvas: &mut Canvas, frame: &Frame) {
        let mark = self.mark.unwrap_or(Mark {
            shape: shape(0),
            colour: self.stroke.colour,
            hollow: false,
        });
        let all = on_frame(frame, &self.points, |spread| spread.median);
        let ends = extent(all.iter().map(|(x, _)| *x));
        let room = ends.map_or(0.0, |(from, to)| to - from);
        let everywhere = self.mark.is_some() && room >= MARK_ROOM * (all.len() as f64 - 1.0);
        for part in self.parts().filter(|part| everywhere || part.len() == 1) {
            for point in on_frame(frame, part, |spread| spread.median) {
                if frame.area.holds(point) {
                    mark.draw(canvas, point, RADIUS);
                }
            }
        }
    }
}

/// Title and unit of the axis: those of the column if there is only one.
fn title(panel: &Panel) -> Label {
    let mut label = Label::of(panel.first_column());
    if panel.y.len() > 1 || panel.y.is_empty() && panel.theory.len() > 1 {
        label.words = "Value".to_owned();
    }
    label
}

/// Takes what is not above 0 out of the curves.
fn leave_out(curves: &mut [Drawn], left_out: &mut LeftOut) {
    let points = curves.iter_mut().flat_map(|curve| &mut curve.points);
    for (_, spread) in points {
        if spread.is_some_and(|spread| spread.low <= 0.0) {
            left_out.not_above_0 += 1;
            *spread = None;
        }
    }
}

/// Points on the sheet.
fn on_frame(frame: &Frame, part: &[(f64, Option<Spread>)], of: fn(&Spread) -> f64) -> Vec<Point> {
    let point = |(x, spread): &_| frame.point(*x, of(Option::as_ref(spread)?));
    part.iter().filter_map(point).collect()
}

/// The band from the smallest to the largest value; a stroke where a point
/// stands alone.
fn draw_band(canvas: &mut Canvas, frame: &Frame, part: &[(f64, Option<Spread>)], stroke: &Stroke) {
    let spreads = || part.iter().filter_map(|(_, spread)| *spread);
    if spreads().all(|spread| spread.high <= spread.low) {
        return;
    }
    let hold = |(x, y): Point| (x, y.clamp(frame.area.top, frame.area.bottom));
    let low = on_frame(frame, part, |spread| spread.low);
    let high = on_frame(frame, part, |spread| spread.high);
    if let ([low], [high]) = (low.as_slice(), high.as_slice()) {
        let whisker = Stroke::solid(stroke.colour, 1.4);
        return canvas.path(&[hold(*low), hold(*high)], &whisker);
    }
    let inside = |&(x, _): &Point| (frame.area.left..=frame.area.right).contains(&x);
    let back = thinned(low).into_iter().rev();
    let outline = thinned(high).into_iter().chain(back);
    let outline: Vec<Point> = outline.filter(inside).map(hold).collect();
    canvas.polygon(&outline, stroke.colour, 0.16);
}
