//! A case on the bench: run, timed on the host, judged.

use crate::budget::{self, Verdict};
use crate::case::{Case, Law};
use crate::error::RunError;
use crate::figures::{CHIP_FIGURES, HOST_STEP_P99};
use crate::law::Controller;
use crate::report::number;
use crate::run::{ChipUnderTest, Outcome, RowSink, RunOptions, run, run_on_chip};
use crate::summary::Summary;
use crate::time::seconds;
use crate::timing::HostTiming;
use crate::words::CaseWords;

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
    pub words: Option<CaseWords>,
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
        let controller = Controller::new(case, options.io).map_err(RunError::Quantise)?;
        let timed = controller.clone();
        let timing = timed.and_then(|c| HostTiming::measure(c, &outcome.inputs));
        Ok(Self::of(case, outcome, controller.as_ref(), timing))
    }

    /// Runs `case` with its controller on a chip. The time of a step on this
    /// host means nothing then and is not taken.
    ///
    /// # Errors
    /// [`RunError`]; the rows up to there have been delivered.
    pub fn on_chip(
        case: &Case,
        options: RunOptions,
        chip: &mut ChipUnderTest<'_>,
        sink: &mut RowSink<'_>,
    ) -> Result<Self, RunError> {
        let outcome = run_on_chip(case, options, chip, sink)?;
        let controller = Controller::new(case, options.io).map_err(RunError::Quantise)?;
        Ok(Self::of(case, outcome, controller.as_ref(), None))
    }

    fn of(
        case: &Case,
        outcome: Outcome,
        controller: Option<&Controller>,
        timing: Option<HostTiming>,
    ) -> Self {
        let words = match controller {
            Some(Controller::Firmware(law)) => Some(CaseWords::from(law.gains())),
            Some(Controller::Servo(law)) => Some(CaseWords::from(law.words())),
            _ => None,
        };
        let (limits, default) = budget::limits(case);
        let timing_verdict = limits
            .iter()
            .find(|limit| limit.figure == HOST_STEP_P99.key)
            .map(|limit| Verdict::new(limit, timing.map(|t| t.p99_us), default));
        let warnings = warnings(case, &outcome);
        Self {
            case: case.clone(),
            outcome,
            timing,
            timing_verdict,
            words,
            warnings,
        }
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

/// What the figures alone do not make plain.
fn warnings(case: &Case, outcome: &Outcome) -> Vec<String> {
    let mut warnings = Vec::new();
    let (end_s, motion_end_s) = (seconds(case.run.duration_ns), case.motion.end_s());
    if end_s < motion_end_s {
        warnings.push(format!(
            "the run ends at {end_s} s, before the motion does ({motion_end_s} s): final, settling \
             and peak figures are those of a part of the move"
        ));
    } else if outcome.summary.settling_time_s.is_none() {
        warnings.push(format!(
            "not settled: the carriage ends {} µm from its command, outside the band of ±{} µm \
             (run.settling_band_um); no default limit looks at that",
            number::table(outcome.summary.final_error_um),
            number::table(case.run.settling_band_um)
        ));
    }
    if outcome.out_of_range_samples > 0 {
        warnings.push(format!(
            "the firmware worked outside its declared ranges in {} samples: the position error \
             or its sum was larger than the gains' words were made for",
            outcome.out_of_range_samples
        ));
    }
    warnings.extend(fault_warning(outcome));
    warnings.extend(unknown_figures(&outcome.summary));
    warnings.extend(keys_without_effect([case]));
    if outcome.refused_requests > 0 {
        warnings.push(format!(
            "requests of [sequence] that the state of the axis did not allow: {}",
            outcome.refused_requests
        ));
    }
    warnings
}

/// Why limits on a chip's figures fail where there is no figure.
fn unknown_figures(summary: &Summary) -> Option<String> {
    let unknown: Vec<String> = CHIP_FIGURES
        .iter()
        .filter(|figure| {
            let of_figure = |verdict: &&Verdict| verdict.figure == figure.key;
            let verdict = summary.verdicts.iter().find(of_figure);
            verdict.is_some_and(|verdict| verdict.value.is_none())
        })
        .map(|figure| format!("budget.{}", figure.key))
        .collect();
    if unknown.is_empty() {
        return None;
    }
    let because = match &summary.chip {
        None => "only a chip, over --link, has such figures",
        Some(_) => "this chip does not tell such figures; a board counts no instructions",
    };
    Some(format!("{} cannot pass: {because}", unknown.join(", ")))
}

/// The sentence about the keys beyond the paper's law that are set and that the
/// rungs of these cases, which differ in nothing else, leave out.
pub fn keys_without_effect<'c>(cases: impl IntoIterator<Item = &'c Case>) -> Option<String> {
    let cases = cases.into_iter();
    let leaving: Vec<&Case> = cases
        .filter(|case| !case.keys_without_effect.is_empty())
        .collect();
    let laws: Vec<Law> = leaving.iter().map(|case| case.controller.law).collect();
    rungs_leave_out(&laws, &leaving.first()?.keys_without_effect)
}

/// The sentence about keys that act on rung `firmware` alone.
pub(crate) fn rungs_leave_out(laws: &[Law], keys: &[String]) -> Option<String> {
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
    let firmware = Law::Firmware.name();
    Some(format!(
        "{rungs} {}: {act} on rung {firmware}",
        keys.join(", ")
    ))
}

/// The first fault in a sentence, and how many there were.
pub fn fault_warning(outcome: &Outcome) -> Option<String> {
    let summary = &outcome.summary;
    let fault = summary.axis.as_ref()?.fault.as_ref()?;
    let more = match summary.faults {
        Some(faults) if faults > 1 => format!("; {faults} faults in all, this was the first"),
        _ => String::new(),
    };
    let (cause, t_s, message) = (fault.cause, fault.t_s, &fault.message);
    Some(format!("{cause} at {t_s} s: {message}{more}"))
}
