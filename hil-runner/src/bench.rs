//! A case on the bench: run, timed on the host, judged.

use crate::budget::{self, Verdict};
use crate::case::Case;
use crate::error::RunError;
use crate::figures::HOST_STEP_P99;
use crate::law::Controller;
use crate::quantise::QuantisedGains;
use crate::run::{Outcome, RowSink, RunOptions, run};
use crate::timing::HostTiming;

/// A case with everything that came out of it.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseRun {
    /// What was run.
    pub case: Case,
    /// What came out.
    pub outcome: Outcome,
    /// Step time on the host, from a second pass; `None` on rung `continuous`.
    pub timing: Option<HostTiming>,
    /// Verdict on the step time, where the budget names it.
    pub timing_verdict: Option<Verdict>,
    /// The gains in the firmware's words; `None` on the other rungs.
    pub words: Option<QuantisedGains>,
    /// What the user should know besides the figures.
    pub warnings: Vec<String>,
}

impl CaseRun {
    /// Runs `case` and, on sampled rungs, times the controller in a second
    /// pass over what it was fed.
    ///
    /// # Errors
    /// [`RunError`]; the rows up to there have been delivered.
    pub fn new(case: &Case, options: RunOptions, sink: &mut RowSink<'_>) -> Result<Self, RunError> {
        let options = RunOptions {
            inputs: true,
            ..options
        };
        let outcome = run(case, options, sink)?;
        let controller = Controller::new(case).map_err(RunError::Quantise)?;
        let words = match &controller {
            Some(Controller::Firmware(law)) => Some(*law.gains()),
            _ => None,
        };
        let timing = controller.and_then(|c| HostTiming::measure(c, &outcome.inputs));
        let (limits, default) = budget::limits(case);
        let timing_verdict = limits
            .iter()
            .find(|limit| limit.figure == HOST_STEP_P99.key)
            .map(|limit| Verdict::new(limit, timing.map(|t| t.p99_us), default));
        let warnings = warnings(&outcome);
        Ok(Self {
            case: case.clone(),
            outcome,
            timing,
            timing_verdict,
            words,
            warnings,
        })
    }

    /// All verdicts, the one on the host's step time last.
    pub fn verdicts(&self) -> impl Iterator<Item = &Verdict> {
        let of_summary = self.outcome.summary.verdicts.iter();
        of_summary.chain(&self.timing_verdict)
    }

    /// Whether all verdicts pass.
    pub fn passes(&self) -> bool {
        self.verdicts().all(|verdict| verdict.pass)
    }
}

fn warnings(outcome: &Outcome) -> Vec<String> {
    let mut warnings = Vec::new();
    if outcome.out_of_range_samples > 0 {
        warnings.push(format!(
            "the firmware worked outside its declared ranges in {} samples: the position error \
             or its sum was larger than the gains' words were made for",
            outcome.out_of_range_samples
        ));
    }
    warnings
}
