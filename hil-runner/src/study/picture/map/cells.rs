//! The cells: colour, hatch, and a cross where a limit is not kept; and the bar
//! that says which colour is how much.

use super::grid::{Cell, Grid};
use super::{Axis, Frame, Hatch};
use crate::study::picture::canvas::{Anchor, Area, Canvas, Lettering, Point, Stroke};
use crate::study::picture::colour::{Colour, ColourScale, INK, MUTED, WHITE, ink_on};
use crate::study::picture::mark::{Mark, Shape};
use crate::study::picture::text::{AXIS_PX, LINE, TICK_PX, fold};

/// Crosses closer than this run into each other \[px\].
const CROSS_ROOM: f64 = 11.0;
/// Cells overlap by this \[px\]: with less than a pixel white shines through
/// where two edges share one.
const OVERLAP: f64 = 1.2;

/// Steps of colour.
const SHADES: f64 = 110.0;

/// Everything that a painting of cells needs.
pub(super) struct Painting<'a> {
    pub(super) frame: &'a Frame<'a>,
    pub(super) grid: &'a Grid,
    pub(super) z: &'a Axis,
    pub(super) colours: ColourScale,
    pub(super) states: &'a [&'a str],
}

/// The filling of a cell.
#[derive(Clone, Copy, PartialEq)]
enum Filling {
    Colour(Colour),
    Hatch(Hatch),
    /// No run: white, over what neighbours overlap.
    Nothing,
}

impl Painting<'_> {
    pub(super) fn draw(&self, canvas: &mut Canvas) {
        let (across, up) = self.size();
        for j in 0..up {
            let mut i = 0;
            while i < across {
                let filling = self.filling(i, j);
                // Neighbours of one colour are one rectangle.
                let first = i;
                while i < across && self.filling(i, j) == filling {
                    i += 1;
                }
                if let (Some(filling), Some(area)) = (filling, self.area(first, i, j)) {
                    self.fill(canvas, &area, filling);
                }
            }
        }
        self.draw_fails(canvas);
    }

    fn size(&self) -> (usize, usize) {
        (self.grid.x.values.len(), self.grid.y.values.len())
    }

    fn filling(&self, i: usize, j: usize) -> Option<Filling> {
        let cell = self.grid.cell(i, j)?;
        if let Some(state) = &cell.state {
            let at = self.states.iter().position(|known| known == state);
            return Some(Filling::Hatch(Hatch::of(at.unwrap_or(0))));
        }
        if cell.runs == 0 {
            return Some(Filling::Nothing);
        }
        Some(Filling::Colour(self.colour(cell)?))
    }

    fn colour(&self, cell: &Cell) -> Option<Colour> {
        // Steps that no eye can tell: neighbours alike become one rectangle.
        let share = (self.z.share(cell.z?)? * SHADES).round() / SHADES;
        Some(self.colours.at(share))
    }

    /// The cells from `first` to before `end` of a row, as far as they lie in
    /// the plot.
    fn area(&self, first: usize, end: usize, j: usize) -> Option<Area> {
        let (x, y) = (&self.grid.x.edges, &self.grid.y.edges);
        let plot = &self.frame.area;
        let across = |edge: f64| Some(self.frame.across(edge)?.clamp(plot.left, plot.right));
        let up = |edge: f64| Some(self.frame.up(edge)?.clamp(plot.top, plot.bottom));
        let area = Area::of(
            [across(*x.get(first)?)?, across(*x.get(end)?)?],
            [up(*y.get(j + 1)?)?, up(*y.get(j)?)?],
        );
        (area.width() > 0.0 && area.height() > 0.0).then_some(area)
    }

    fn fill(&self, canvas: &mut Canvas, area: &Area, filling: Filling) {
        let plot = &self.frame.area;
        match filling {
            Filling::Colour(colour) => {
                // What is drawn later lies to the right and above.
                let overlapping = Area {
                    right: (area.right + OVERLAP).min(plot.right),
                    top: (area.top - OVERLAP).max(plot.top),
                    ..*area
                };
                canvas.fill(&overlapping, colour);
            }
            Filling::Hatch(hatch) => hatch.draw(canvas, area),
            Filling::Nothing => canvas.fill(area, WHITE),
        }
    }

    /// A cross in the cells that fail; where cells are too small for that, in
    /// one of several, and a line around what fails.
    fn draw_fails(&self, canvas: &mut Canvas) {
        let (across, up) = self.size();
        let cell_px = cell_px(self.grid, &self.frame.area);
        let [every_x, every_y] = cell_px.map(stride);
        if every_x > 1 || every_y > 1 {
            self.draw_edge_of_fails(canvas);
        }
        let radius = (0.22 * cell_px[0].min(cell_px[1])).clamp(3.2, 6.0);
        for j in (0..up).step_by(every_y) {
            for i in (0..across).step_by(every_x) {
                let Some(cell) = self.grid.cell(i, j).filter(|cell| cell.fails) else {
                    continue;
                };
                let Some(area) = self.area(i, i + 1, j) else {
                    continue;
                };
                let mark = Mark::filled(Shape::Cross, self.colour(cell).map_or(INK, ink_on));
                let own = 0.45 * area.width().min(area.height());
                let room = if every_x.max(every_y) > 1 {
                    radius
                } else {
                    own
                };
                mark.draw(canvas, area.middle(), radius.min(room));
            }
        }
    }

    /// The sides between cells that fail and others.
    fn draw_edge_of_fails(&self, canvas: &mut Canvas) {
        let (across, up) = self.size();
        let fails = |i: usize, j: usize| self.grid.cell(i, j).is_some_and(|cell| cell.fails);
        let mut sides: Vec<[Point; 2]> = Vec::new();
        for j in 0..up {
            for i in 0..across {
                let Some(area) = self.area(i, i + 1, j) else {
                    continue;
                };
                if i + 1 < across && fails(i, j) != fails(i + 1, j) {
                    sides.push([(area.right, area.top), (area.right, area.bottom)]);
                }
                if j + 1 < up && fails(i, j) != fails(i, j + 1) {
                    sides.push([(area.left, area.top), (area.right, area.top)]);
                }
            }
        }
        for stroke in [Stroke::solid(WHITE, 2.6), Stroke::solid(INK, 1.0)] {
            for side in &sides {
                canvas.path(side, &stroke);
            }
        }
    }
}

