//! The worth of every feature of the product's axis on the simulated plant: its
//! figure, and the same figure without it.
//!
//! A run gives the same bits on every machine, so the measured figures that
//! stand in the comments are not estimates. A bound lies well between the two
//! sides of its contrast: it moves only if the feature's worth does, not with
//! the last digit of a figure. `--nocapture` prints all of them.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod backlash;
mod backlash_compensation;
mod bumpless;
mod dual;
mod everything;
mod faults;
mod fixed_point_gains;
mod io;
mod knobs;
mod limit_cycle;
mod monitors;
mod position;
mod rest;
mod setpoints;
mod windup;

use bench_tests::case;
use hil_core::case::Case;
use hil_core::controllers::IoKind;
use hil_core::error::RunError;
use hil_core::run::{Outcome, RunOptions, run};
use hil_core::summary::{AxisReport, FaultReport, Summary};
use hil_core::trace::{Row, Sample};

/// The four cases of the paper.
pub(crate) const PAPER: [&str; 4] = ["paper-1", "paper-2", "paper-3", "paper-4"];

/// Dry friction that holds the carriage wherever it comes to rest, and an
/// integrator quick enough to bring the motor to its setpoint: what is left of
/// the error is the backlash.
pub(crate) const FRICTION: [&str; 1] = [
    "carriage.resistance_constant_n=250 carriage.resistance_opposes_motion=true \
     controller.ki_per_s=30 run.duration_s=3",
];

/// A run with all its rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ran {
    pub(crate) case: Case,
    pub(crate) rows: Vec<Row>,
    pub(crate) outcome: Outcome,
}

impl Ran {
    /// The run of a case with overrides.
    pub(crate) fn of(name: &str, sets: &[&[&str]]) -> Self {
        Self::over(IoKind::Direct, name, sets)
    }

    /// The same over other electronics.
    pub(crate) fn over(io: IoKind, name: &str, sets: &[&[&str]]) -> Self {
        let case = case(name, &sets.concat());
        Self::of_case(case, io).unwrap()
    }

    /// The run of a case that may be refused.
    pub(crate) fn of_case(case: Case, io: IoKind) -> Result<Self, RunError> {
        let mut rows = Vec::new();
        let options = RunOptions {
            io,
            ..RunOptions::default()
        };
        let outcome = run(&case, options, &mut |row| {
            rows.push(*row);
            Ok(())
        })?;
        Ok(Self {
            case,
            rows,
            outcome,
        })
    }

    pub(crate) fn summary(&self) -> &Summary {
        &self.outcome.summary
    }

    /// The supervision's report at the end.
    pub(crate) fn axis(&self) -> &AxisReport {
        self.summary().axis.as_ref().unwrap()
    }

    /// The fault that the run must have ended with.
    pub(crate) fn fault(&self) -> &FaultReport {
        self.axis().fault.as_ref().unwrap()
    }

    /// The controller's part of every row.
    pub(crate) fn samples(&self) -> Vec<Sample> {
        self.rows.iter().map(|row| row.sample.unwrap()).collect()
    }

    pub(crate) fn codes(&self) -> Vec<f64> {
        self.samples().iter().map(|s| s.dac_code).collect()
    }

    /// Position of the carriage at every row \[µm\].
    pub(crate) fn carriage_um(&self) -> Vec<f64> {
        let pitch = self.case.axis.transmission.screw_pitch_m_per_rad;
        self.rows
            .iter()
            .map(|r| 1e6 * pitch * r.gamma_rad)
            .collect()
    }

    /// Way of the carriage beyond the end of its travel \[mm\].
    pub(crate) fn overshoot_mm(&self) -> f64 {
        let travel_um = 1e6 * self.case.motion.travel_m();
        let most = self.carriage_um().into_iter().fold(f64::MIN, f64::max);
        1e-3 * (most - travel_um)
    }

    /// The count that the motor's encoder showed at every row.
    pub(crate) fn counts(&self) -> Vec<f64> {
        let z = self.case.axis.transmission.gear_ratio;
        let encoder = self.case.encoder;
        self.rows
            .iter()
            .map(|row| encoder.count(row.beta_rad / z))
            .collect()
    }

    /// The reference that the controller followed, backlash compensation included, at every
    /// row: `r = e + c` \[counts\].
    pub(crate) fn references(&self) -> Vec<f64> {
        let counts = self.counts();
        let errors = self.samples().into_iter().map(|s| s.error_counts);
        errors.zip(counts).map(|(e, c)| e + c).collect()
    }
}

/// Largest minus smallest.
pub(crate) fn peak_to_peak(values: &[f64]) -> f64 {
    let least = values.iter().copied().fold(f64::MAX, f64::min);
    let most = values.iter().copied().fold(f64::MIN, f64::max);
    most - least
}

/// Differences of neighbours.
pub(crate) fn steps(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Largest magnitude.
pub(crate) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| value.abs().max(most))
}
