//! One axis: title, scale, numbers.

use serde::Deserialize;

use super::label::Label;
use super::power::{decade_below, power_of_ten};
use super::scale::Scale;
pub(super) use super::scale::{Margin, extent};
use super::text::{LINE, TICK_PX, width};
use super::ticks::{LogNumbers, Tick, linear, logarithmic};
use super::unit::{Shown, Unit};
use super::{PictureError, table::Column};
use hil_core::number::{self, significant};

/// How an axis is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Spacing {
    /// Evenly.
    #[default]
    Linear,
    /// By decades; what is not above 0 is left out.
    Log,
}

/// What a picture may say about an axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AxisKeys {
    /// Words instead of those of the column's name.
    pub label: Option<String>,
    /// Unit to show instead of the one that suits the numbers.
    pub unit: Option<String>,
    /// How it is divided.
    pub spacing: Spacing,
    /// Its ends, in the column's unit, instead of those of the data.
    pub range: Option<(f64, f64)>,
}

/// Which way an axis runs.
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
    factor: f64,
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
        let extent = keys.range.or(extent).unwrap_or(match keys.spacing {
            Spacing::Linear => (0.0, 1.0),
            Spacing::Log => (1.0, 10.0),
        });
        let largest = extent.0.abs().max(extent.1.abs());
        let mut shown = match &keys.unit {
            Some(symbol) => unit.asked(&label.words, symbol)?,
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
        let words = keys.label.clone().unwrap_or_else(|| label.words.clone());
        let symbol = match numbers {
            LogNumbers::Prefixes(_) => String::new(),
            _ => shown.symbol,
        };
        let title = Label {
            words,
            unit: symbol,
        }
        .title();
        Ok(Self {
            title,
            ticks: Vec::new(),
            fine: Vec::new(),
            scale,
            factor,
            numbers,
        })
    }

    /// An axis of places with names: value 0 is the middle of the first.
    pub(super) fn of_places(title: String, names: &[String]) -> Self {
        let ticks = names.iter().enumerate().map(|(at, name)| Tick {
            at: at as f64,
            label: short(name),
        });
        Self {
            title,
            ticks: ticks.collect(),
            fine: Vec::new(),
            scale: Scale::Places(names.len().max(1)),
            factor: 1.0,
            numbers: LogNumbers::Decimal,
        }
    }

    /// Whether its places have names.
    pub(super) fn has_places(&self) -> bool {
        matches!(self.scale, Scale::Places(_))
    }

    /// Finds the numbers that have room on `length` pixels.
    pub(super) fn fit(&mut self, length_px: f64, direction: Direction) {
        let gap = match direction {
            Direction::Across => 16.0,
            Direction::Up => TICK_PX * LINE,
        };
        let extent = |tick: &Tick| match direction {
            Direction::Across => width(&tick.label, TICK_PX),
            Direction::Up => 0.0,
        };
        let fits = |ticks: &[Tick]| {
            ticks.windows(2).all(|pair| match pair {
                [a, b] => {
                    let apart = (self.of_shown(b.at) - self.of_shown(a.at)) * length_px;
                    apart >= gap + 0.5 * (extent(a) + extent(b))
                }
                _ => true,
            })
        };
        let per_tick = match direction {
            Direction::Across => 75.0,
            Direction::Up => 42.0,
        };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a length on the sheet"
        )]
        let most = (length_px / per_tick).max(3.0) as usize;
        let (ticks, fine) = match self.scale {
            Scale::Places(_) => return,
            Scale::Linear(low, high) => (linear(low, high, most, &fits), Vec::new()),
            Scale::Log(low, high) => logarithmic(low, high, self.numbers, most, &fits),
        };
        (self.ticks, self.fine) = (ticks, fine);
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
        let ticks: Vec<Tick> = values
            .iter()
            .map(|value| Tick {
                at: value * self.factor,
                label: number::rounded(value * self.factor, 3),
            })
            .collect();
        let room = match direction {
            Direction::Across => 12.0,
            Direction::Up => TICK_PX * LINE,
        };
        let fits = ticks.windows(2).all(|pair| match pair {
            [a, b] => {
                let apart = (self.of_shown(b.at) - self.of_shown(a.at)) * length_px;
                let wide = match direction {
                    Direction::Across => {
                        0.5 * (width(&a.label, TICK_PX) + width(&b.label, TICK_PX))
                    }
                    Direction::Up => 0.0,
                };
                apart >= room + wide
            }
            _ => true,
        });
        if fits {
            (self.ticks, self.fine) = (ticks, Vec::new());
        }
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

    /// Whether a value lies on the axis.
    pub(super) fn holds(&self, value: f64) -> bool {
        // Rounding alone must not throw out an end.
        let slack = 1e-9;
        self.share(value)
            .is_some_and(|share| (-slack..=1.0 + slack).contains(&share))
    }

    /// Shown number over number.
    pub(super) fn factor(&self) -> f64 {
        self.factor
    }

    /// Width of the widest number \[px\].
    pub(super) fn widest_px(&self) -> f64 {
        let widths = self.ticks.iter().map(|tick| width(&tick.label, TICK_PX));
        widths.fold(0.0, f64::max)
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

/// How the numbers from one end of a logarithmic axis to the other read best.
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

/// Label of a column, or the words that the picture has for it.
pub(super) fn label_of(column: &Column, words: Option<&String>) -> Label {
    let label = Label::of(&column.name);
    match words {
        Some(words) => Label {
            words: words.clone(),
            ..label
        },
        None => label,
    }
}
