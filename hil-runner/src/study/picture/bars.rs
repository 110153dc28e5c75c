//! Kind `bars`: a figure by categories. The bars lie level, since names of any
//! length have room on their left and any number of bars below each other.

use super::axis::{Axis, Direction, Margin, Spacing, extent};
use super::canvas::{Anchor, Area, Canvas, Lettering, Stroke};
use super::colour::{Colour, INK, WHITE, series};
use super::frame::{Frame, room_below};
use super::group::{Different, Spread};
use super::label::Label;
use super::legend::{Entry, Group, Key};
use super::note::{Chosen, LeftOut};
use super::reference::{draw_limits, limit_entry, limits, with_limits};
use super::sheet::{EDGE, Sheet, WIDTH};
use super::spec::{Bars, Picture};
use super::text::{LINE, NOTE_PX, TICK_PX, fold, width};
use super::{PictureError, Table};
use hil_core::number;

/// Height of a bar, of the room between categories \[px\].
const BAR: f64 = 19.0;
const APART: f64 = 12.0;
/// Names are folded to this width \[px\].
const NAMES: f64 = 230.0;
/// More bars than this need another picture.
const MOST_BARS: usize = 400;

/// Categories, series and the values of their bars.
struct Data {
    categories: Different,
    series: Option<Different>,
    /// Category by category, one per series.
    bars: Vec<Option<Spread>>,
}

impl Data {
    fn of(
        bars: &Bars,
        table: &Table,
        rows: &[usize],
        left_out: &mut LeftOut,
    ) -> Result<Self, PictureError> {
        let categories = Different::of(table.column(&bars.category)?, rows)?;
        let series = bars.series.as_ref();
        let series = series.map(|name| Different::series(table.column(name)?, rows));
        let series = series.transpose()?;
        let count = series.as_ref().map_or(1, Different::len);
        if categories.len() * count > MOST_BARS {
            return Err(PictureError::new(format!(
                "{} bars are more than a picture can show; kind \"histogram\" or \"lines\" can",
                categories.len() * count
            )));
        }
        let values = table.column(&bars.y)?.numbers()?;
        let log = bars.y_axis.spacing == Spacing::Log;
        let mut of_bar: Vec<Vec<f64>> = vec![Vec::new(); categories.len() * count];
        for &row in rows {
            let within = series.as_ref().map_or(Some(0), |series| series.of_row[row]);
            left_out.of += 1;
            match (categories.of_row[row], within, values[row]) {
                (Some(_), Some(_), Some(value)) if log && value <= 0.0 => left_out.not_above_0 += 1,
                (Some(category), Some(within), Some(value)) => {
                    of_bar[category * count + within].push(value);
                }
                _ => left_out.missing += 1,
            }
        }
        left_out.shared = of_bar.iter().map(Vec::len).max().unwrap_or(0);
        Ok(Self {
            categories,
            series,
            bars: of_bar.into_iter().map(Spread::of).collect(),
        })
    }

    fn per_category(&self) -> usize {
        self.series.as_ref().map_or(1, |series| series.len().max(1))
    }

    fn colour(&self, at: usize) -> Colour {
        match &self.series {
            Some(names) => series(at, names.len(), names.numbers.is_some()),
            None => series(0, 1, false),
        }
    }

    fn spreads(&self) -> impl Iterator<Item = Spread> {
        self.bars.iter().filter_map(|bar| *bar)
    }
}

pub(super) fn draw(spec: &Picture, bars: &Bars, table: &Table) -> Result<String, PictureError> {
    let Chosen { rows, mut notes } = Chosen::of(spec, table)?;
    let mut left_out = LeftOut::default();
    let data = Data::of(bars, table, &rows, &mut left_out)?;
    let label = Label::of(&bars.y);
    let log = bars.y_axis.spacing == Spacing::Log;
    let span = extent(data.spreads().flat_map(|bar| [bar.low, bar.high]));
    let limits = limits(bars.limit.as_ref(), span, log);
    let names = data.categories.names.iter();
    let names: Vec<Vec<String>> = names.map(|name| fold(name, TICK_PX, NAMES)).collect();
    let widest = names.iter().flatten().map(|line| width(line, TICK_PX));
    let left = EDGE + widest.fold(0.0, f64::max) + 12.0;
    let right = WIDTH - EDGE - 12.0;
    // Room for the number behind the longest bar.
    let room = NUMBER_PX / (right - left);
    let span = with_limits(span, &limits, log).map(|span| with_room(span, room, log));
    let mut axis = Axis::new(&bars.y_axis, &label, span, Margin::None)?;
    axis.fit(right - left, Direction::Across);
    let beyond = |bar: &Spread| !(axis.holds(bar.low) && axis.holds(bar.high));
    left_out.beyond = data.spreads().filter(beyond).count();
    let groups = legend(bars, &data, &label);
    notes.extend(left_out.notes("Bars and numbers: medians, lines: smallest to largest"));
    let logarithmic = "The axis is logarithmic: compare where bars end, not how long they are.";
    notes.extend(log.then(|| logarithmic.to_owned()));
    let sheet = Sheet::new(&spec.title, &groups, &notes);
    let own = bars.category_label.clone();
    let heading = own.unwrap_or_else(|| Label::of(&bars.category).words);
    let top = sheet.top() + TICK_PX * LINE;
    let height = |lines: &Vec<String>| {
        let text = lines.len() as f64 * TICK_PX * LINE;
        APART + text.max(data.per_category() as f64 * BAR)
    };
    let heights: Vec<f64> = names.iter().map(height).collect();
    let tall = heights.iter().sum::<f64>().max(60.0);
    let y = Axis::of_places(String::new(), &[]);
    let frame = Frame::of([left, right], [top, top + tall], [&axis, &y]);
    let bottom = frame.area.bottom + room_below(&axis, right - left);
    sheet.draw(bottom, &spec.words(), |canvas: &mut Canvas| {
        let lettering = Lettering::of(TICK_PX, Anchor::Start).bold();
        canvas.text(&heading, (EDGE, top - 0.6 * TICK_PX), &lettering);
        frame.draw_grid(canvas);
        frame.draw_axes(canvas, true);
        let mut y = top;
        let mut placed = Vec::new();
        for ((lines, height), at) in names.iter().zip(&heights).zip(0_usize..) {
            draw_name(canvas, lines, (left - 10.0, y + 0.5 * height));
            let count = data.per_category();
            let mut bar_top = y + 0.5 * (height - count as f64 * BAR);
            for within in 0..count {
                let bar = data.bars.get(at * count + within).copied().flatten();
                placed.push((bar_top, bar, data.colour(within)));
                bar_top += BAR;
            }
            y += height;
        }
        for &(top, bar, colour) in &placed {
            draw_bar(canvas, &frame, top, bar, colour);
        }
        draw_limits(canvas, &frame, &limits, Direction::Across);
        for &(top, bar, _) in &placed {
            draw_number(canvas, &frame, top, bar);
        }
        if data.spreads().next().is_none() {
            frame.draw_nothing(canvas);
        }
    })
}

