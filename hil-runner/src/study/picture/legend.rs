//! The legend: rows above the plots, never over the data.

use super::canvas::{Anchor, Area, Canvas, Lettering, Point, Stroke};
use super::colour::{Colour, INK, WHITE};
use super::mark::{Hatch, Mark, RADIUS};
use super::text::{LINE, TICK_PX, bold_width, fold, width};

/// The sign before the words of an entry.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Key {
    /// A line, with the marks of its points if it has any.
    Line(Stroke, Option<Mark>),
    /// A line with light edges over a colour, as in a map.
    Cased(Stroke, Colour),
    /// A mark alone.
    Mark(Mark),
    /// A field of colour.
    Field(Colour),
    /// A hatched field.
    Hatched(Hatch),
}

/// One entry.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) key: Key,
    pub(super) words: String,
}

/// Entries that belong together, under a common word.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Group {
    pub(super) heading: String,
    pub(super) entries: Vec<Entry>,
}

impl Entry {
    pub(super) fn new(key: Key, words: impl Into<String>) -> Self {
        let words = words.into();
        Self { key, words }
    }
}

impl Group {
    /// Entries without a common word.
    pub(super) fn of(entries: Vec<Entry>) -> Self {
        let heading = String::new();
        Self { heading, entries }
    }
}

/// Width of a key and the room behind it \[px\].
const KEY: f64 = 34.0;
const KEY_GAP: f64 = 7.0;
/// Room between two entries of a row \[px\].
const BETWEEN: f64 = 22.0;
/// Height of a line of the legend \[px\].
const ROW: f64 = TICK_PX * LINE + 2.0;

/// A legend whose places are found.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Legend {
    placed: Vec<Placed>,
    /// Height of the whole \[px\].
    pub(super) height: f64,
}

#[derive(Debug, Clone, PartialEq)]
struct Placed {
    key: Option<Key>,
    lines: Vec<String>,
    /// Left end and middle of the first line, from the legend's corner \[px\].
    at: Point,
}

impl Legend {
    /// Finds places for the groups, each beginning a row, within a width.
    pub(super) fn new(groups: &[Group], width_px: f64) -> Self {
        let mut legend = Self::default();
        for group in groups {
            legend.place(group, width_px);
        }
        legend
    }

    fn place(&mut self, group: &Group, width_px: f64) {
        let mut left = 0.0;
        let mut top = self.height;
        if !group.heading.is_empty() {
            let lines = fold(&group.heading, TICK_PX, width_px / 1.2);
            let wide = lines.iter().map(|line| bold_width(line, TICK_PX));
            let wide = wide.fold(0.0, f64::max);
            let rows = lines.len();
            self.placed.push(Placed {
                key: None,
                lines,
                at: (0.0, top + 0.5 * ROW),
            });
            // A long heading has its rows for itself.
            if rows > 1 || wide > 0.4 * width_px {
                top += rows as f64 * ROW;
                self.height = top;
            } else {
                left = wide + 14.0;
            }
        }
        let room = width_px - left;
        let folded = |entry: &Entry| {
            let lines = fold(&entry.words, TICK_PX, room - KEY - KEY_GAP);
            let wide = lines.iter().map(|line| width(line, TICK_PX));
            let wide = KEY + KEY_GAP + wide.fold(0.0, f64::max);
            (lines, wide)
        };
        let entries: Vec<_> = group.entries.iter().map(folded).collect();
        let all: f64 = entries.iter().map(|(_, wide)| wide + BETWEEN).sum();
        // One row, or rows in columns where the entries are about as wide.
        let widest = entries.iter().map(|(_, wide)| wide + BETWEEN);
        let widest = widest.fold(1.0, f64::max);
        let even = widest * entries.len() as f64 <= 1.25 * all;
        let column = (all - BETWEEN > room && even).then_some(widest);
        let (mut x, mut row_height) = (0.0, 0.0);
        for (entry, (lines, wide)) in group.entries.iter().zip(entries) {
            if x > 0.0 && x + wide > room {
                (x, top) = (0.0, top + row_height);
                row_height = 0.0;
            }
            row_height = f64::max(row_height, lines.len() as f64 * ROW);
            self.placed.push(Placed {
                key: Some(entry.key.clone()),
                lines,
                at: (left + x, top + 0.5 * ROW),
            });
            x += column.unwrap_or(wide + BETWEEN);
            self.height = f64::max(self.height, top + row_height);
        }
        if left > 0.0 {
            self.height = f64::max(self.height, top + ROW);
        }
    }

    /// Draws the legend with its corner at a point.
    pub(super) fn draw(&self, canvas: &mut Canvas, corner: Point) {
        for placed in &self.placed {
            let (x, y) = (corner.0 + placed.at.0, corner.1 + placed.at.1);
            let mut lettering = Lettering::of(TICK_PX, Anchor::Start);
            lettering.bold = placed.key.is_none();
            let indent = match &placed.key {
                Some(key) => {
                    key.draw(canvas, x, y);
                    KEY + KEY_GAP
                }
                None => 0.0,
            };
            canvas.lines(&placed.lines, (x + indent, y), (ROW, 0.0), &lettering);
        }
    }
}

impl Key {
    /// Draws the key from `x` on, about the line `y`.
    fn draw(&self, canvas: &mut Canvas, x: f64, y: f64) {
        let field = Area::of([x + 6.0, x + KEY - 4.0], [y - 7.0, y + 7.0]);
        let line = [(x, y), (x + KEY, y)];
        match self {
            Self::Line(stroke, mark) => {
                canvas.path(&line, stroke);
                if let Some(mark) = mark {
                    mark.draw(canvas, (x + 0.5 * KEY, y), RADIUS);
                }
            }
            Self::Cased(stroke, ground) => {
                let field = Area {
                    left: x,
                    right: x + KEY,
                    ..field
                };
                canvas.fill(&field, *ground);
                canvas.path(&line, &Stroke::solid(WHITE, stroke.width_px + 2.4));
                canvas.path(&line, stroke);
            }
            Self::Mark(mark) => mark.draw(canvas, (x + 0.5 * KEY, y), RADIUS),
            Self::Field(colour) => {
                canvas.fill(&field, *colour);
                canvas.outline(&field, &Stroke::solid(INK, 0.8));
            }
            Self::Hatched(hatch) => {
                hatch.draw(canvas, &field);
                canvas.outline(&field, &Stroke::solid(INK, 0.8));
            }
        }
    }
}
