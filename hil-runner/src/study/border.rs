//! The border of stability over two axes of a study: where the linearised
//! sampled loop of the base case has the margin 0.

use super::axis::{Axis, Scale, Spread};
use super::cell::Cell;
use super::definition::Study;
use super::distribution::log_between;
use super::margins::Margins;
use super::picture::{Border, Curve, Field};

/// Points along each axis at which the margin is computed.
const POINTS: u32 = 81;

/// The borders with the joint closed and open over the axes of these columns,
/// whatever rung of the study has a margin; none where the columns are no
/// numeric axes.
pub(super) fn borders(study: &Study, x: &str, y: &str, wanted: &[Border]) -> Vec<Curve> {
    let axis = |name: &str| {
        let place = study.axes.iter().position(|axis| axis.key.path() == name)?;
        Some((place, places(&study.axes[place])?))
    };
    let (Some((x_place, x)), Some((y_place, y))) = (axis(x), axis(y)) else {
        return Vec::new();
    };
    let mut margins = Margins::default();
    let mut fields = [Vec::new(), Vec::new()];
    for &y in &y {
        for &x in &x {
            let mut point = study.point(0);
            for (place, value) in [(x_place, x), (y_place, y)] {
                point.values[place] = study.axes[place].key.value(value);
            }
            let cells = study
                .case(&point, study.rungs.len() - 1)
                .map(|case| margins.cells(&case))
                .unwrap_or([Cell::Empty, Cell::Empty]);
            for (field, cell) in fields.iter_mut().zip(cells) {
                field.push(cell.as_number());
            }
        }
    }
    let words = [
        (Border::Closed, "border of stability, joint closed"),
        (Border::Open, "border of stability, joint open"),
    ];
    let mut curves = Vec::new();
    for ((border, words), values) in words.into_iter().zip(&fields) {
        if !wanted.contains(&border) {
            continue;
        }
        let field = Field {
            x: &x,
            y: &y,
            values,
        };
        for points in field.lines(0.0) {
            curves.push(Curve {
                label: words.to_owned(),
                points,
            });
        }
    }
    curves
}

/// Finely spaced values of an axis over numbers.
fn places(axis: &Axis) -> Option<Vec<f64>> {
    if axis.times.is_some() {
        return None;
    }
    let parts = (0..POINTS).map(|i| f64::from(i) / f64::from(POINTS - 1));
    match &axis.spread {
        Spread::Range {
            from, to, scale, ..
        } => Some(
            parts
                .map(|part| match scale {
                    Scale::Log => log_between(*from, *to, part),
                    Scale::Linear => from + part * (to - from),
                })
                .collect(),
        ),
        Spread::List(_) | Spread::Random(_) => None,
    }
}
