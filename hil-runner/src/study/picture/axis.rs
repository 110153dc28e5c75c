//! One axis: title, unit, ends, numbers.

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::PictureError;
use super::label::Label;
use super::unit::{decade_below, power_of_ten};
use hil_core::number::significant;

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

/// Smallest and largest of some values.
pub(super) type Span = (f64, f64);

/// An axis; values go in in the column's unit, and the specification has those of
/// the shown unit.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Axis {
    /// Words and shown unit.
    pub(super) title: String,
    /// Ends in the shown unit.
    pub(super) ends: (f64, f64),
    pub(super) log: bool,
    /// Names of places: value 0 is the first.
    pub(super) names: Option<Vec<String>>,
    /// Shown number = number · 10^`shift`.
    shift: i32,
    /// Numbers in the place of the usual ones.
    ticks: Option<Vec<f64>>,
    /// Numbers between whole ones would mean nothing.
    is_whole: bool,
    /// Lacks its title and numbers: they stand below the last of several plots only.
    pub(super) is_bare: bool,
}

impl Axis {
    /// An axis for a column whose values span `extent`.
    pub(super) fn new(
        keys: &AxisKeys,
        label: &Label,
        extent: Option<Span>,
        margin: Margin,
    ) -> Result<Self, PictureError> {
        let unit = label.unit();
        let range = keys.range.map(|[low, high]| (low, high));
        let log = keys.spacing == Spacing::Log;
        let usual = if log { (1.0, 10.0) } else { (0.0, 1.0) };
        let extent = range.or(extent).unwrap_or(usual);
        let words = keys.words(label);
        if words.chars().count() > MOST_LETTERS {
            return Err(PictureError::new(
                "the words beside the plot leave no room for it",
            ));
        }
        let (shift, unit) = match &keys.unit {
            Some(symbol) => unit.asked(&words, symbol)?,
            // A logarithmic axis takes the unit of its middle, and no power of ten: its
            // numbers are powers already.
            None if log => unit.suited(extent.0.sqrt() * extent.1.sqrt(), false),
            None => unit.suited(extent.0.abs().max(extent.1.abs()), true),
        };
        let (low, high) = (scaled(extent.0, shift), scaled(extent.1, shift));
        let ends = match (log, range) {
            (_, Some(_)) => (low, high),
            (false, None) => linear(low, high, margin),
            (true, None) => logarithmic(low, high, margin),
        };
        Ok(Self {
            title: Label { words, unit }.title(),
            ends,
            log,
            shift,
            ticks: log.then(|| log_ticks(ends)),
            ..Self::default()
        })
    }

    /// An axis of places with names.
    pub(super) fn of_places(title: String, names: Vec<String>) -> Self {
        let count = names.len().max(1) as f64;
        Self {
            title,
            ends: (-0.5, count - 0.5),
            ticks: Some((0..names.len()).map(|at| at as f64).collect()),
            names: Some(names),
            ..Self::default()
        }
    }

    /// The axis of a column with these values: no numbers between whole ones.
    pub(super) fn of_values(mut self, values: impl IntoIterator<Item = f64>) -> Self {
        self.is_whole = values
            .into_iter()
            .all(|value| self.shown(value).fract() == 0.0);
        self
    }

    /// Has numbers at these values, if they are few and round.
    pub(super) fn with_ticks(self, values: &[f64]) -> Self {
        let shown: Vec<f64> = values.iter().map(|&value| self.shown(value)).collect();
        let mut axis = self.of_values(values.iter().copied());
        let round = |&value: &f64| (significant(value, 3) - value).abs() <= 1e-9 * value.abs();
        if (2..=MOST_TICKS).contains(&shown.len()) && shown.iter().all(round) {
            axis.ticks = Some(shown);
        }
        axis
    }

    /// A value in the shown unit, without the digits that rounding adds.
    pub(super) fn shown(&self, value: f64) -> f64 {
        significant(scaled(value, self.shift), self.digits())
    }

    /// Digits of a number on this axis: 10⁻⁷ of it can be told apart.
    fn digits(&self) -> usize {
        let (low, high) = self.ends;
        let size = low.abs().max(high.abs());
        let lost = match self.log {
            true => 0,
            false => decade_below(size) - decade_below(high - low),
        };
        (DIGITS as i32 + lost).clamp(DIGITS as i32, 17) as usize
    }

    /// True of a value that lies on the axis.
    pub(super) fn holds(&self, value: f64) -> bool {
        let (low, high) = self.ends;
        // Rounding alone must not throw out an end.
        let slack = 1e-9 * if self.log { low } else { high - low };
        (low - slack..=high + slack).contains(&self.shown(value))
    }

