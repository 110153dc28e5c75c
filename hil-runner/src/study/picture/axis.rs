//! One axis: title, scale from a number to its place, numbers.

use schemars::JsonSchema;
use serde::Deserialize;

use super::PictureError;
use super::label::Label;
use super::text::{LINE, TICK_PX, width};
use super::ticks::{LogNumbers, Tick, linear, logarithmic};
use super::unit::{Shown, Unit, decade_below, power_of_ten};
use hil_core::number::{self, significant};

/// Division of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Spacing {
    /// Evenly.
    #[default]
    Linear,
    /// By decades; what is not above 0 is left out.
    Log,
}

/// The keys of a picture for one of its axes.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
pub struct AxisKeys {
    /// Words instead of those of the column's name.
    pub label: Option<String>,
    /// Unit to show instead of the one that suits the numbers.
    pub unit: Option<String>,
    /// Its division.
    #[serde(default, rename = "scale")]
    pub spacing: Spacing,
    /// Its ends, in the column's unit, instead of those of the data.
    pub range: Option<[f64; 2]>,
}

/// Narrowest range of an axis, relative to its ends.
const NARROWEST: f64 = 1e-9;

impl AxisKeys {
    /// The keys, as they stand behind the name of the axis.
    pub(super) const NAMES: [&str; 4] = ["scale", "label", "unit", "range"];

    /// Holds the range of the axis of that name against its division.
    pub(super) fn check(&self, name: &str) -> Result<(), String> {
        let Some([low, high]) = self.range else {
            return Ok(());
        };
        let because = if !(low.is_finite() && high.is_finite() && low < high) {
            "must rise from a number to a larger one"
        } else if high - low < NARROWEST * low.abs().max(high.abs()) {
            "is too narrow: numbers on it could not be told apart"
        } else if self.spacing == Spacing::Log && low <= 0.0 {
            "must be above 0 on a logarithmic axis"
        } else {
            return Ok(());
        };
        Err(format!("{name}_range = [{low}, {high}] {because}"))
    }

    /// The words of the axis of a column with that label.
    pub(super) fn words(&self, label: &Label) -> String {
        self.label.as_ref().unwrap_or(&label.words).clone()
    }
}

/// Direction in which an axis runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    Across,
    Up,
}

/// An axis with its numbers; values go in in the column's unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// Words and shown unit.
    pub(super) title: String,
    pub(super) ticks: Vec<Tick>,
    /// Further lines of the grid, in the shown unit.
    pub(super) fine: Vec<f64>,
    scale: Scale,
    /// Shown number = number · factor.
    pub(super) factor: f64,
    numbers: LogNumbers,
}

impl Axis {
    /// An axis for a column whose values span `extent`.
    pub(super) fn new(
        keys: &AxisKeys,
        label: &Label,
        extent: Option<(f64, f64)>,
        margin: Margin,
    ) -> Result<Self, PictureError> {
        let unit = label.unit();
        let range = keys.range.map(|[low, high]| (low, high));
        let extent = range.or(extent).unwrap_or(match keys.spacing {
            Spacing::Linear => (0.0, 1.0),
            Spacing::Log => (1.0, 10.0),
        });
        let largest = extent.0.abs().max(extent.1.abs());
        let words = keys.words(label);
        let mut shown = match &keys.unit {
            Some(symbol) => unit.asked(&words, symbol)?,
            None => suited(&unit, keys.spacing, largest),
        };
        let numbers = match keys.spacing {
            Spacing::Log => log_numbers(&mut shown, extent, keys.unit.is_some()),
            Spacing::Linear => LogNumbers::Decimal,
        };
        let factor = power_of_ten(shown.shift);
        let (low, high) = (extent.0 * factor, extent.1 * factor);
        let scale = match (keys.spacing, keys.range) {
            (Spacing::Linear, Some(_)) => Scale::Linear(low, high),
            (Spacing::Log, Some(_)) => Scale::Log(low, high),
            (Spacing::Linear, None) => Scale::linear(low, high, margin),
            (Spacing::Log, None) => Scale::log(low, high, margin),
        };
        let unit = match numbers {
            LogNumbers::Prefixes(_) => String::new(),
            _ => shown.symbol,
        };
        Ok(Self {
            title: Label { words, unit }.title(),
            ticks: Vec::new(),
            fine: Vec::new(),
            scale,
            factor,
            numbers,
        })
    }

