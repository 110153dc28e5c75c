//! One run of a case in this process, timed by whoever has a clock, and judged.

use serde::Serialize;

use crate::budget::{self, Verdict};
use crate::case::{Case, ComputationDelay, Law};
use crate::controllers::Controller;
use crate::demand;
use crate::error::RunError;
use crate::figures::{CHIP_FIGURES, HOST_STEP_P99};
use crate::io::IoKind;
use crate::lockstep;
use crate::quantise::QuantiseError;
use crate::remarks;
use crate::reservation::{self, Reservation};
use crate::runfile::values_of_template;
use crate::summary::Summary;
use crate::theory::{self, Loops};

pub use crate::lockstep::{Outcome, RowSink, RunOptions, run_over};

/// Runs a case and delivers its rows to `sink`.
///
/// # Errors
/// [`RunError`] if the case cannot be started, as one whose delay is measured
/// cannot without a chip, or a state leaves the finite numbers; the rows up to
/// there have been delivered.
pub fn run(case: &Case, options: RunOptions, sink: &mut RowSink<'_>) -> Result<Outcome, RunError> {
    run_among(case, options, &mut Loops::default(), sink)
}

/// The same among runs whose loops are known.
///
/// # Errors
/// As [`run`].
pub(crate) fn run_among(
    case: &Case,
    options: RunOptions,
    loops: &mut Loops,
    sink: &mut RowSink<'_>,
) -> Result<Outcome, RunError> {
    let mut controller = match case.controller.law {
        Law::Continuous => None,
        _ => Some(controller(case, options.io)?),
    };
    lockstep::run_among(case, options, controller.as_mut(), loops, sink)
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
    Ok(Controller::new(case, io)?.ok_or(QuantiseError::NoSampleTime)?)
}

/// Times of the controller's step on a host. Wall-clock time: it differs from
/// run to run and decides nothing unless a budget says so.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HostTiming {
    /// Steps measured.
    pub steps: usize,
    /// Median \[µs\], the clock's own share included.
    pub median_us: f64,
    /// 99th percentile \[µs\].
    pub p99_us: f64,
    /// Slowest step \[µs\].
    pub max_us: f64,
    /// Median of an empty measurement, the clock's own share \[µs\].
    #[serde(skip)]
    pub clock_us: f64,
    /// Sample time Δt that a step must fit into \[µs\].
    pub sample_time_us: f64,
}

/// A case with everything that came out of it.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseRun {
    /// The case that was run.
    pub case: Case,
    /// The result.
    pub outcome: Outcome,
    /// Step time on the host, from a second pass; `None` on rung `continuous`.
    pub timing: Option<HostTiming>,
    /// Verdict on the step time, where the budget names it.
    pub timing_verdict: Option<Verdict>,
    /// Reasons why it does not simply pass, if it keeps its limits.
    pub reservations: Vec<Reservation>,
    /// Remarks for the user besides the figures.
    pub warnings: Vec<String>,
}

impl CaseRun {
    /// Runs `case` in this thread.
    ///
    /// # Errors
    /// [`RunError`]; the rows up to there have been delivered.
    pub fn new(case: &Case, options: RunOptions, sink: &mut RowSink<'_>) -> Result<Self, RunError> {
        Ok(Self::of(case, run(case, options, sink)?))
    }

    /// A case with its outcome, wherever it was run.
    pub fn of(case: &Case, outcome: Outcome) -> Self {
        let (reservations, warnings) = all_remarks(case, &outcome);
        let run = Self {
            case: case.clone(),
            outcome,
            timing: None,
            timing_verdict: None,
            reservations,
            warnings,
        };
        run.timed(None)
    }

    /// The same with the step's time on a host, and the verdict on it.
    #[must_use]
    pub fn timed(mut self, timing: Option<HostTiming>) -> Self {
        let (limits, default) = budget::limits(&self.case);
        self.timing_verdict = limits
            .iter()
            .find(|limit| limit.figure == HOST_STEP_P99.key)
            .map(|limit| Verdict::new(limit, timing.map(|t| t.p99_us), default));
        self.timing = timing;
        self
    }

    /// Runs the case once more on the host, the carriage heavier by
    /// [`MASS_CHANGE`](crate::case::MASS_CHANGE) of its mass, to see how many
    /// digits of the figures hold. A case whose delay is measured, which only a
    /// chip can run, is left as it is.
    ///
    /// # Errors
    /// As [`run`].
    pub fn confirm(&mut self, options: RunOptions, sink: &mut RowSink<'_>) -> Result<(), RunError> {
        let controller = &self.case.controller;
        if controller.computation_delay == ComputationDelay::Measured {
            return Ok(());
        }
        let options = RunOptions {
            plot: false,
            ..options
        };
        let again = run(&self.case.nudged(), options, sink)?;
        let summary = &mut self.outcome.summary;
        summary.digits_that_hold = summary.digits_confirmed_by(&again.summary);
        (self.reservations, self.warnings) = all_remarks(&self.case, &self.outcome);
        Ok(())
    }

    /// All verdicts, the one on the host's step time last.
    pub fn verdicts(&self) -> impl Iterator<Item = &Verdict> {
        let of_summary = self.outcome.summary.verdicts.iter();
        of_summary.chain(&self.timing_verdict)
    }

