//! The ladder: one case on every rung, and what each rung adds to the one
//! below it.

use serde::Serialize;

use crate::case::{Case, Law};
use crate::demand;
use crate::error::RunError;
use crate::message::Link;
use crate::number;
use crate::record::GridPoint;
use crate::remarks;
use crate::reservation;
use crate::run::{Outcome, RowSink, RunOptions, fault_warning, run, run_over, streamed_setpoints};

/// Interval of the rows that all rungs have in common \[ns\].
pub const GRID_NS: u64 = 1_000_000;

/// One rung of a ladder.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// The case.
    pub case: Case,
    /// Name of the chip that ran it; `None` on the host.
    pub target: Option<String>,
    /// Its run.
    pub outcome: Outcome,
    /// Difference to the rung below; `None` at the bottom.
    pub difference: Option<Difference>,
    /// Digits of the difference that hold, acceleration and displacement;
    /// `None` where all that tables show do.
    pub difference_digits: [Option<usize>; 2],
}

/// RMS difference of the carriage to the rung below on common 1 ms rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Difference {
    /// Of the acceleration \[m/s²\].
    pub rms_acc_mps2: f64,
    /// Of the displacement \[µm\].
    pub rms_position_um: f64,
}

impl Rung {
    /// The control law.
    pub fn law(&self) -> Law {
        self.case.controller.law
    }

    /// The name of the rung.
    pub fn name(&self) -> String {
        match &self.target {
            None => self.law().name().to_owned(),
            Some(target) => format!("{} on {target}", self.law().name()),
        }
    }

    /// The effect that the rung adds to the one below it.
    pub fn adds(&self) -> &'static str {
        match self.target {
            None => self.law().adds(),
            Some(_) => "compiler, target, timing",
        }
    }

    /// Remarks for the user besides the figures, a sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let reservations = reservation::of(&self.case, &self.outcome);
        let mut warnings: Vec<String> = reservations.into_iter().map(|(_, words)| words).collect();
        warnings.extend(fault_warning(&self.outcome));
        warnings.extend(streamed_setpoints(&self.outcome.summary));
        let is_top = self.law() == Law::Firmware && self.target.is_none();
        // What is to be said of the axis is said once.
        if is_top {
            warnings.extend(demand::remarks(&self.case));
            warnings.extend(remarks::of_case(&self.case));
        }
        if is_top && !self.case.options.is_off() {
            warnings.push(
                "it adds what the run file asks of the controller beyond the paper's law, not word \
                 lengths alone"
                    .to_owned(),
            );
        }
        warnings
    }
}

impl Law {
    /// The effect that this rung adds to the one below it.
    pub fn adds(self) -> &'static str {
        match self {
            Self::Continuous => "the paper's own model",
            Self::Sampled => "sampling, computation delay",
            Self::Quantised => "encoder and DAC steps and range",
            Self::Firmware => "fixed-point word lengths",
        }
    }
}

fn on_grid(options: RunOptions) -> RunOptions {
    RunOptions {
        grid_ns: Some(GRID_NS),
        ..options
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
    let options = on_grid(options);
    let mut rungs: Vec<Rung> = Vec::with_capacity(cases.len());
    for (number, case) in cases.iter().enumerate() {
        let outcome = run(case, options, sink).map_err(|error| (number, error))?;
        push(&mut rungs, case, outcome);
    }
    Ok(rungs)
}

/// Adds the rung of the firmware on the chip at the end of `link`.
///
/// # Errors
/// As [`run_over`].
pub fn climb_over(
    rungs: &mut Vec<Rung>,
    case: &Case,
    options: RunOptions,
    link: &mut impl Link,
    sink: &mut RowSink<'_>,
) -> Result<(), RunError> {
    let outcome = run_over(case, on_grid(options), link, sink)?;
    push(rungs, case, outcome);
    Ok(())
}

/// Runs the cases of a ladder once more on the host, their carriages heavier by
/// [`MASS_CHANGE`](crate::case::MASS_CHANGE) of their mass, to see how many
/// digits of the figures hold. A chip's figures are held against the host's; not
/// those of one whose delay is measured.
///
/// # Errors
/// As [`climb`].
pub fn confirm(
    rungs: &mut [Rung],
    cases: &[Case],
    sink: &mut RowSink<'_>,
) -> Result<(), (usize, RunError)> {
    let cases: Vec<Case> = cases.iter().map(Case::nudged).collect();
    let mut again = climb(&cases, RunOptions::default(), sink)?;
    if let [.., below, on_chip] = rungs
        && let Some(firmware) = again.last().cloned()
        && on_chip.case.controller.computation_delay == below.case.controller.computation_delay
        && on_chip.target.is_some()
    {
        push(&mut again, &on_chip.case.nudged(), firmware.outcome);
    }
    for (rung, again) in rungs.iter_mut().zip(&again) {
        let summary = &mut rung.outcome.summary;
        summary.digits_that_hold = summary.digits_confirmed_by(&again.outcome.summary);
        let of = |value: fn(Difference) -> f64, unit: &str| {
            let both = [rung.difference, again.difference].map(|of| of.map(value));
            number::confirmed(both, unit)
        };
        rung.difference_digits = [
            of(|difference| difference.rms_acc_mps2, "m/s²"),
            of(|difference| difference.rms_position_um, "µm"),
        ];
    }
    Ok(())
}

fn push(rungs: &mut Vec<Rung>, case: &Case, outcome: Outcome) {
    let below = rungs.last();
    let difference = below.map(|below| difference(&outcome.grid, &below.outcome.grid));
    let chip = outcome.summary.chip.as_ref();
    rungs.push(Rung {
        case: case.clone(),
        target: chip.map(|chip| chip.target.clone()),
        outcome,
        difference,
        difference_digits: [None; 2],
    });
}

/// The carriage of a run at the instants at which rungs are compared, and why
/// it could not be run.
///
/// # Errors
/// As [`run`].
pub fn grid(case: &Case) -> Result<Vec<GridPoint>, RunError> {
    let options = on_grid(RunOptions::default());
    run(case, options, &mut |_| Ok(())).map(|outcome| outcome.grid)
}

/// Distance of one rung's carriage from that of the rung below it.
pub fn difference(upper: &[GridPoint], lower: &[GridPoint]) -> Difference {
    let rms = |of: fn(&GridPoint) -> f64| {
        let pairs = upper.iter().zip(lower);
        let squares = pairs.map(|(u, l)| (of(u) - of(l)) * (of(u) - of(l)));
        let rows = u32::try_from(upper.len().max(1)).unwrap_or(u32::MAX);
        (squares.sum::<f64>() / f64::from(rows)).sqrt()
    };
    Difference {
        rms_acc_mps2: rms(|point| point.acc_mps2),
        rms_position_um: 1e6 * rms(|point| point.x_m),
    }
}