    /// An axis of places with names: value 0 is the middle of the first.
    pub(super) fn of_places(title: String, names: &[String]) -> Self {
        let ticks = names.iter().enumerate();
        let ticks = ticks.map(|(at, name)| Tick::new(at as f64, short(name)));
        Self {
            title,
            ticks: ticks.collect(),
            fine: Vec::new(),
            scale: Scale::Places(names.len().max(1)),
            factor: 1.0,
            numbers: LogNumbers::Decimal,
        }
    }

    /// True where its places have names.
    pub(super) fn has_places(&self) -> bool {
        matches!(self.scale, Scale::Places(_))
    }

    /// Finds the numbers that have room on `length` pixels.
    pub(super) fn fit(&mut self, length_px: f64, direction: Direction) {
        let fits = |ticks: &[Tick]| self.have_room(ticks, 16.0, length_px, direction);
        let per_tick = match direction {
            Direction::Across => 75.0,
            Direction::Up => 42.0,
        };
        let most = (length_px / per_tick).max(3.0) as usize;
        (self.ticks, self.fine) = match self.scale {
            Scale::Places(_) => return,
            Scale::Linear(low, high) => (linear(low, high, most, &fits), Vec::new()),
            Scale::Log(low, high) => logarithmic(low, high, self.numbers, most, &fits),
        };
        for tick in &mut self.ticks {
            if tick.label.chars().count() > LONGEST_NUMBER {
                tick.label = number::table(tick.at);
            }
        }
    }

    /// Takes these values for ticks if they are round and have room.
    pub(super) fn fit_values(&mut self, values: &[f64], length_px: f64, direction: Direction) {
        self.fit(length_px, direction);
        let round = |value: &f64| {
            let shown = value * self.factor;
            (significant(shown, 3) - shown).abs() <= 1e-9 * shown.abs()
        };
        let prefixes = matches!(self.numbers, LogNumbers::Prefixes(_));
        if self.has_places() || prefixes || values.is_empty() || !values.iter().all(round) {
            return;
        }
        let ticks = values.iter().map(|value| value * self.factor);
        let ticks = ticks.map(|at| Tick::new(at, number::rounded(at, 3)));
        let ticks: Vec<Tick> = ticks.collect();
        if self.have_room(&ticks, 12.0, length_px, direction) {
            (self.ticks, self.fine) = (ticks, Vec::new());
        }
    }

    /// True of ticks whose numbers stand apart: side by side by `gap_px`, one above
    /// the other by a line.
    fn have_room(&self, ticks: &[Tick], gap_px: f64, length_px: f64, direction: Direction) -> bool {
        let least_px = |a: &Tick, b: &Tick| match direction {
            Direction::Across => gap_px + 0.5 * (a.width() + b.width()),
            Direction::Up => TICK_PX * LINE,
        };
        let pairs = ticks.iter().zip(ticks.iter().skip(1));
        let px =
            |from: &Tick, to: &Tick| (self.of_shown(to.at) - self.of_shown(from.at)) * length_px;
        pairs.into_iter().all(|(a, b)| px(a, b) >= least_px(a, b))
    }

    /// Share of the axis at a value, 0 at its start and 1 at its end; `None`
    /// for what a logarithmic axis does not have.
    pub(super) fn share(&self, value: f64) -> Option<f64> {
        if matches!(self.scale, Scale::Log(..)) && value <= 0.0 {
            return None;
        }
        Some(self.of_shown(value * self.factor)).filter(|share| share.is_finite())
    }

    /// The same for a value in the shown unit.
    pub(super) fn of_shown(&self, shown: f64) -> f64 {
        self.scale.share(shown)
    }

    /// True of a value that lies on the axis.
    pub(super) fn holds(&self, value: f64) -> bool {
        // Rounding alone must not throw out an end.
        let slack = 1e-9;
        let share = self.share(value);
        share.is_some_and(|share| (-slack..=1.0 + slack).contains(&share))
    }

    /// Width of the widest number \[px\].
    pub(super) fn widest_px(&self) -> f64 {
        self.ticks.iter().map(Tick::width).fold(0.0, f64::max)
    }
}

