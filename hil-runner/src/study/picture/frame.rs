//! A plot's frame: ground, grid, numbers, titles.

use super::axis::Axis;
use super::canvas::{Anchor, Area, Canvas, Lettering, Point, Stroke};
use super::colour::{FINE_GRID, GRID, MUTED};
use super::text::{AXIS_PX, LINE, TICK_PX, bold_width, fold, width};
use super::ticks::Tick;

/// Length of a tick \[px\].
const TICK: f64 = 5.0;
/// Room between numbers and what is beside them \[px\].
const GAP: f64 = 8.0;

/// A plot with its axes.
pub(super) struct Frame<'a> {
    pub(super) area: Area,
    pub(super) x: &'a Axis,
    pub(super) y: &'a Axis,
}

/// Room that an axis' numbers and title take \[px\].
pub(super) fn room_left(y: &Axis, height_px: f64) -> f64 {
    let lines = fold(&y.title, AXIS_PX, height_px).len();
    TICK + y.widest_px() + 2.0 * GAP + lines as f64 * AXIS_PX * LINE
}

/// Room below the plot \[px\], by whether x has numbers at all.
pub(super) fn room_below(x: &Axis, width_px: f64) -> f64 {
    let lines = fold(&x.title, AXIS_PX, width_px).len();
    TICK + x_numbers_px(x, width_px) + GAP + lines as f64 * AXIS_PX * LINE + 6.0
}

/// Height of the numbers or names along x \[px\].
fn x_numbers_px(x: &Axis, width_px: f64) -> f64 {
    if !x.has_places() {
        return TICK_PX * LINE;
    }
    let slot = slot_px(x, width_px);
    if turned(x, width_px) {
        return x.widest_px() + GAP;
    }
    let labels = x.ticks.iter().map(|tick| &tick.label);
    let lines = labels.map(|label| fold(label, TICK_PX, slot).len());
    lines.max().unwrap_or(1) as f64 * TICK_PX * LINE
}

fn slot_px(x: &Axis, width_px: f64) -> f64 {
    (width_px / x.ticks.len().max(1) as f64 - GAP).max(1.0)
}

/// True of names along x that are too wide to stand level: a word would break, or
/// need more than three lines.
fn turned(x: &Axis, width_px: f64) -> bool {
    let slot = slot_px(x, width_px);
    x.ticks.iter().any(|tick| {
        let mut words = tick.label.split(' ');
        words.any(|word| width(word, TICK_PX) > slot) || fold(&tick.label, TICK_PX, slot).len() > 3
    })
}

