//! A tuned key as a number of the unit box, as a value in the key's unit, and as a
//! decimal of a few digits.

use crate::case::Case;
use crate::runfile::tune_settings::TunedKey;
use crate::runfile::{Key, KeyPath, KeyValue, Value};

/// A tuned key with its range.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// The key, and of a list the place in it.
    pub tuned: TunedKey,
    /// Values between which it is looked for.
    pub span: Span,
    /// Where the range comes from, in words; empty where the file gives it.
    pub origin: &'static str,
}

/// The values of a variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Span {
    /// Lowest and highest value; equal differences are equal steps.
    Linear([f64; 2]),
    /// The same, both greater than 0; equal ratios are equal steps.
    Log([f64; 2]),
    /// The words that the key allows, each by its place.
    Words(&'static [&'static str]),
}

/// Significant digits of a tuned gain, and of a feed-forward, of which a per cent counts.
const DIGITS: i32 = 3;
const DIGITS_OF_FEED_FORWARD: i32 = 4;

impl Variable {
    /// Its path in a file.
    pub fn path(&self) -> String {
        self.tuned.path()
    }

    /// The value at a place of the unit box.
    pub fn value(&self, unit: f64) -> f64 {
        let u = unit.clamp(0.0, 1.0);
        match self.span {
            Span::Linear([low, high]) => low + u * (high - low),
            Span::Log([low, high]) => libm::exp(libm::log(low) + u * libm::log(high / low)),
            Span::Words(words) => (u * words.len() as f64)
                .floor()
                .min(words.len() as f64 - 1.0),
        }
    }

    /// The place of a value in the unit box.
    pub fn unit(&self, value: f64) -> f64 {
        let unit = match self.span {
            Span::Linear([low, high]) => (value - low) / (high - low),
            Span::Log([low, _]) if value <= low => 0.0,
            Span::Log([low, high]) => libm::log(value / low) / libm::log(high / low),
            Span::Words(words) => (value + 0.5) / words.len() as f64,
        };
        unit.clamp(0.0, 1.0)
    }

    /// Lowest and highest value.
    pub fn ends(&self) -> [f64; 2] {
        match self.span {
            Span::Linear(ends) | Span::Log(ends) => ends,
            Span::Words(words) => [0.0, words.len() as f64 - 1.0],
        }
    }

    /// The value, or the end of the range that is nearer.
    pub fn within(&self, value: f64) -> f64 {
        let [low, high] = self.ends();
        value.clamp(low, high)
    }

    /// The value that a case has.
    pub fn of(&self, case: &Case) -> Option<f64> {
        match (self.span, self.tuned.key.key.get(case)) {
            (Span::Words(words), Some(Value::Choice(word))) => {
                let place = words.iter().position(|known| *known == word)?;
                Some(place as f64)
            }
            _ => number_of(&self.tuned, case),
        }
    }

    /// The value as the key takes it.
    pub fn key_value(&self, value: f64) -> KeyValue {
        match self.span {
            Span::Words(words) => {
                let word = words.get(value as usize).copied().unwrap_or_default();
                KeyValue::Toml(format!("\"{word}\""))
            }
            _ => self.tuned.key.value(value),
        }
    }

    /// The nearest decimal of the digits that the key is written with.
    pub fn rounded(&self, value: f64) -> f64 {
        self.stepped(value, 0)
    }

    /// That decimal, so many units of its last digit up or down, within the range.
    pub fn stepped(&self, value: f64, steps: i32) -> f64 {
        if let Span::Words(_) = self.span {
            return self.within(value + f64::from(steps));
        }
        if value == 0.0 && steps == 0 {
            return value;
        }
        // A decimal of no size is told from 0 by the range alone.
        let size = match value == 0.0 {
            true => 1e-3 * self.ends()[1].abs(),
            false => value.abs(),
        };
        let digits = match is_feed_forward(self.tuned.key.key) {
            true => DIGITS_OF_FEED_FORWARD,
            false => DIGITS,
        };
        let exponent = libm::floor(libm::log10(size)) as i32 - (digits - 1);
        let unit = decimal(1.0, exponent);
        let count = libm::round(value / unit) + f64::from(steps);
        // The ends themselves may have more digits.
        self.within(decimal(count, exponent))
    }
}

/// The number that a case has of a tuned key.
pub(super) fn number_of(tuned: &TunedKey, case: &Case) -> Option<f64> {
    match tuned.element {
        Some(element) => case.motion.intervals_s()?.get(element - 1).copied(),
        None => tuned.key.key.get(case)?.number(),
    }
}

/// `count·10^exponent`, the number nearest to the decimal.
fn decimal(count: f64, exponent: i32) -> f64 {
    format!("{count}e{exponent}").parse().unwrap_or(count)
}

/// True of the gains of the feed-forward.
pub(super) fn is_feed_forward(key: &Key) -> bool {
    matches!(
        key.name,
        "velocity_ff_s" | "acceleration_ff_s2" | "friction_ff_codes"
    )
}

/// True of a gain of the law, in whatever way it is given.
pub(super) fn is_gain(key: &KeyPath) -> bool {
    let ways = key.ways();
    key.section == "controller" && ways.iter().any(|way| way.contains(&key.key.name))
}
