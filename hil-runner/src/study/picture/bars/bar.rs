//! One bar: name, length, spread, number.

use super::{BAR, Frame};
use crate::study::picture::canvas::{Anchor, Area, Canvas, Lettering, Stroke};
use crate::study::picture::colour::{Colour, INK, WHITE};
use crate::study::picture::group::Spread;
use crate::study::picture::text::{LINE, NOTE_PX, TICK_PX, width};
use hil_core::number;

/// The name of a category beside its bars.
pub(super) fn draw_name(canvas: &mut Canvas, lines: &[String], (right, middle): (f64, f64)) {
    let first = middle - 0.5 * (lines.len() as f64 - 1.0) * TICK_PX * LINE;
    let lettering = Lettering::of(TICK_PX, Anchor::End);
    for (line, row) in lines.iter().zip(0_u32..) {
        let y = first + TICK_PX * LINE * f64::from(row);
        canvas.text(line, (right, y), &lettering);
    }
}

/// Ends of a bar and of its spread on the sheet \[px\].
struct Ends {
    zero: f64,
    end: f64,
    low: f64,
    high: f64,
}

impl Ends {
    fn of(frame: &Frame, bar: &Spread) -> Self {
        let inside = |x: f64| x.clamp(frame.area.left, frame.area.right);
        let zero = inside(frame.across(0.0).unwrap_or(frame.area.left));
        let at = |value: f64| frame.across(value).map_or(zero, inside);
        Self {
            zero,
            end: at(bar.median),
            low: at(bar.low),
            high: at(bar.high),
        }
    }
}

/// A bar from 0 or the start of the axis, and its spread.
pub(super) fn draw_bar(
    canvas: &mut Canvas,
    frame: &Frame,
    top: f64,
    bar: Option<Spread>,
    colour: Colour,
) {
    let Some(bar) = bar else { return };
    let ends = Ends::of(frame, &bar);
    let field = Area {
        left: ends.zero.min(ends.end),
        top: top + 1.5,
        right: ends.zero.max(ends.end),
        bottom: top + BAR - 1.5,
    };
    canvas.fill(&field, colour);
    if ends.high > ends.low {
        let middle = top + 0.5 * BAR;
        for (width_px, colour) in [(3.4, WHITE), (1.4, INK)] {
            let stroke = Stroke::solid(colour, width_px);
            canvas.path(&[(ends.low, middle), (ends.high, middle)], &stroke);
            for x in [ends.low, ends.high] {
                canvas.path(&[(x, middle - 4.0), (x, middle + 4.0)], &stroke);
            }
        }
    }
}

/// The number behind a bar, on white: a limit's line may run there.
pub(super) fn draw_number(canvas: &mut Canvas, frame: &Frame, top: f64, bar: Option<Spread>) {
    let middle = top + 0.5 * BAR;
    let mut lettering = Lettering::of(NOTE_PX, Anchor::Start);
    let Some(bar) = bar else {
        let zero = frame.across(0.0).unwrap_or(frame.area.left);
        let start = zero.max(frame.area.left) + 5.0;
        return canvas.text(number::MISSING, (start, middle), &lettering);
    };
    let ends = Ends::of(frame, &bar);
    let text = number::rounded(bar.median * frame.x.factor(), 3);
    let wide = width(&text, NOTE_PX);
    let (before, behind) = (ends.low.min(ends.end), ends.high.max(ends.end));
    let left = if bar.median < 0.0 && before - wide - 8.0 > frame.area.left {
        before - wide - 5.0
    } else if behind + wide + 8.0 < frame.area.right {
        behind + 5.0
    } else {
        // The axis was given, and bar or spread fill it.
        match bar.median < 0.0 {
            true => frame.area.left + 4.0,
            false => frame.area.right - wide - 4.0,
        }
    };
    let ground = Area {
        left: left - 1.0,
        top: middle - 0.55 * NOTE_PX,
        right: left + wide + 1.0,
        bottom: middle + 0.55 * NOTE_PX,
    };
    canvas.fill(&ground, WHITE);
    if bar.median < 0.0 && left < before {
        lettering.anchor = Anchor::End;
        canvas.text(&text, (left + wide, middle), &lettering);
    } else {
        canvas.text(&text, (left, middle), &lettering);
    }
}
