//! The ladder: one case on every rung, and what each rung adds to the one
//! below it.

use crate::case::{Case, Law};
use crate::error::RunError;
use crate::record::GridPoint;
use crate::run::{Outcome, RowSink, RunOptions, run};

/// Interval of the rows that all rungs have in common \[ns\].
pub const GRID_NS: u64 = 1_000_000;

/// One rung of a ladder.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// The control law.
    pub law: Law,
    /// Its run.
    pub outcome: Outcome,
    /// What it adds to the rung below; `None` at the bottom.
    pub difference: Option<Difference>,
}

/// RMS difference of the carriage to the rung below on common 1 ms rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Of the acceleration \[m/s²\].
    pub rms_acc_mps2: f64,
    /// Of the displacement \[µm\].
    pub rms_position_um: f64,
}

impl Law {
    /// What this rung adds to the one below it.
    pub fn adds(self) -> &'static str {
        match self {
            Self::Continuous => "the paper's own model",
            Self::Sampled => "sampling, computation delay",
            Self::Quantised => "encoder and DAC steps and range",
            Self::Firmware => "fixed-point word lengths",
        }
    }
}

/// Runs the cases of a ladder, one for each rung from the bottom up; they
/// differ in their law alone. The rows of all of them go to `sink`.
///
/// # Errors
/// The number of the case that could not be run, and why.
pub fn climb(
    cases: &[Case],
    options: RunOptions,
    sink: &mut RowSink<'_>,
) -> Result<Vec<Rung>, (usize, RunError)> {
    let options = RunOptions {
        grid_ns: Some(GRID_NS),
        ..options
    };
    let mut rungs: Vec<Rung> = Vec::with_capacity(cases.len());
    for (number, case) in cases.iter().enumerate() {
        let outcome = run(case, options, sink).map_err(|error| (number, error))?;
        let difference = rungs
            .last()
            .map(|below| difference(&outcome.grid, &below.outcome.grid));
        rungs.push(Rung {
            law: case.controller.law,
            outcome,
            difference,
        });
    }
    Ok(rungs)
}

fn difference(upper: &[GridPoint], lower: &[GridPoint]) -> Difference {
    let rms = |of: fn(&GridPoint) -> f64| {
        let squares = upper
            .iter()
            .zip(lower)
            .map(|(u, l)| (of(u) - of(l)) * (of(u) - of(l)));
        let rows = u32::try_from(upper.len().max(1)).unwrap_or(u32::MAX);
        (squares.sum::<f64>() / f64::from(rows)).sqrt()
    };
    Difference {
        rms_acc_mps2: rms(|point| point.acc_mps2),
        rms_position_um: 1e6 * rms(|point| point.x_m),
    }
}
