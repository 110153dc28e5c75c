//! One run as the report shows it: settings, verdicts, figures, traces.

use serde::Serialize;

use super::Traces;

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
    /// Budgets and how they came out.
    pub verdicts: Vec<VerdictRow>,
    /// The summary's figures in display order.
    pub figures: Vec<FigureRow>,
    /// How long the controller step took on this machine, if measured.
    pub host_timing: Option<HostTiming>,
    /// Why it does not simply pass if it keeps its limits, in a few words.
    pub reserved: Option<String>,
    /// Remarks that the reader must see, one sentence each.
    pub warnings: Vec<String>,
    /// The curves.
    pub traces: Traces,
}

impl CaseReport {
    /// Whether every verdict passes; `None` without verdicts.
    pub fn passed(&self) -> Option<bool> {
        if self.verdicts.is_empty() {
            return None;
        }
        Some(self.verdicts.iter().all(|verdict| verdict.pass))
    }
}

/// One setting of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Parameter {
    /// What it is, such as `Sample time Δt`.
    pub label: String,
    /// Its value as it should be read; text, because not every setting is a
    /// number.
    pub value: String,
    /// Unit of the value, empty where there is none.
    pub unit: String,
}

/// One budget and how it came out. The limit is on the magnitude.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictRow {
    /// Key of the figure in the summary; a [`FigureRow`] of the same key
    /// lends its label.
    pub figure: String,
    /// Unit of value, limit and margin.
    pub unit: String,
    /// The figure, signed; `None` where the run has no such figure.
    pub value: Option<f64>,
    /// Largest allowed magnitude.
    pub limit: f64,
    /// Limit less magnitude, negative where the verdict fails.
    pub margin: Option<f64>,
    /// Whether the figure keeps its limit.
    pub pass: bool,
    /// Whether the limit is a default one and not the run file's.
    pub default: bool,
    /// How many digits of the value hold; `None` for all that tables show.
    pub digits: Option<usize>,
    /// The same of the margin.
    pub margin_digits: Option<usize>,
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
    /// How many digits of it hold; `None` for all that tables show.
    pub digits: Option<usize>,
}

/// Duration of the controller step on the host. Wall-clock time: it differs
/// from run to run and decides nothing unless a budget says so.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HostTiming {
    /// Steps measured.
    pub steps: u64,
    /// Median \[µs\].
    pub median_us: f64,
    /// 99th percentile \[µs\].
    pub p99_us: f64,
    /// Longest step \[µs\].
    pub max_us: f64,
    /// Sample time Δt that a step must fit into \[µs\].
    pub sample_time_us: f64,
}
