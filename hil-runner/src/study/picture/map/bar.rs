//! The bar that says which colour is how much.

use super::cells::OVERLAP;
use crate::study::picture::axis::Axis;
use crate::study::picture::canvas::{Anchor, Area, Canvas, Lettering, Stroke};
use crate::study::picture::colour::{ColourScale, MUTED};
use crate::study::picture::text::{AXIS_PX, LINE, TICK_PX, fold};

/// Room between plot and bar, width of the bar, ticks, room to the numbers.
const APART: f64 = 24.0;
const WIDTH: f64 = 18.0;
const TICK: f64 = 5.0;
const GAP: f64 = 6.0;
/// Steps of colour: more than an eye can tell on this height.
const STEPS: u32 = 110;

/// Room right of the plot \[px\].
pub(super) fn room(z: &Axis, height_px: f64) -> f64 {
    let lines = fold(&z.title, AXIS_PX, height_px).len();
    APART + WIDTH + TICK + 2.0 * GAP + z.widest_px() + lines as f64 * AXIS_PX * LINE
}

/// Draws the bar beside the plot.
pub(super) fn draw(canvas: &mut Canvas, plot: &Area, z: &Axis, colours: ColourScale) {
    let bar = Area {
        left: plot.right + APART,
        right: plot.right + APART + WIDTH,
        ..*plot
    };
    let step = bar.height() / f64::from(STEPS);
    for at in 0..STEPS {
        let bottom = bar.bottom - step * f64::from(at);
        let field = Area {
            // A little more, which the next step covers: no seams.
            top: (bottom - step - OVERLAP).max(bar.top),
            bottom,
            ..bar
        };
        let share = (f64::from(at) + 0.5) / f64::from(STEPS);
        canvas.fill(&field, colours.at(share));
    }
    let stroke = Stroke::solid(MUTED, 1.2);
    canvas.outline(&bar, &stroke);
    let numbers = bar.right + TICK + GAP * 0.5;
    for tick in &z.ticks {
        let y = bar.bottom - z.of_shown(tick.at) * bar.height();
        canvas.path(&[(bar.right, y), (bar.right + TICK, y)], &stroke);
        let lettering = Lettering::of(TICK_PX, Anchor::Start);
        canvas.text(&tick.label, (numbers, y), &lettering);
    }
    let mut lettering = Lettering::of(AXIS_PX, Anchor::Middle);
    lettering.upwards = true;
    let mut x = numbers + z.widest_px() + GAP;
    for line in fold(&z.title, AXIS_PX, bar.height()) {
        x += 0.5 * AXIS_PX * LINE;
        canvas.text(&line, (x, bar.middle().1), &lettering);
        x += 0.5 * AXIS_PX * LINE;
    }
}
