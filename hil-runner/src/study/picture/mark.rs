//! The marks of points: one shape per series, told apart without colour.

use super::canvas::{Canvas, Point};
use super::colour::{Colour, WHITE};

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
    const SHAPES: [Shape; 7] = [
        Shape::Circle,
        Shape::Square,
        Shape::Triangle,
        Shape::Diamond,
        Shape::Point,
        Shape::Cross,
        Shape::Plus,
    ];
    SHAPES[index % SHAPES.len()]
}

impl Mark {
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
    let points: Vec<Point> = outline(shape)
        .iter()
        .map(|(x, y)| (at.0 + radius_px * x, at.1 + radius_px * y))
        .collect();
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
            plus()
                .map(|(x, y)| (turn * (x - y), turn * (x + y)))
                .to_vec()
        }
    }
}

fn plus() -> [Point; 12] {
    let (a, l) = (ARM, 1.25);
    [
        (-a, -l),
        (a, -l),
        (a, -a),
        (l, -a),
        (l, a),
        (a, a),
        (a, l),
        (-a, l),
        (-a, a),
        (-l, a),
        (-l, -a),
        (-a, -a),
    ]
}