    /// Share of the axis that lies before a value.
    pub(super) fn share(&self, value: f64) -> f64 {
        let place = |shown: f64| measure(shown, self.log);
        let (low, high) = (place(self.ends.0), place(self.ends.1));
        (place(self.shown(value)) - low) / (high - low)
    }

    /// The channel of a field on this axis.
    pub(super) fn channel(&self, field: &str) -> Value {
        let (low, high) = self.ends;
        let kind = if self.log { "log" } else { "linear" };
        let mut axis = match &self.ticks {
            Some(ticks) => json!({"values": ticks, "tickCount": ticks.len()}),
            None if self.is_whole => json!({"tickMinStep": 1}),
            None => json!({}),
        };
        if self.log {
            axis["format"] = json!("~g");
        }
        if let Some(names) = &self.names {
            axis["grid"] = json!(false);
            axis["labelExpr"] = json!(format!("{}[datum.value]", json!(names)));
        }
        if self.is_bare {
            axis["labels"] = json!(false);
        }
        let title = (!self.is_bare).then_some(&self.title);
        json!({
            "field": field, "type": "quantitative", "title": title, "axis": axis,
            "scale": {"type": kind, "domain": [low, high], "nice": false},
        })
    }
}

/// Digits of a number in a specification where the axis begins near 0.
const DIGITS: usize = 7;
/// Letters of a title: five lines beside a plot or so.
const MOST_LETTERS: usize = 300;
/// Values of a column that can be the numbers of its axis.
const MOST_TICKS: usize = 12;

/// What an axis is even in: values, or their logarithms.
pub(super) fn measure(value: f64, log: bool) -> f64 {
    if log { libm::log10(value) } else { value }
}

/// The value of a measure.
pub(super) fn measured(place: f64, log: bool) -> f64 {
    if log { libm::pow(10.0, place) } else { place }
}

/// A number times a power of ten.
fn scaled(value: f64, shift: i32) -> f64 {
    value * power_of_ten(shift)
}

/// Numbers of a logarithmic axis: 1, 2 and 5 of every decade if they are few, else
/// powers of ten.
fn log_ticks((low, high): (f64, f64)) -> Vec<f64> {
    let decades = decade_below(low)..=decade_below(high);
    let every = (decades.clone().count() / 9 + 1) as i32;
    let digits: &[f64] = match high / low {
        ratio if ratio < 30.0 => &[1.0, 2.0, 3.0, 5.0, 7.0],
        ratio if ratio < 3000.0 => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let all = decades.filter(|decade| decade % every == 0);
    let all = all.flat_map(|decade| digits.iter().map(move |digit| scaled(*digit, decade)));
    let slack = 1e-9;
    let inside = |tick: &f64| low * (1.0 - slack) <= *tick && *tick <= high * (1.0 + slack);
    let all = all.map(|tick| significant(tick, 3)).filter(inside);
    match all.collect::<Vec<f64>>() {
        // Within a part of a decade its ends are the numbers.
        few if few.len() < 2 => vec![significant(low, 3), significant(high, 3)],
        ticks => ticks,
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

/// Share of an axis that is left free at either end.
const FREE: f64 = 0.04;

/// Ends of an even axis for data that span from `low` to `high`.
fn linear(low: f64, high: f64, margin: Margin) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    // One value, or values that differ by rounding alone.
    let (low, high) = match size {
        _ if high - low > 1e-12 * size => (low, high),
        0.0 => return (0.0, 1.0),
        _ => (low - 0.1 * size, high + 0.1 * size),
    };
    let free = FREE * (high - low);
    match margin {
        Margin::None => (low, high),
        Margin::FromZero if low >= 0.0 && low < 0.5 * high => (0.0, high + FREE * high),
        Margin::FromZero if high <= 0.0 && high > 0.5 * low => (low + FREE * low, 0.0),
        // No axis shows negative times because of a margin.
        _ if low >= 0.0 => ((low - free).max(0.0), high + free),
        _ => (low - free, high + free),
    }
}

/// Ends of a logarithmic axis for data above 0.
fn logarithmic(low: f64, high: f64, margin: Margin) -> (f64, f64) {
    let span = libm::log10(high / low);
    let (low, high, span) = match span {
        span if span > 1e-9 => (low, high, span),
        _ => (low / 3.0, high * 3.0, 1.0),
    };
    let free = match margin {
        Margin::None => 1.0,
        _ => libm::pow(10.0, FREE * span),
    };
    (low / free, high * free)
}

/// Smallest and largest of some numbers.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<Span> {
    let ends = values.into_iter().map(|value| (value, value));
    ends.reduce(|(low, high), (value, _)| (f64::min(low, value), f64::max(high, value)))
}
