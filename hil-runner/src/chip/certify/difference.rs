//! Where a chip and the host part, in words.

use core::fmt;

use super::step::{Named, Number, Step};
use hil_core::case::Case;
use hil_core::time::seconds;

/// A number that is another on the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NumberPair {
    /// What it is.
    pub name: &'static str,
    /// On the chip.
    pub chip: Number,
    /// On the host, or in the file.
    pub wanted: Number,
}

impl NumberPair {
    /// Those that differ.
    pub(super) fn differing(chip: Vec<Named>, wanted: Vec<Named>) -> Vec<Self> {
        chip.into_iter()
            .zip(wanted)
            .filter(|(chip, wanted)| chip != wanted)
            .map(|((name, chip), (_, wanted))| Self { name, chip, wanted })
            .collect()
    }
}

/// The first step of a case at which a chip differs from the host.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Name of the case.
    pub case: String,
    /// Number of the step, k.
    pub tick: u64,
    /// Its time \[s\].
    pub time_s: f64,
    /// The numbers that differ, at least one.
    pub numbers: Vec<NumberPair>,
}

impl Difference {
    /// Between the same step of host and chip; `None` if there is none.
    pub(super) fn between(case: &Case, host: &Step, chip: &Step) -> Option<Self> {
        let numbers = NumberPair::differing(chip.numbers(), host.numbers());
        let period_ns = case.controller.sample_time_ns.unwrap_or(0);
        (!numbers.is_empty()).then(|| Self {
            case: case.name.clone(),
            tick: host.tick(),
            time_s: seconds(host.tick().saturating_mul(period_ns)),
            numbers,
        })
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            case, tick, time_s, ..
        } = self;
        write!(f, "differs at step {tick} ({time_s} s) of {case}: ")?;
        write_pairs(f, &self.numbers, "here")
    }
}

/// The first row of a file of vectors that a chip answers otherwise.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowDifference {
    /// Name of the file.
    pub file: String,
    /// Number of the line, from 1.
    pub line: usize,
    /// The numbers that differ, at least one.
    pub numbers: Vec<NumberPair>,
}

impl fmt::Display for RowDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "differs at line {} of {}: ", self.line, self.file)?;
        write_pairs(f, &self.numbers, "in the file")
    }
}

/// "code −17 on the chip, −16 here; state fault on the chip, moving here".
fn write_pairs(f: &mut fmt::Formatter<'_>, pairs: &[NumberPair], there: &str) -> fmt::Result {
    for (place, NumberPair { name, chip, wanted }) in pairs.iter().enumerate() {
        let separator = if place == 0 { "" } else { "; " };
        write!(f, "{separator}{name} {chip} on the chip, {wanted} {there}")?;
    }
    Ok(())
}
