//! The data of a report: everything that a page shows of one or more runs, or of
//! a ladder, and nothing else.
//!
//! Verdicts and times of the host stand in it as they came out; figures,
//! settings and curves as rows and columns that a page can show without knowing
//! a case.

mod compare;
mod loops;
pub(crate) mod parameters;
mod traces;

use serde::Serialize;

use crate::budget::Verdict;
use crate::chip_cost::{ChipReport, StateCost};
use crate::figures::{CHIP_FIGURES, Figure, HOST_STEP_P99, SUMMARY_FIGURES};
use crate::ladder::{GRID_NS, Rung};
use crate::measured::{LogDifference, MeasuredLog};
use crate::number::{column, column_option, seconds};
use crate::record::GridPoint;
use crate::reservation::kept_but;
use crate::run::{CaseRun, HostTiming, keys_without_effect};
use crate::runfile::values_of_template;
use crate::summary::Summary;
use parameters::{text, value};

pub use compare::{Change, CompareReport, compared};
pub use loops::{LoopReport, NamedLoop};
pub use parameters::Parameter;
pub use traces::{ContactInterval, Traces};

/// Everything that one report shows.
///
/// Its `Serialize` is what the page is rendered from, and the JSON that stands
/// in it: figures in full, curves rounded to
/// [`PLOT_DIGITS`](crate::number::PLOT_DIGITS).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Heading of the page.
    pub title: String,
    /// The command that made the report, shown below the heading.
    pub command_line: String,
    /// Program and version, such as `hil-runner 0.1.0`; no date.
    pub generated_by: String,
    /// Reasons not simply to pass if they keep their limits, in a few words.
    pub reserved: Option<String>,
    /// The runs, in the order in which they are shown.
    pub cases: Vec<CaseReport>,
    /// Set where the runs are one case before and after a change, in this order.
    pub compare: Option<CompareReport>,
    /// The rungs of one case side by side, from `hil-runner ladder`.
    pub ladder: Option<LadderReport>,
    /// The measured log that is laid over all of them.
    pub log: Option<MeasuredLog>,
}

impl Report {
    /// The same with a measured log over it; `differences` are those of the cases,
    /// or of the rungs, in their order.
    #[must_use]
    pub fn with_log(mut self, log: MeasuredLog, differences: Vec<Vec<LogDifference>>) -> Self {
        let rungs = self.ladder.iter_mut().flat_map(|ladder| &mut ladder.rungs);
        let of_rungs = rungs.map(|rung| &mut rung.log);
        let of_cases = self.cases.iter_mut().map(|case| &mut case.log);
        for (place, differences) in of_cases.chain(of_rungs).zip(differences) {
            *place = differences;
        }
        self.log = Some(log);
        self
    }
}

/// The report of one or more runs.
pub fn report(title: &str, command_line: &str, runs: &[CaseRun]) -> Report {
    let named: Vec<_> = runs.iter().map(CaseRun::named_reservations).collect();
    Report {
        title: title.to_owned(),
        command_line: command_line.to_owned(),
        generated_by: concat!("hil-runner ", env!("CARGO_PKG_VERSION")).to_owned(),
        cases: runs.iter().map(CaseReport::of).collect(),
        reserved: kept_but(&named),
        compare: None,
        ladder: None,
        log: None,
    }
}

/// The report of a ladder.
pub fn ladder_report(command_line: &str, rungs: &[Rung]) -> Report {
    let name = rungs.first().map_or("", |rung| &rung.outcome.summary.name);
    Report {
        ladder: Some(LadderReport::of(name, rungs)),
        ..report(&format!("Ladder of {name}"), command_line, &[])
    }
}

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
    /// The linear loop; `None` where there is no sampled one in contact.
    pub loop_curves: Option<LoopReport>,
    /// Differences to the columns of the log.
    pub log: Vec<LogDifference>,
}

impl CaseReport {
    fn of(run: &CaseRun) -> Self {
        Self {
            traces: Traces::of(&run.case, &run.outcome),
            loop_curves: LoopReport::of(&run.case),
            ..Self::without_curves(run)
        }
    }