impl<'a> Frame<'a> {
    /// The frame with these ends across and up.
    pub(super) const fn of(across: [f64; 2], up: [f64; 2], [x, y]: [&'a Axis; 2]) -> Self {
        let area = Area::of(across, up);
        Self { area, x, y }
    }

    /// The point of two values; `None` for what an axis does not have.
    pub(super) fn point(&self, x: f64, y: f64) -> Option<Point> {
        Some((self.across(x)?, self.up(y)?))
    }

    /// Place of a value of x \[px\].
    pub(super) fn across(&self, x: f64) -> Option<f64> {
        Some(self.area.left + self.x.share(x)? * self.area.width())
    }

    /// Place of a value of y \[px\].
    pub(super) fn up(&self, y: f64) -> Option<f64> {
        Some(self.area.bottom - self.y.share(y)? * self.area.height())
    }

    fn at_x(&self, shown: f64) -> f64 {
        self.area.left + self.x.of_shown(shown) * self.area.width()
    }

    fn at_y(&self, shown: f64) -> f64 {
        self.area.bottom - self.y.of_shown(shown) * self.area.height()
    }

    /// The grid, which lies under everything.
    pub(super) fn draw_grid(&self, canvas: &mut Canvas) {
        let area = &self.area;
        for (colour, fine) in [(FINE_GRID, true), (GRID, false)] {
            let stroke = Stroke::solid(colour, 1.0);
            for at in places(self.x, fine) {
                let x = self.at_x(at);
                canvas.path(&[(x, area.top), (x, area.bottom)], &stroke);
            }
            for at in places(self.y, fine) {
                let y = self.at_y(at);
                canvas.path(&[(area.left, y), (area.right, y)], &stroke);
            }
        }
    }

    /// The frame with its numbers; those of x only where nothing stands below.
    pub(super) fn draw_axes(&self, canvas: &mut Canvas, lowest: bool) {
        let area = &self.area;
        let stroke = Stroke::solid(MUTED, 1.2);
        canvas.outline(area, &stroke);
        self.draw_up(canvas, &stroke);
        for tick in &self.x.ticks {
            let x = self.at_x(tick.at);
            if !self.x.has_places() {
                canvas.path(&[(x, area.bottom), (x, area.bottom + TICK)], &stroke);
            }
        }
        if lowest {
            self.draw_across(canvas);
        }
    }

    fn draw_up(&self, canvas: &mut Canvas, stroke: &Stroke) {
        let area = &self.area;
        let lettering = Lettering::of(TICK_PX, Anchor::End);
        for tick in &self.y.ticks {
            let y = self.at_y(tick.at);
            if !self.y.has_places() {
                canvas.path(&[(area.left - TICK, y), (area.left, y)], stroke);
            }
            canvas.text(&tick.label, (area.left - TICK - GAP * 0.5, y), &lettering);
        }
        let lettering = Lettering::of(AXIS_PX, Anchor::Middle).upwards();
        let lines = fold(&self.y.title, AXIS_PX, area.height());
        let middle = area.middle().1;
        let mut x = area.left - TICK - GAP * 1.5 - self.y.widest_px();
        for line in lines.iter().rev() {
            x -= 0.5 * AXIS_PX * LINE;
            canvas.text(line, (x, middle), &lettering);
            x -= 0.5 * AXIS_PX * LINE;
        }
    }

    fn draw_across(&self, canvas: &mut Canvas) {
        let area = &self.area;
        let top = area.bottom + TICK;
        let turned = self.x.has_places() && turned(self.x, area.width());
        for tick in &self.x.ticks {
            let x = self.at_x(tick.at);
            if turned {
                let lettering = Lettering::of(TICK_PX, Anchor::End).upwards();
                canvas.text(&tick.label, (x, top + 2.0), &lettering);
                continue;
            }
            let lines = if self.x.has_places() {
                fold(&tick.label, TICK_PX, slot_px(self.x, area.width()))
            } else {
                vec![tick.label.clone()]
            };
            let lettering = Lettering::of(TICK_PX, Anchor::Middle);
            canvas.lines(&lines, (x, top), (TICK_PX * LINE, 0.6), &lettering);
        }
        let below = top + x_numbers_px(self.x, area.width()) + GAP;
        let lettering = Lettering::of(AXIS_PX, Anchor::Middle);
        let lines = fold(&self.x.title, AXIS_PX, area.width());
        let corner = (area.middle().0, below);
        canvas.lines(&lines, corner, (AXIS_PX * LINE, 0.4), &lettering);
    }

    /// Writes into a plot that has no value to show.
    pub(super) fn draw_nothing(&self, canvas: &mut Canvas) {
        let lettering = Lettering::of(AXIS_PX, Anchor::Middle).muted();
        canvas.text("No value to show", self.area.middle(), &lettering);
    }
}

/// Places of an axis' lines in the grid; names have none.
fn places(axis: &Axis, fine: bool) -> Vec<f64> {
    if axis.has_places() {
        Vec::new()
    } else if fine {
        axis.fine.clone()
    } else {
        axis.ticks.iter().map(|tick| tick.at).collect()
    }
}

/// Room right of a plot for half of the last number along x \[px\].
pub(super) fn room_right(x: &Axis) -> f64 {
    let last = x.ticks.last().map_or(0.0, Tick::width);
    (0.5 * last + 6.0).max(22.0)
}

/// Folds a title in bold.
pub(super) fn fold_bold(text: &str, size_px: f64, line_px: f64) -> Vec<String> {
    let factor = bold_width("n", 1.0) / width("n", 1.0);
    fold(text, size_px, line_px / factor)
}