    /// The reservations with the name of the run.
    pub fn named_reservations(&self) -> (&str, &[Reservation]) {
        (&self.outcome.summary.name, &self.reservations)
    }

    /// True if all verdicts pass.
    pub fn passes(&self) -> bool {
        self.verdicts().all(|verdict| verdict.pass)
    }
}

/// The reservations about a run, and everything that is to be said of it.
fn all_remarks(case: &Case, outcome: &Outcome) -> (Vec<Reservation>, Vec<String>) {
    let (reservations, mut sentences): (_, Vec<String>) =
        reservation::of(case, outcome).into_iter().unzip();
    sentences.extend(warnings(case, outcome));
    (reservations, sentences)
}

/// Remarks that the figures alone do not make plain.
fn warnings(case: &Case, outcome: &Outcome) -> Vec<String> {
    let mut warnings = Vec::new();
    if outcome.out_of_range_samples > 0 {
        warnings.push(format!(
            "the firmware worked outside its declared ranges in {} samples: the position error \
             or its sum was larger than the fixed-point gains were made for",
            outcome.out_of_range_samples
        ));
    }
    warnings.extend(demand::remarks(case));
    warnings.extend(fault_warning(outcome));
    warnings.extend(unknown_figures(&outcome.summary));
    warnings.extend(missing_loops(case, &outcome.summary));
    warnings.extend(streamed_setpoints(&outcome.summary));
    warnings.extend(keys_without_effect([case]));
    warnings.extend(values_of_template(case));
    warnings.extend(remarks::of_case(case));
    if outcome.refused_requests > 0 {
        let words = "requests of [sequence] that the state of the axis did not allow";
        warnings.push(format!("{words}: {}", outcome.refused_requests));
    }
    warnings
}

/// A table that the chip has no room for.
pub(crate) fn streamed_setpoints(summary: &Summary) -> Option<String> {
    let [words, room] = summary.chip.as_ref()?.streamed_words?;
    Some(format!(
        "the table of setpoints has {words} words, the chip's memory room for {room}: they came with \
         the samples, as from a queue"
    ))
}

/// The reason why limits on a chip's figures fail where there is no figure.
fn unknown_figures(summary: &Summary) -> Option<String> {
    let unknown = CHIP_FIGURES.iter().filter(|figure| {
        let is_unknown = |of: &Verdict| of.figure == figure.key && of.value.is_none();
        summary.verdicts.iter().any(is_unknown)
    });
    let unknown = unknown.map(|figure| format!("budget.{}", figure.key));
    let unknown: Vec<String> = unknown.collect();
    if unknown.is_empty() {
        return None;
    }
    let because = match &summary.chip {
        None => "only a chip, over --link, has such figures",
        Some(_) => "this chip does not tell such figures; a board counts no instructions",
    };
    Some(format!("{} cannot pass: {because}", unknown.join(", ")))
}

/// The reasons why limits on figures of a loop fail where there is no such loop.
fn missing_loops(case: &Case, summary: &Summary) -> impl Iterator<Item = String> {
    let unknown = summary.verdicts.iter().filter(|of| of.value.is_none());
    unknown.filter_map(|of| {
        let because = theory::no_figure(case, of.figure)?;
        Some(format!("budget.{} cannot pass: {because}", of.figure))
    })
}

/// The sentence about the keys beyond the paper's law that are set and that the
/// rungs of these cases, which differ in nothing else, leave out.
pub fn keys_without_effect<'c>(cases: impl IntoIterator<Item = &'c Case>) -> Option<String> {
    let leaving = |case: &&Case| !case.keys_without_effect.is_empty();
    let leaving: Vec<&Case> = cases.into_iter().filter(leaving).collect();
    let laws: Vec<Law> = leaving.iter().map(|case| case.controller.law).collect();
    rungs_leave_out(&laws, &leaving.first()?.keys_without_effect)
}

/// The sentence about keys that act on rung `firmware` alone.
pub fn rungs_leave_out(laws: &[Law], keys: &[String]) -> Option<String> {
    let names: Vec<&str> = laws.iter().map(|law| law.name()).collect();
    let rungs = match names.as_slice() {
        [name] => format!("rung {name} leaves out"),
        names => format!("rungs {} leave out", names.join(", ")),
    };
    let act = match keys {
        [] => return None,
        [_] => "it acts",
        _ => "they act",
    };
    let (keys, firmware) = (keys.join(", "), Law::Firmware.name());
    Some(format!("{rungs} {keys}: {act} on rung {firmware}"))
}

/// The first fault in a sentence, and how many there were.
pub(crate) fn fault_warning(outcome: &Outcome) -> Option<String> {
    let summary = &outcome.summary;
    let fault = summary.axis.as_ref()?.fault.as_ref()?;
    let more = match summary.faults {
        Some(faults) if faults > 1 => format!("; {faults} faults in all, this was the first"),
        _ => String::new(),
    };
    let (cause, t_s, message) = (fault.cause, fault.t_s, &fault.message);
    Some(format!("{cause} at {t_s} s: {message}{more}"))
}