    /// Everything but the curves of the run and of its loop.
    pub fn without_curves(run: &CaseRun) -> Self {
        let (case, summary) = (&run.case, &run.outcome.summary);
        let of_chip = summary.chip.iter().flat_map(chip_parameters);
        let of_words = run.outcome.gains.iter().flat_map(parameters::of_words);
        let parameters = parameters::of(case).into_iter();
        let figure = |figure| FigureRow::of(figure, summary);
        let figures = SUMMARY_FIGURES.iter().map(figure);
        let figures = figures.chain(chip_figures(summary));
        let on_host = run.timing_verdict.iter().map(|verdict| FigureRow {
            value: verdict.value,
            ..FigureRow::of(&HOST_STEP_P99, summary)
        });
        Self {
            name: summary.name.clone(),
            law: summary.law.to_owned(),
            solver: summary.solver.to_owned(),
            parameters: parameters.chain(of_words).chain(of_chip).collect(),
            verdicts: run.verdicts().cloned().collect(),
            figures: figures.chain(on_host).collect(),
            host_timing: run.timing,
            reserved: kept_but(&[run.named_reservations()]),
            warnings: run.warnings.clone(),
            traces: Traces::default(),
            loop_curves: None,
            log: Vec::new(),
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
    let is_told = |figure: &&Figure| summary.chip.is_some() || named(figure.key);
    let of_chip = CHIP_FIGURES.iter().filter(is_told);
    let of_chip = of_chip.map(|figure| FigureRow::of(figure, summary));
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

/// A figure, and the number of its digits that hold; `None` for all that tables
/// show.
pub type Held = (Option<f64>, Option<usize>);

/// All rungs of one case, their differences on common rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderReport {
    /// Name of the case.
    pub case: String,
    /// Remarks that hold for several rungs, one sentence each.
    pub warnings: Vec<String>,
    /// Times of the common rows \[s\], ascending.
    #[serde(serialize_with = "column")]
    pub t_s: Vec<f64>,
    /// The rungs from the bottom up.
    pub rungs: Vec<LadderRung>,
}

impl LadderReport {
    fn of(case: &str, rungs: &[Rung]) -> Self {
        let first = rungs.first();
        let rows = first.map_or(0, |rung| rung.outcome.grid.len());
        let ticks = 0..u64::try_from(rows).unwrap_or(0);
        let without_effect = keys_without_effect(rungs.iter().map(|rung| &rung.case));
        let of_template = first.and_then(|rung| values_of_template(&rung.case));
        let below = std::iter::once(None).chain(rungs.iter().map(Some));
        let of_rung = |(rung, below)| LadderRung::of(rung, below);
        Self {
            case: case.to_owned(),
            warnings: without_effect.into_iter().chain(of_template).collect(),
            t_s: ticks.map(|tick| seconds(tick * GRID_NS)).collect(),
            rungs: rungs.iter().zip(below).map(of_rung).collect(),
        }
    }
}

/// One rung. "Below" is the rung before it in [`LadderReport::rungs`];
/// differences are this rung less the one below and `None` on the lowest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderRung {
    /// Name of the rung.
    pub name: String,
    /// The effect it adds, such as `sampling, computation delay`.
    pub adds: String,
    /// sup of |ẍ| \[m/s²\].
    pub peak_abs_acc_mps2: Held,
    /// sup of |x_ref − x| \[mm\].
    pub peak_following_error_mm: Held,
    /// x_ref − x at the end \[µm\], signed.
    pub final_error_um: Held,
    /// Changes of `contact`.
    pub contact_changes: Held,
    /// Root mean square of the difference of ẍ over the rows \[m/s²\].
    pub rms_acc_diff_mps2: Held,
    /// Root mean square of the difference of x over the rows \[µm\].
    pub rms_pos_diff_um: Held,
    /// Remarks that the reader must see, one sentence each.
    pub warnings: Vec<String>,
    /// Its curves.
    pub traces: Traces,
    /// Differences to the columns of the log.
    pub log: Vec<LogDifference>,
    /// Difference of ẍ to the rung below on the rows \[m/s²\].
    #[serde(serialize_with = "column_option")]
    pub acc_diff_mps2: Option<Vec<f64>>,
    /// Difference of x to the rung below on the rows \[µm\].
    #[serde(serialize_with = "column_option")]
    pub pos_diff_um: Option<Vec<f64>>,
}

impl LadderRung {
    fn of(rung: &Rung, below: Option<&Rung>) -> Self {
        let summary = &rung.outcome.summary;
        let held = |key: &str| (summary.figure(key), summary.digits(key));
        let [acc_digits, position_digits] = rung.difference_digits;
        let difference = |of: fn(&GridPoint, &GridPoint) -> f64| {
            let lower = &below?.outcome.grid;
            let rows = rung.outcome.grid.iter().zip(lower);
            Some(rows.map(|(u, l)| of(u, l)).collect())
        };
        Self {
            name: rung.name(),
            adds: rung.adds().to_owned(),
            peak_abs_acc_mps2: held("peak_abs_acc_mps2"),
            peak_following_error_mm: held("peak_following_error_mm"),
            final_error_um: held("final_error_um"),
            contact_changes: held("contact_changes"),
            rms_acc_diff_mps2: (rung.difference.map(|d| d.rms_acc_mps2), acc_digits),
            rms_pos_diff_um: (rung.difference.map(|d| d.rms_position_um), position_digits),
            warnings: rung.warnings(),
            traces: Traces::of(&rung.case, &rung.outcome),
            log: Vec::new(),
            acc_diff_mps2: difference(|u, l| u.acc_mps2 - l.acc_mps2),
            pos_diff_um: difference(|u, l| 1e6 * (u.x_m - l.x_m)),
        }
    }
}
