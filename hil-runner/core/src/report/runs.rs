//! Runs as a report shows them: settings, verdicts, figures, curves.

use serde::Serialize;

use super::parameters::{self, Parameter};
use super::traces::Traces;
use crate::budget::Verdict;
use crate::case_run::{CaseRun, HostTiming};
use crate::chip_cost::{ChipReport, StateCost};
use crate::figures::{CHIP_FIGURES, Figure, HOST_STEP_P99, SUMMARY_FIGURES};
use crate::reservation::kept_but;
use crate::summary::Summary;

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseReport {
    /// Name of the run; unique within a report, or the reader cannot tell
    /// two columns apart.
    pub name: String,
    /// The rung: `continuous`, `sampled`, `quantised` or `firmware`.
    pub law: String,
    /// The solver that was really used.
    pub solver: String,
    /// Settings worth seeing beside the result: Δt, bits, K_enc, b, …
    pub parameters: Vec<Parameter>,
    /// Budgets and how they came out; the [`FigureRow`] of the same key has
    /// label, unit and digits.
    pub verdicts: Vec<Verdict>,
    /// The summary's figures in display order.
    pub figures: Vec<FigureRow>,
    /// Time of the controller step on this machine, if measured.
    pub host_timing: Option<HostTiming>,
    /// Reasons not simply to pass if it keeps its limits, in a few words.
    pub reserved: Option<String>,
    /// Remarks that the reader must see, one sentence each.
    pub warnings: Vec<String>,
    /// The curves.
    pub traces: Traces,
}

impl CaseReport {
    pub(super) fn of(run: &CaseRun) -> Self {
        let (case, summary) = (&run.case, &run.outcome.summary);
        let chip = summary.chip.iter();
        let gains = run.outcome.gains.iter();
        let on_host = run.timing_verdict.iter().map(|verdict| FigureRow {
            value: verdict.value,
            ..FigureRow::of(&HOST_STEP_P99, summary)
        });
        Self {
            name: summary.name.clone(),
            law: summary.law.to_owned(),
            solver: summary.solver.to_owned(),
            parameters: parameters::of(case)
                .into_iter()
                .chain(gains.flat_map(parameters::of_words))
                .chain(chip.flat_map(chip_parameters))
                .collect(),
            verdicts: run.verdicts().cloned().collect(),
            figures: SUMMARY_FIGURES
                .iter()
                .map(|figure| FigureRow::of(figure, summary))
                .chain(chip_figures(summary))
                .chain(on_host)
                .collect(),
            host_timing: run.timing,
            reserved: kept_but(&[run.named_reservations()]),
            warnings: run.warnings.clone(),
            traces: Traces::of(case, &run.outcome),
        }
    }
}

/// One key figure of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FigureRow {
    /// Key in the summary, such as `final_error_um`.
    pub key: String,
    /// The same in words.
    pub label: String,
    /// Unit of the value, empty for counts of things.
    pub unit: String,
    /// The value; `None` where the run has no such figure.
    pub value: Option<f64>,
    /// Number of digits that hold; `None` for all that tables show.
    pub digits: Option<usize>,
}

impl FigureRow {
    fn of(figure: &Figure, summary: &Summary) -> Self {
        Self {
            key: figure.key.to_owned(),
            label: figure.label.to_owned(),
            unit: figure.unit.to_owned(),
            value: summary.figure(figure.key),
            digits: summary.digits(figure.key),
        }
    }
}

/// The chip's own account of itself.
fn chip_parameters(chip: &ChipReport) -> Vec<Parameter> {
    use parameters::{text, value};
    vec![
        text("Target", &chip.target, ""),
        text("CRC-32 of the image", &chip.image_hash, ""),
        value("Steps over the link", chip.link_steps as f64, ""),
        value("Clock of the core", chip.clock_hz as f64 / 1e6, "MHz"),
    ]
}

/// The figures of the chip, or those that a budget names in vain; nothing for a
/// run that has to do with no chip.
fn chip_figures(summary: &Summary) -> Vec<FigureRow> {
    let named = |key: &str| summary.verdicts.iter().any(|verdict| verdict.figure == key);
    let of_chip = CHIP_FIGURES
        .iter()
        .filter(|figure| summary.chip.is_some() || named(figure.key))
        .map(|figure| FigureRow::of(figure, summary));
    let states = summary.chip.iter().flat_map(|chip| {
        let counted = match chip.instructions_per_step_max {
            Some(_) => "instructions",
            None => "cycles",
        };
        let rows = chip.states.iter();
        rows.flat_map(move |state| of_state(state, counted))
    });
    of_chip.chain(states).collect()
}

/// The cost of the steps that end in a state.
fn of_state(cost: &StateCost, counted: &str) -> [FigureRow; 2] {
    let row = |figure: &str, words: &str, value: u64| FigureRow {
        key: format!("states.{}.{figure}", cost.state),
        label: format!("{words} {counted} of a step, {}", cost.state),
        unit: String::new(),
        value: Some(value as f64),
        digits: None,
    };
    [
        row("max", "Most", cost.max),
        row("median", "Median", cost.median),
    ]
}
