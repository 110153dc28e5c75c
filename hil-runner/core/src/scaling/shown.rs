//! The words of a run as tables and reports show them, whichever law they
//! belong to.

use firmware::GainWord;
use firmware::law::Part;

use super::ScaledLaw;
use crate::quantise::QuantisedGains;

/// One word beside what it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShownWord {
    /// The gain as the law has it, such as `Ki·Δt`.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What the run file asks for.
    pub wanted: f64,
    /// The word.
    pub word: GainWord,
    /// `(value of the word − wanted)/wanted`.
    pub relative_error: f64,
}

/// The words of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedPointGains {
    /// The gains that are not left out.
    pub rows: Vec<ShownWord>,
    /// `E`: errors up to this size are within the declared range \[counts\].
    pub error_limit: i32,
}

impl From<&QuantisedGains> for FixedPointGains {
    fn from(gains: &QuantisedGains) -> Self {
        let rows = gains.gains.iter().map(|gain| ShownWord {
            name: gain.name(),
            unit: "codes/count",
            wanted: gain.wanted,
            word: gain.word,
            relative_error: gain.relative_error(),
        });
        Self {
            rows: rows.collect(),
            error_limit: gains.pid.error_limit(),
        }
    }
}

impl From<&ScaledLaw> for FixedPointGains {
    fn from(words: &ScaledLaw) -> Self {
        let rows = words
            .rows
            .iter()
            .filter(|row| row.wanted != 0.0 || row.is_of_the_paper());
        let rows = rows.map(|row| ShownWord {
            name: name(row.part),
            unit: unit(row.part),
            wanted: row.wanted,
            word: row.word,
            relative_error: row.relative_error(),
        });
        Self {
            rows: rows.collect(),
            error_limit: words.law.error_limit(),
        }
    }
}

/// The gain as the law has it.
fn name(part: Part) -> &'static str {
    match part {
        Part::Proportional => "Kp",
        Part::Integral => "Ki·Δt",
        Part::Derivative => "Kd/Δt",
        Part::Velocity => "Kv/Δt",
        Part::Acceleration => "Ka/Δt²",
        Part::Friction => "Kf",
    }
}

/// The unit of the gain in the law: rates come in units of their own.
fn unit(part: Part) -> &'static str {
    match part {
        Part::Proportional | Part::Integral | Part::Derivative => "codes/count",
        Part::Velocity => "codes/unit of v",
        Part::Acceleration => "codes/unit of a",
        Part::Friction => "codes",
    }
}
