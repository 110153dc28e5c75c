//! One panel: its curves, its axis, and drawing them.

use super::data::{Data, Points};
use super::looks::{LIMIT_LINE, Looks};
use super::{Axis, Panel};
use crate::study::picture::axis::{Margin, Spacing, extent, label_of};
use crate::study::picture::canvas::{Canvas, Point, Stroke};
use crate::study::picture::clip::{clipped, thinned};
use crate::study::picture::frame::Frame;
use crate::study::picture::group::Spread;
use crate::study::picture::label::Label;
use crate::study::picture::mark::{Mark, RADIUS};
use crate::study::picture::note::LeftOut;
use crate::study::picture::power::power_of_ten;
use crate::study::picture::{Curve, PictureError};

/// A curve of the plot.
struct Drawn {
    points: Points,
    stroke: Stroke,
    mark: Option<Mark>,
}

/// A panel with its data.
pub(super) struct Plot {
    pub(super) y: Axis,
    curves: Vec<Drawn>,
    /// Limits on the axis, one or both signs.
    limits: Vec<f64>,
}

/// A point less than this from its neighbour has no mark of its own \[px\].
const MARK_ROOM: f64 = 9.0;

impl Plot {
    pub(super) fn new(
        data: &Data,
        panel: &Panel,
        x: &Axis,
        looks: &Looks,
        given: &[Curve],
        left_out: &mut LeftOut,
    ) -> Result<Self, PictureError> {
        let names = || panel.y.iter().chain(&panel.theory);
        let label = title(data, panel)?;
        let first = names().next().map_or("", String::as_str);
        let mut curves = Vec::new();
        for (name, at) in names().zip(0_usize..) {
            let column = data.table.column(name)?;
            let unit = Label::of(name).unit();
            let shift = unit
                .shift_to(&label.unit())
                .ok_or_else(|| PictureError::Units {
                    first: first.to_owned(),
                    first_unit: label.unit.clone(),
                    other: name.clone(),
                    other_unit: unit.symbol.clone(),
                })?;
            let factor = power_of_ten(shift);
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
        let limits = match &panel.limit {
            Some(limit) => with_sign(limit.value, span, log),
            None => Vec::new(),
        };
        let span = with_limits(span, &limits, log);
        let y = Axis::new(&panel.y_axis, &label, span, Margin::FromZero)?;
        left_out.beyond += spreads().filter(|spread| !y.holds(spread.median)).count();
        Ok(Self { y, curves, limits })
    }

    pub(super) fn is_empty(&self) -> bool {
        let mut points = self.curves.iter().flat_map(|curve| &curve.points);
        points.all(|(_, spread)| spread.is_none())
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        for curve in &self.curves {
            for part in curve.parts() {
                draw_band(canvas, frame, part, &curve.stroke);
            }
        }
        if !self.is_empty() {
            draw_limits(canvas, frame, &self.limits);
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
            shape: super::shape(0),
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
fn title(data: &Data, panel: &Panel) -> Result<Label, PictureError> {
    let main = if panel.y.is_empty() {
        &panel.theory
    } else {
        &panel.y
    };
    let first = main.first().map_or("", String::as_str);
    let mut label = label_of(data.table.column(first)?, panel.y_axis.label.as_ref());
    if main.len() > 1 && panel.y_axis.label.is_none() {
        label.words = "Value".to_owned();
    }
    Ok(label)
}

/// A value that stands alone.
fn single(value: f64) -> Option<Spread> {
    let spread = Spread {
        median: value,
        low: value,
        high: value,
        count: 1,
    };
    value.is_finite().then_some(spread)
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

/// A limit holds for the magnitude: where data are below 0 it has two lines.
pub(in crate::study::picture) fn with_sign(
    limit: f64,
    span: Option<(f64, f64)>,
    log: bool,
) -> Vec<f64> {
    let mut limits = Vec::new();
    if !log || limit > 0.0 {
        limits.push(limit);
    }
    if span.is_some_and(|(low, _)| low < 0.0) && limit > 0.0 {
        limits.push(-limit);
    }
    limits
}

/// The span with the limits that are near it; one far off would press the data
/// into a line, and the legend tells it anyway.
pub(in crate::study::picture) fn with_limits(
    span: Option<(f64, f64)>,
    limits: &[f64],
    log: bool,
) -> Option<(f64, f64)> {
    let Some((low, high)) = span else {
        return extent(limits.iter().copied());
    };
    let near = |limit: f64| {
        if log {
            limit >= 0.01 * low && limit <= 100.0 * high
        } else {
            limit.abs() <= 4.0 * low.abs().max(high.abs())
        }
    };
    let limits = limits.iter().copied().filter(|&limit| near(limit));
    extent(limits.chain([low, high]))
}

/// The lines of limits across a plot.
pub(in crate::study::picture) fn draw_limits(canvas: &mut Canvas, frame: &Frame, limits: &[f64]) {
    for y in limits.iter().filter_map(|&limit| frame.up(limit)) {
        let line = [(frame.area.left, y), (frame.area.right, y)];
        for line in clipped(&line, &frame.area) {
            canvas.path(&line, &LIMIT_LINE);
        }
    }
}

/// Points on the sheet.
fn on_frame(frame: &Frame, part: &[(f64, Option<Spread>)], of: fn(&Spread) -> f64) -> Vec<Point> {
    part.iter()
        .filter_map(|(x, spread)| frame.point(*x, of(spread.as_ref()?)))
        .collect()
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
    let outline = thinned(high)
        .into_iter()
        .chain(thinned(low).into_iter().rev());
    let outline: Vec<Point> = outline.filter(inside).map(hold).collect();
    canvas.polygon(&outline, stroke.colour, 0.16);
}