/// Characters of a number, and width of a name \[px\], that a plot leaves room
/// for.
const LONGEST_NUMBER: usize = 16;
const WIDEST_NAME_PX: f64 = 300.0;

/// A name with its end left out where it is long.
fn short(name: &str) -> String {
    let mut start = name.to_owned();
    while width(&start, TICK_PX) > WIDEST_NAME_PX {
        start.truncate(start.floor_char_boundary(start.len() * 9 / 10));
    }
    if start.len() < name.len() {
        start.push('…');
    }
    start
}

/// A logarithmic axis takes no power of ten: its numbers are powers already.
fn suited(unit: &Unit, spacing: Spacing, largest: f64) -> Shown {
    let shown = unit.suited(largest);
    match (spacing, shown.base) {
        (Spacing::Log, None) => unit.plain(),
        _ => shown,
    }
}

/// The form in which the numbers of a logarithmic axis, from one end to the
/// other, read best.
fn log_numbers(shown: &mut Shown, extent: (f64, f64), asked: bool) -> LogNumbers {
    let factor = power_of_ten(shown.shift);
    let ends = [extent.0, extent.1].map(|end| decade_below((end * factor).abs()));
    let wide = |least: i32, most: i32| ends[0] < least || ends[1] > most;
    match shown.base {
        Some((base, power)) if !asked && wide(-2, 4) => {
            // From here on in the base unit; each number has its own prefix.
            shown.shift += power;
            LogNumbers::Prefixes(base)
        }
        _ if wide(-4, 4) => LogNumbers::Powers,
        _ => LogNumbers::Decimal,
    }
}

/// Ends of an axis if the picture does not give them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Margin {
    /// A little before and behind the data.
    Around,
    /// The same, but from 0 if the data come near it.
    FromZero,
    /// With the data.
    None,
}

/// Ends in the shown unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scale {
    Linear(f64, f64),
    Log(f64, f64),
    /// That many places of equal width.
    Places(usize),
}

/// Share of an axis that is left free at either end.
const FREE: f64 = 0.04;

impl Scale {
    /// An even scale for data that span from `low` to `high`.
    pub(super) fn linear(low: f64, high: f64, margin: Margin) -> Self {
        let size = low.abs().max(high.abs());
        // One value, or values that differ by rounding alone.
        let (low, high) = if high - low > 1e-12 * size {
            (low, high)
        } else if size == 0.0 {
            return Self::Linear(0.0, 1.0);
        } else {
            (low - 0.1 * size, high + 0.1 * size)
        };
        let free = FREE * (high - low);
        match margin {
            Margin::None => Self::Linear(low, high),
            Margin::FromZero if low >= 0.0 && low < 0.5 * high => {
                Self::Linear(0.0, high + FREE * high)
            }
            Margin::FromZero if high <= 0.0 && high > 0.5 * low => {
                Self::Linear(low + FREE * low, 0.0)
            }
            // No axis shows negative times because of a margin.
            _ if low >= 0.0 => Self::Linear((low - free).max(0.0), high + free),
            _ => Self::Linear(low - free, high + free),
        }
    }

    /// A logarithmic scale for data above 0.
    pub(super) fn log(low: f64, high: f64, margin: Margin) -> Self {
        let span = libm::log10(high / low);
        let (low, high, span) = if span > 1e-9 {
            (low, high, span)
        } else {
            (low / 3.0, high * 3.0, 1.0)
        };
        let free = match margin {
            Margin::None => 1.0,
            _ => libm::pow(10.0, FREE * span),
        };
        Self::Log(low / free, high * free)
    }

    /// Share of the axis at a number, 0 at its start and 1 at its end.
    pub(super) fn share(self, shown: f64) -> f64 {
        match self {
            Self::Linear(low, high) => (shown - low) / (high - low),
            Self::Log(low, high) => {
                let (from, to) = (libm::log10(low), libm::log10(high));
                (libm::log10(shown) - from) / (to - from)
            }
            Self::Places(count) => (shown + 0.5) / count as f64,
        }
    }
}

/// Smallest and largest of some numbers.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().fold(None, |found, value| match found {
        None => Some((value, value)),
        Some((low, high)) => Some((f64::min(low, value), f64::max(high, value))),
    })
}
