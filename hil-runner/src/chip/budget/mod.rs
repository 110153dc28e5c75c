//! What the controller costs on a chip, and what it has cost before.
//!
//! ```text
//!  image cost ──► cost: every feature of a constant axis ─┐
//!  image fifo ──► runs: an axis of words, by state ───────┼─► figures ──► goldens
//!  images fifo, uart, cost: flash, RAM, deepest stack ────┘
//! ```

pub mod cost;
pub mod error;
pub mod goldens;
pub mod runs;

pub use error::BudgetError;

use crate::chip::Meter;
use crate::chip::spec::{Program, Target};
use hil_core::case::TargetSettings;

/// Something that was measured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// What it is, unique among those of a target.
    pub name: String,
    /// How much.
    pub amount: Amount,
}

/// A measured amount.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Amount {
    /// Instructions of a sample.
    Instructions(Instructions),
    /// Bytes of memory.
    Bytes(u32),
}

/// Instructions of the samples of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instructions {
    /// Most.
    pub max: u32,
    /// Lower median.
    pub median: u32,
    /// Of the very first sample, which is not among the others: it begins
    /// filter and integral. `None` where it was not taken apart.
    pub first: Option<u32>,
}

/// All figures of a target.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetFigures {
    /// The target.
    pub target: Target,
    /// How instructions become cycles and time.
    pub meter: Meter,
    /// The figures, in the order in which they are shown.
    pub figures: Vec<Figure>,
}

/// Measures a target in QEMU; `tell` gets a line before a part that takes a
/// while.
///
/// # Errors
/// [`BudgetError`] if an image cannot be had, or does not do its work.
pub fn measure(
    target: Target,
    settings: TargetSettings,
    tell: &mut dyn FnMut(&str),
) -> Result<TargetFigures, BudgetError> {
    let measured = cost::measure(target, settings, tell)?;
    let mut figures: Vec<Figure> = measured.features;
    let mut memory = Vec::new();
    for program in [Program::Fifo, Program::Uart] {
        tell(&format!(
            "{}: samples of an axis of words, image {}",
            target.name(),
            program.name()
        ));
        let ran = runs::run(target, program.transport(), tell)?;
        // Over either transport the same instructions.
        if program == Program::Fifo {
            figures.extend(ran.states);
        }
        memory.extend(ran.memory.figures(program));
    }
    memory.extend(measured.memory.figures(Program::Cost));
    figures.append(&mut memory);
    Ok(TargetFigures {
        target,
        meter: measured.meter,
        figures,
    })
}

/// Memory that an image takes \[bytes\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory {
    /// Flash.
    pub flash: u32,
    /// Statics less the table of setpoints.
    pub ram: u32,
    /// Deepest stack.
    pub stack: u32,
}

impl Memory {
    fn figures(self, program: Program) -> impl Iterator<Item = Figure> {
        let name = program.name();
        [
            ("flash", self.flash),
            ("RAM", self.ram),
            ("deepest stack", self.stack),
        ]
        .into_iter()
        .map(move |(what, bytes)| Figure {
            name: format!("image {name}, {what}"),
            amount: Amount::Bytes(bytes),
        })
    }
}

/// The lower median of counts that are not empty.
fn median(counts: &[u32]) -> Option<u32> {
    let mut sorted = counts.to_vec();
    sorted.sort_unstable();
    sorted.get(sorted.len().saturating_sub(1) / 2).copied()
}
