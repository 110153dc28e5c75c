//! One axis of a study: a key of the run file and the values that it takes.

use core::fmt;

use schemars::JsonSchema;
use serde::Deserialize;

use super::points::Position;
use hil_core::distribution::{Distribution, log_between};
use hil_core::runfile::{KeyPath, KeyValue};

/// Spacing of the steps of a range (`scale`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Equal differences.
    #[default]
    Linear,
    /// Equal ratios.
    Log,
}

/// The values of an axis.
#[derive(Debug, Clone, PartialEq)]
pub enum Spread {
    /// These values.
    List(Vec<AxisValue>),
    /// From one number to another.
    Range(Range),
    /// Drawn at random.
    Random(Distribution),
}

/// From one number to another, both included; `points` of them on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of values on a grid, at least 1.
    pub points: u64,
    /// Spacing.
    pub scale: Scale,
}

impl Range {
    /// The value at a part of the way, 0 to 1; both ends exact.
    pub(in crate::study) fn between(&self, part: f64) -> f64 {
        match self.scale {
            Scale::Log => log_between(self.from, self.to, part),
            Scale::Linear if part >= 1.0 => self.to,
            Scale::Linear => self.from + part * (self.to - self.from),
        }
    }
}

/// One value of an axis.
#[derive(Debug, Clone, PartialEq)]
pub enum AxisValue {
    /// A number: the key's value, or its factor.
    Number(f64),
    /// Anything else.
    Other {
        /// As TOML.
        toml: String,
        /// As results show it.
        label: String,
    },
}

/// A key and the value that it takes in a run.
pub type Setting = (KeyPath, KeyValue);

/// A key and the values that it takes.
#[derive(Debug, Clone)]
pub struct Axis {
    /// The key.
    pub key: KeyPath,
    /// Its values, or factors where `times` names another key.
    pub spread: Spread,
    /// Another key, with whose value of the same run the axis' own is
    /// multiplied: a delay in sample times, for instance. The axis' own key
    /// stands for what the base has.
    pub times: Option<KeyPath>,
}

impl Axis {
    /// Number of values on a grid; 1 where the values are drawn.
    pub fn count(&self) -> u64 {
        match &self.spread {
            Spread::List(values) => values.len() as u64,
            Spread::Range(range) => range.points,
            Spread::Random(_) => 1,
        }
    }

    /// True if every value is a number.
    pub fn is_numeric(&self) -> bool {
        match &self.spread {
            Spread::List(values) => values
                .iter()
                .all(|value| matches!(value, AxisValue::Number(_))),
            Spread::Range(_) | Spread::Random(_) => true,
        }
    }

    /// The value at a position.
    pub fn at(&self, position: Position) -> AxisValue {
        match &self.spread {
            Spread::List(values) => {
                let index = match position {
                    Position::Index(index) => index,
                    Position::Part(part) => (part * values.len() as f64) as u64,
                };
                let index = usize::try_from(index).unwrap_or(usize::MAX);
                let value = values.get(index.min(values.len().saturating_sub(1)));
                // An axis has at least one value.
                value.cloned().unwrap_or(AxisValue::Number(f64::NAN))
            }
            Spread::Range(range) => AxisValue::Number(range.between(match position {
                Position::Index(index) if range.points > 1 => {
                    index as f64 / range.points.saturating_sub(1) as f64
                }
                Position::Index(_) => 0.0,
                Position::Part(part) => part,
            })),
            Spread::Random(distribution) => AxisValue::Number(match position {
                Position::Part(part) => distribution.quantile(part),
                Position::Index(_) => f64::NAN,
            }),
        }
    }

    /// True if the values are factors of what the base has for the axis' own key.
    pub fn is_of_base(&self) -> bool {
        self.times.is_some_and(|times| {
            (times.section, times.key.name) == (self.key.section, self.key.key.name)
        })
    }

    /// Name of the column with the factor of an axis with `times` of another key.
    pub fn factor_column(&self) -> Option<String> {
        let times = self.times.filter(|_| !self.is_of_base())?;
        Some(format!("{}/{}", self.key.path(), times.path()))
    }
}

impl fmt::Display for AxisValue {
    /// The value as results show it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Other { label, .. } => f.write_str(label),
        }
    }
}

impl AxisValue {
    /// The value for the key: as it stands, or times another key's value.
    pub fn value(&self, key: &KeyPath, factor: Option<f64>) -> KeyValue {
        match self {
            Self::Number(number) => key.value(factor.map_or(*number, |factor| factor * number)),
            Self::Other { toml, .. } => KeyValue::Toml(toml.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(spread: Spread) -> Axis {
        Axis {
            key: KeyPath::find("controller.kp").unwrap(),
            spread,
            times: None,
        }
    }

    fn number(chosen: AxisValue) -> f64 {
        match chosen {
            AxisValue::Number(number) => number,
            AxisValue::Other { .. } => panic!("no number"),
        }
    }

    #[test]
    fn ranges_have_both_ends_exactly() {
        for (scale, middle) in [(Scale::Linear, 5.05), (Scale::Log, 1.0)] {
            let axis = axis(Spread::Range(Range {
                from: 0.1,
                to: 10.0,
                points: 3,
                scale,
            }));
            let at = |i| number(axis.at(Position::Index(i)));
            assert_eq!((at(0), at(2)), (0.1, 10.0));
            assert!((at(1) - middle).abs() < 1e-15 * 10.0);
        }
    }

    #[test]
    fn a_part_falls_on_every_value_of_a_list_alike() {
        let values = [1.0, 2.0, 4.0].map(AxisValue::Number).to_vec();
        let axis = axis(Spread::List(values));
        let mut seen = [0; 5];
        for i in 0..300 {
            let value = number(axis.at(Position::Part(f64::from(i) / 300.0)));
            seen[value as usize] += 1;
        }
        assert_eq!(seen, [0, 100, 100, 0, 100]);
    }

    #[test]
    fn a_factor_multiplies_another_key() {
        let delay = KeyPath::find("controller.computation_delay_s").unwrap();
        let chosen = AxisValue::Number(0.5);
        let found = chosen.value(&delay, Some(1e-3));
        assert_eq!(found, KeyValue::Nanoseconds(500_000));
    }
}