/// Width and height of a cell, on average \[px\].
fn cell_px(grid: &Grid, plot: &Area) -> [f64; 2] {
    [
        plot.width() / grid.x.values.len().max(1) as f64,
        plot.height() / grid.y.values.len().max(1) as f64,
    ]
}

/// The remark on crosses that stand for several cells.
pub(super) fn note(grid: &Grid, plot: &Area) -> Option<String> {
    let [across, up] = cell_px(grid, plot).map(stride);
    let thinned = across.max(up) > 1 && grid.cells.iter().any(|cell| cell.fails);
    thinned.then(|| {
        format!(
            "One cross for {across} × {up} cells; a fine line runs along the edge of what fails."
        )
    })
}

/// Every how many cells of that size a cross has room.
fn stride(cell_px: f64) -> usize {
    (CROSS_ROOM / cell_px).ceil().clamp(1.0, 1e3) as usize
}

/// Room between plot and bar, width of the bar, ticks, room to the numbers.
const APART: f64 = 24.0;
const BAR: f64 = 18.0;
const TICK: f64 = 5.0;
const GAP: f64 = 6.0;
/// Steps of colour: more than an eye can tell on this height.
const STEPS: u32 = 110;

/// Room right of the plot \[px\].
pub(super) fn bar_room(z: &Axis, height_px: f64) -> f64 {
    let lines = fold(&z.title, AXIS_PX, height_px).len();
    APART + BAR + TICK + 2.0 * GAP + z.widest_px() + lines as f64 * AXIS_PX * LINE
}

/// Draws the bar beside the plot.
pub(super) fn draw_bar(canvas: &mut Canvas, plot: &Area, z: &Axis, colours: ColourScale) {
    let bar = Area {
        left: plot.right + APART,
        right: plot.right + APART + BAR,
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
    let lettering = Lettering::of(AXIS_PX, Anchor::Middle).upwards();
    let mut x = numbers + z.widest_px() + GAP;
    for line in fold(&z.title, AXIS_PX, bar.height()) {
        x += 0.5 * AXIS_PX * LINE;
        canvas.text(&line, (x, bar.middle().1), &lettering);
        x += 0.5 * AXIS_PX * LINE;
    }
}
