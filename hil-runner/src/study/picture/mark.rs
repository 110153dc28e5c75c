//! Signs that are told apart without colour: the marks of points, one shape per
//! series, and the hatches of fields without a value.

use super::canvas::{Area, Canvas, Point, Stroke};
use super::clip::clipped;
use super::colour::{Colour, MUTED, NO_VALUE, WHITE};

/// A shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    Point,
    Cross,
    Plus,
}

/// A mark: shape, colour, and whether its middle is white.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Mark {
    pub(super) shape: Shape,
    pub(super) colour: Colour,
    pub(super) hollow: bool,
}

/// Radius of a mark \[px\].
pub(super) const RADIUS: f64 = 4.2;
/// Half the width of a cross's strokes over its radius.
const ARM: f64 = 0.28;

/// The shape of a series.
pub(super) fn shape(index: usize) -> Shape {
    use Shape::{Circle, Cross, Diamond, Plus, Point, Square, Triangle};
    const SHAPES: [Shape; 7] = [Circle, Square, Triangle, Diamond, Point, Cross, Plus];
    SHAPES[index % SHAPES.len()]
}

impl Mark {
    /// A mark all of one colour.
    pub(super) const fn filled(shape: Shape, colour: Colour) -> Self {
        Self {
            shape,
            colour,
            hollow: false,
        }
    }

    /// Draws the mark about a point.
    pub(super) fn draw(&self, canvas: &mut Canvas, at: Point, radius_px: f64) {
        draw(canvas, self.shape, at, radius_px, self.colour);
        let has_middle = !matches!(self.shape, Shape::Cross | Shape::Plus);
        if self.hollow && has_middle {
            draw(canvas, self.shape, at, 0.55 * radius_px, WHITE);
        }
    }
}

fn draw(canvas: &mut Canvas, shape: Shape, at: Point, radius_px: f64, colour: Colour) {
    if shape == Shape::Circle {
        return canvas.circle(at, radius_px, colour);
    }
    let place = |(x, y): &Point| (at.0 + radius_px * x, at.1 + radius_px * y);
    let points: Vec<Point> = outline(shape).iter().map(place).collect();
    canvas.polygon(&points, colour, 1.0);
}

/// Corners about the middle; areas are about that of a circle of radius 1.
fn outline(shape: Shape) -> Vec<Point> {
    const SQUARE: f64 = 0.89;
    match shape {
        Shape::Circle | Shape::Square => {
            let s = SQUARE;
            vec![(-s, -s), (s, -s), (s, s), (-s, s)]
        }
        Shape::Triangle => vec![(0.0, -1.35), (1.2, 0.8), (-1.2, 0.8)],
        Shape::Point => vec![(0.0, 1.35), (1.2, -0.8), (-1.2, -0.8)],
        Shape::Diamond => vec![(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)],
        Shape::Plus => plus().to_vec(),
        // The plus turned by 45°.
        Shape::Cross => {
            let turn = std::f64::consts::FRAC_1_SQRT_2;
            let turned = plus().map(|(x, y)| (turn * (x - y), turn * (x + y)));
            turned.to_vec()
        }
    }
}

fn plus() -> [Point; 12] {
    let (a, l) = (ARM, 1.25);
    // Three corners, four times, a quarter turn further each time.
    let arm = [(-a, -l), (a, -l), (a, -a)];
    core::array::from_fn(|at| (0..at / 3).fold(arm[at % 3], |(x, y), _| (-y, x)))
}

/// Lines over a grey field without a value, by the state of its run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hatch {
    /// None.
    Plain,
    /// Rising to the right.
    Rising,
    /// Falling to the right.
    Falling,
    /// Both.
    Crossed,
}

/// Distance of two lines along x \[px\].
const PITCH: f64 = 7.0;

impl Hatch {
    /// The hatch of the n-th state, so that no two of the first four are alike.
    pub(super) fn of(index: usize) -> Self {
        const HATCHES: [Hatch; 4] = [Hatch::Rising, Hatch::Falling, Hatch::Crossed, Hatch::Plain];
        HATCHES[index % HATCHES.len()]
    }

    /// Fills an area; lines of neighbours meet.
    pub(super) fn draw(self, canvas: &mut Canvas, area: &Area) {
        canvas.fill(area, NO_VALUE);
        let slopes: &[f64] = match self {
            Self::Plain => &[],
            Self::Rising => &[-1.0],
            Self::Falling => &[1.0],
            Self::Crossed => &[-1.0, 1.0],
        };
        let stroke = Stroke::solid(MUTED, 0.9);
        for slope in slopes {
            // Lines x − slope·y = k·pitch, k whole: the same for every area.
            let ends = [area.top, area.bottom].map(|y| -slope * y);
            let low = area.left + ends[0].min(ends[1]);
            let high = area.right + ends[0].max(ends[1]);
            let mut k = (low / PITCH).ceil();
            while k * PITCH <= high {
                let at = |y: f64| (k * PITCH + slope * y, y);
                for part in clipped(&[at(area.top), at(area.bottom)], area) {
                    canvas.path(&part, &stroke);
                }
                k += 1.0;
            }
        }
    }
}