/// Room for the number behind a bar \[px\].
const NUMBER_PX: f64 = 74.0;

/// The span from 0 on (a logarithmic one from below the smallest bar), with
/// room for numbers behind the bars.
fn with_room((low, high): (f64, f64), room: f64, log: bool) -> (f64, f64) {
    if log {
        let grown = libm::pow(high / low, room / (1.0 - room));
        return (low / 2.0, high * grown.max(1.2));
    }
    let (low, high) = (low.min(0.0), high.max(0.0));
    let more = room / (1.0 - 2.0 * room) * (high - low);
    let below = if low < 0.0 { more } else { 0.0 };
    let above = if high > 0.0 { more } else { 0.0 };
    (low - below, high + above)
}

fn legend(bars: &Bars, data: &Data, label: &Label) -> Vec<Group> {
    let mut groups = Vec::new();
    if let (Some(column), Some(series)) = (&bars.series, &data.series) {
        let entries = series.names.iter().enumerate();
        let entries = entries.map(|(at, name)| Entry::new(Key::Field(data.colour(at)), name));
        let group = Group {
            heading: format!("{}:", Label::of(column).words),
            entries: entries.collect(),
        };
        groups.extend((!group.entries.is_empty()).then_some(group));
    }
    let limit = bars.limit.as_ref().map(|limit| limit_entry(limit, label));
    groups.extend(limit.map(|entry| Group::of(vec![entry])));
    groups
}

/// The name of a category beside its bars.
fn draw_name(canvas: &mut Canvas, lines: &[String], (right, middle): (f64, f64)) {
    let first = middle - 0.5 * (lines.len() as f64 - 1.0) * TICK_PX * LINE;
    let lettering = Lettering::of(TICK_PX, Anchor::End);
    canvas.lines(lines, (right, first), (TICK_PX * LINE, 0.0), &lettering);
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
fn draw_bar(canvas: &mut Canvas, frame: &Frame, top: f64, bar: Option<Spread>, colour: Colour) {
    let Some(bar) = bar else { return };
    let ends = Ends::of(frame, &bar);
    let field = Area::of(
        [ends.zero.min(ends.end), ends.zero.max(ends.end)],
        [top + 1.5, top + BAR - 1.5],
    );
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
fn draw_number(canvas: &mut Canvas, frame: &Frame, top: f64, bar: Option<Spread>) {
    let middle = top + 0.5 * BAR;
    let mut lettering = Lettering::of(NOTE_PX, Anchor::Start);
    let Some(bar) = bar else {
        let zero = frame.across(0.0).unwrap_or(frame.area.left);
        let start = zero.max(frame.area.left) + 5.0;
        return canvas.text(number::MISSING, (start, middle), &lettering);
    };
    let ends = Ends::of(frame, &bar);
    let text = number::rounded(bar.median * frame.x.factor, 3);
    let wide = width(&text, NOTE_PX);
    let (before, behind) = (ends.low.min(ends.end), ends.high.max(ends.end));
    let left = if bar.median < 0.0 && before - wide - 8.0 > frame.area.left {
        before - wide - 5.0
    } else if behind + wide + 8.0 < frame.area.right {
        behind + 5.0
    // The axis was given, and bar or spread fill it.
    } else if bar.median < 0.0 {
        frame.area.left + 4.0
    } else {
        frame.area.right - wide - 4.0
    };
    let ground = Area::of(
        [left - 1.0, left + wide + 1.0],
        [middle - 0.55 * NOTE_PX, middle + 0.55 * NOTE_PX],
    );
    canvas.fill(&ground, WHITE);
    let mut x = left;
    if bar.median < 0.0 && left < before {
        (lettering.anchor, x) = (Anchor::End, left + wide);
    }
    canvas.text(&text, (x, middle), &lettering);
}
