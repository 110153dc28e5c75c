//! Kind `scatter`: one mark per run, by verdict.

use super::axis::{Axis, Direction, Margin, Spacing, extent};
use super::canvas::{Canvas, Point, Stroke};
use super::colour::{FAIL, INK, MUTED, PASS};
use super::frame::{Frame, room_below, room_left, room_right};
use super::label::Label;
use super::legend::{Entry, Group, Key};
use super::map::parts;
use super::mark::{Mark, Shape};
use super::note::{Chosen, LeftOut};
use super::reference::{
    base_line_entry, draw_base_line, draw_limits, limit_entry, limits, with_limits,
};
use super::sheet::{EDGE, Sheet, WIDTH};
use super::spec::{Picture, Scatter};
use super::{Curve, PictureError, Table};

/// Height of the plot \[px\].
const HEIGHT: f64 = 440.0;
/// Radius of a mark \[px\].
const RADIUS: f64 = 3.0;
/// More runs than this are thinned: of those whose middles fall into one
/// square of [`SQUARE`] only the first has a mark.
const MOST_MARKS: usize = 4_000;
/// Side of a square \[px\].
const SQUARE: f64 = 4.0;

/// Line of the caller's curves.
const CURVE: Stroke = Stroke::solid(INK, 2.2);

/// A run's place and verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    x: f64,
    y: f64,
    pass: Option<bool>,
}

pub(super) fn draw(
    spec: &Picture,
    scatter: &Scatter,
    table: &Table,
    curves: &[Curve],
) -> Result<String, PictureError> {
    let Chosen { rows, mut notes } = Chosen::of(spec, table)?;
    let mut left_out = LeftOut::default();
    let runs = runs(scatter, table, &rows, &mut left_out)?;
    let span = extent(runs.iter().map(|run| run.x));
    let label = Label::of(&scatter.x);
    let mut x = Axis::new(&scatter.x_axis, &label, span, Margin::Around)?;
    let label = Label::of(&scatter.y);
    let log = scatter.y_axis.spacing == Spacing::Log;
    let span = extent(runs.iter().map(|run| run.y));
    let limits = limits(scatter.limit.as_ref(), span, log);
    let span = with_limits(span, &limits, log);
    let mut y = Axis::new(&scatter.y_axis, &label, span, Margin::Around)?;
    let beyond = |run: &&Run| !(x.holds(run.x) && y.holds(run.y));
    left_out.beyond = runs.iter().filter(beyond).count();
    y.fit(HEIGHT, Direction::Up);
    let left = EDGE + room_left(&y, HEIGHT);
    x.fit(WIDTH - EDGE - left - 22.0, Direction::Across);
    let right = WIDTH - room_right(&x);
    let mut entries = legend(&runs);
    let of_curve = |curve: &Curve| Entry::new(Key::Line(CURVE, None), &curve.label);
    entries.extend(curves.iter().map(of_curve));
    entries.extend(scatter.limit.iter().map(|limit| limit_entry(limit, &label)));
    entries.extend(base_line_entry(table, &scatter.x, &x));
    let frame = |top: f64| Frame::of([left, right], [top, top + HEIGHT], [&x, &y]);
    notes.extend(left_out.notes(""));
    // Which squares runs share does not depend on how far down the plot is.
    let marks = marks(&runs, &frame(0.0));
    let inside = runs.len() - left_out.beyond;
    if marks.len() < inside {
        notes.push(format!(
            "{inside} runs, {} marks: runs of one verdict closer than {SQUARE} px share one.",
            marks.len()
        ));
    }
    let sheet = Sheet::new(&spec.title, &[Group::of(entries)], &notes);
    let top = sheet.top();
    let frame = frame(top);
    let bottom = frame.area.bottom + room_below(&x, right - left);
    sheet.draw(bottom, &spec.words(), |canvas: &mut Canvas| {
        frame.draw_grid(canvas);
        frame.draw_axes(canvas, true);
        if runs.is_empty() {
            return frame.draw_nothing(canvas);
        }
        for ((x, y), mark) in marks {
            mark.draw(canvas, (x, y + top), RADIUS);
        }
        for curve in curves {
            for part in parts(curve, &frame) {
                canvas.path(&part, &CURVE);
            }
        }
        draw_base_line(canvas, &frame, table, &scatter.x);
        draw_limits(canvas, &frame, &limits, Direction::Up);
    })
}

/// The runs that have a place on both axes.
fn runs(
    scatter: &Scatter,
    table: &Table,
    rows: &[usize],
    left_out: &mut LeftOut,
) -> Result<Vec<Run>, PictureError> {
    let x = table.column(&scatter.x)?.numbers()?;
    let y = table.column(&scatter.y)?.numbers()?;
    let pass = table.column_or(scatter.pass.as_ref(), "pass")?;
    let log = [scatter.x_axis.spacing, scatter.y_axis.spacing].map(|of| of == Spacing::Log);
    let mut runs = Vec::new();
    for &row in rows {
        left_out.of += 1;
        let (Some(x), Some(y)) = (x[row], y[row]) else {
            left_out.missing += 1;
            continue;
        };
        if log[0] && x <= 0.0 || log[1] && y <= 0.0 {
            left_out.not_above_0 += 1;
            continue;
        }
        let pass = pass.and_then(|pass| pass.verdict(row));
        runs.push(Run { x, y, pass });
    }
    // Which runs lie on top, or stand for others, is no matter of their order.
    runs.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    Ok(runs)
}

fn mark(pass: Option<bool>) -> Mark {
    match pass {
        Some(true) => Mark::filled(Shape::Circle, PASS),
        Some(false) => Mark::filled(Shape::Cross, FAIL),
        None => Mark::filled(Shape::Diamond, MUTED),
    }
}

/// Marks in the plot, those that fail on top; thinned where there are many.
fn marks(runs: &[Run], frame: &Frame) -> Vec<(Point, Mark)> {
    let thin = runs.len() > MOST_MARKS;
    let mut marks = Vec::new();
    let judged = runs.iter().any(|run| run.pass.is_some());
    for verdict in [None, Some(true), Some(false)] {
        // Runs that nobody judges are not grey.
        let mark = mark(if judged { verdict } else { Some(true) });
        let mut taken = std::collections::BTreeSet::new();
        for run in runs.iter().filter(|run| run.pass == verdict) {
            let point = frame.point(run.x, run.y);
            let Some(point) = point.filter(|&point| frame.area.holds(point)) else {
                continue;
            };
            let square = [point.0, point.1].map(|place| (place / SQUARE).floor() as i32);
            if !thin || taken.insert(square) {
                marks.push((point, mark));
            }
        }
    }
    marks
}

/// Counts the runs of each verdict, if there are verdicts.
fn legend(runs: &[Run]) -> Vec<Entry> {
    if runs.iter().all(|run| run.pass.is_none()) {
        return Vec::new();
    }
    let verdicts = [
        (Some(true), "keeps its limits"),
        (Some(false), "does not"),
        (None, "no verdict"),
    ];
    let entry = |(pass, words): (Option<bool>, &str)| {
        let count = runs.iter().filter(|run| run.pass == pass).count();
        (count > 0).then(|| Entry::new(Key::Mark(mark(pass)), format!("{words}: {count}")))
    };
    verdicts.into_iter().filter_map(entry).collect()
}
