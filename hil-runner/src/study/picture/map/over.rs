//! Lines over the cells: contours and the caller's curves.

use super::contour::Field;
use super::grid::Grid;
use super::{Curve, Frame, Map};
use crate::study::picture::axis::Spacing;
use crate::study::picture::canvas::{Anchor, Area, Canvas, Lettering, Point, Stroke};
use crate::study::picture::clip::clipped;
use crate::study::picture::colour::{Colour, INK, SERIES, WHITE};
use crate::study::picture::group::in_words;
use crate::study::picture::label::Label;
use crate::study::picture::legend::{Entry, Key};
use crate::study::picture::text::{NOTE_PX, width};

/// Lines of the contours.
const CONTOUR: Stroke = Stroke::solid(INK, 1.6);
/// Light edge beside a line, both sides together \[px\].
const CASING: f64 = 2.4;

/// Line of the n-th curve of the caller.
fn curve_line(at: usize) -> Stroke {
    const DASHES: [&[f64]; 3] = [&[], &[9.0, 5.0], &[2.5, 3.5]];
    Stroke::dashed(SERIES[[1, 3, 6][at % 3]], 2.8, DASHES[at % DASHES.len()])
}

/// A line over the map.
struct Line {
    parts: Vec<Vec<Point>>,
    stroke: Stroke,
    /// Words beside the line itself, else in the legend.
    beside: bool,
    words: String,
    /// Remark to be made if the line is not to be seen.
    unseen: String,
}

/// All lines over a map.
pub(super) struct Overlay {
    lines: Vec<Line>,
    /// Words and levels of the contours.
    contours: Option<String>,
}

impl Overlay {
    pub(super) fn new(map: &Map, grid: &Grid, frame: &Frame, curves: &[Curve]) -> Self {
        let label = Label::of(map.contour_column());
        let mut lines = Vec::new();
        for &level in &map.contours {
            let words = in_words(level, &label);
            lines.push(Line {
                parts: contour(map, grid, frame, level),
                stroke: CONTOUR,
                beside: true,
                unseen: unseen(grid, level, &words),
                words,
            });
        }
        let levels: Vec<&str> = lines.iter().map(|line| line.words.as_str()).collect();
        let contours =
            (!levels.is_empty()).then(|| format!("{} = {}", label.words, levels.join(", ")));
        lines.extend(curves.iter().enumerate().map(|(at, curve)| Line {
            parts: parts(curve, frame),
            stroke: curve_line(at),
            beside: false,
            words: curve.label.clone(),
            unseen: format!("\"{}\" does not cross this plot.", curve.label),
        }));
        Self { lines, contours }
    }

    pub(super) fn legend(&self, ground: Colour) -> Vec<Entry> {
        let contours = self.contours.iter();
        let contours = contours.map(|words| Entry::new(Key::Cased(CONTOUR, ground), words));
        let seen = |line: &&Line| !line.beside && !line.parts.is_empty();
        let curves = self.lines.iter().filter(seen);
        let curves = curves.map(|line| Entry::new(Key::Cased(line.stroke, ground), &line.words));
        contours.chain(curves).collect()
    }

    /// Remarks on lines that are not to be seen.
    pub(super) fn notes(&self) -> Vec<String> {
        let unseen = self.lines.iter().filter(|line| line.parts.is_empty());
        unseen.map(|line| line.unseen.clone()).collect()
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, plot: &Area) {
        for line in &self.lines {
            let edge = Stroke::solid(WHITE, line.stroke.width_px + CASING);
            for part in &line.parts {
                canvas.path(part, &edge);
            }
            for part in &line.parts {
                canvas.path(part, &line.stroke);
            }
        }
        let mut taken: Vec<Area> = Vec::new();
        for line in self.lines.iter().filter(|line| line.beside) {
            if let Some(area) = self.place(line, plot, &taken) {
                canvas.fill(&area, WHITE);
                let lettering = Lettering::of(NOTE_PX, Anchor::Middle);
                canvas.text(&line.words, area.middle(), &lettering);
                taken.push(area);
            }
        }
    }

    /// A place on the line for its words: in the plot, free of other words,
    /// and if that can be of other lines.
    fn place(&self, line: &Line, plot: &Area, taken: &[Area]) -> Option<Area> {
        let half = (0.5 * width(&line.words, NOTE_PX) + 3.0, 0.62 * NOTE_PX);
        let longer = |a: &&Vec<Point>, b: &&Vec<Point>| length(a).total_cmp(&length(b));
        let longest = line.parts.iter().max_by(longer)?;
        let all = length(longest);
        if all < 3.0 * half.0 {
            return None;
        }
        let around = |(x, y): Point| Area::of([x - half.0, x + half.0], [y - half.1, y + half.1]);
        let free = |area: &Area| {
            let inside = plot.holds((area.left, area.top)) && plot.holds((area.right, area.bottom));
            inside && !taken.iter().any(|other| other.meets(area))
        };
        let crossed = |area: &Area| {
            let others = self.lines.iter();
            let others = others.filter(|other| !std::ptr::eq(*other, line));
            let mut parts = others.flat_map(|other| &other.parts);
            parts.any(|part| !clipped(part, area).is_empty())
        };
        let places: Vec<Area> = [0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9]
            .iter()
            .filter_map(|share| along(longest, share * all))
            .map(around)
            .filter(free)
            .collect();
        let clear = places.iter().find(|area| !crossed(area));
        clear.or(places.first()).copied()
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

/// The contour lines of a level, on the sheet. Where the colours are
/// logarithmic, so is the way from one cell to the next.
fn contour(map: &Map, grid: &Grid, frame: &Frame, level: f64) -> Vec<Vec<Point>> {
    let log = map.contours_of.is_none() && map.z_axis.spacing == Spacing::Log;
    let measure = |value: f64| match log {
        true => (value > 0.0).then(|| libm::log10(value)),
        false => Some(value),
    };
    let Some(level) = measure(level) else {
        return Vec::new();
    };
    let x: Option<Vec<f64>> = grid.x.values.iter().map(|&x| frame.across(x)).collect();
    let y: Option<Vec<f64>> = grid.y.values.iter().map(|&y| frame.up(y)).collect();
    let (Some(x), Some(y)) = (x, y) else {
        return Vec::new();
    };
    let levels = grid.cells.iter().map(|cell| cell.level);
    let values: Vec<Option<f64>> = levels.map(|level| level.and_then(measure)).collect();
    let lines = Field::of(&x, &y, &values).lines(level);
    let lines = lines.iter().flat_map(|line| clipped(line, &frame.area));
    lines.collect()
}

/// A curve of the caller on the sheet, in parts.
pub(in crate::study::picture) fn parts(curve: &Curve, frame: &Frame) -> Vec<Vec<Point>> {
    let point = |&(x, y): &Point| frame.point(x, y);
    let points: Vec<Option<Point>> = curve.points.iter().map(point).collect();
    points
        .split(Option::is_none)
        .map(|part| part.iter().copied().flatten().collect::<Vec<_>>())
        .flat_map(|part| clipped(&part, &frame.area))
        .collect()
}

fn distance(a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    (dx * dx + dy * dy).sqrt()
}

fn length(line: &[Point]) -> f64 {
    line.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// The point at a distance from the start of a line.
fn along(line: &[Point], mut way: f64) -> Option<Point> {
    for pair in line.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let step = distance(from, to);
        if way <= step && step > 0.0 {
            let share = way / step;
            let between = |a: f64, b: f64| a + share * (b - a);
            return Some((between(from.0, to.0), between(from.1, to.1)));
        }
        way -= step;
    }
    line.last().copied()
}
