//! One run of a case in this process.

use crate::case::{Case, ComputationDelay, Law};
use crate::controllers::Controller;
use crate::error::RunError;
use crate::io::IoKind;
use crate::lockstep::run_continuous;
use crate::quantise::QuantiseError;

pub use crate::lockstep::{Outcome, RowSink, RunOptions, run_over};

/// Runs a case and delivers its rows to `sink`.
///
/// # Errors
/// [`RunError`] if the case cannot be started, as one whose delay is measured
/// cannot without a chip, or a state leaves the finite numbers; the rows up to
/// there have been delivered.
pub fn run(case: &Case, options: RunOptions, sink: &mut RowSink<'_>) -> Result<Outcome, RunError> {
    if case.controller.law == Law::Continuous {
        return run_continuous(case, options, sink);
    }
    run_over(case, options, &mut controller(case, options.io)?, sink)
}

/// The controller of a sampled rung, ready for its first sample.
///
/// # Errors
/// [`RunError`] if the case has no such controller, or one that only a chip can
/// run.
pub fn controller(case: &Case, io: IoKind) -> Result<Controller, RunError> {
    let timing = &case.controller;
    if timing.sample_time_ns.is_some() && timing.computation_delay == ComputationDelay::Measured {
        return Err(RunError::Quantise(QuantiseError::DelayUnknown));
    }
    Controller::new(case, io)?.ok_or(RunError::NoSampleTime)
}
