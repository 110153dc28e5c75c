//! Points errors of a run at the key of the run file that caused them.

use anyhow::anyhow;
use firmware::SetpointError;
use firmware::law::{LawError, Part};
use hil_runner::error::RunError;
use hil_runner::law::ChipLawError;
use hil_runner::quantise::QuantiseError;
use hil_runner::runfile::RunFile;
use hil_runner::words::key;

/// The error as the user should read it.
pub(super) fn explain(file: &RunFile, error: RunError) -> anyhow::Error {
    let refuse = |key: &str, because: &str| match key.split_once('.') {
        Some((section, key)) => file.refuse(section, key, because).to_string(),
        None => because.to_owned(),
    };
    match error {
        // The same words, wherever they were to run.
        RunError::Chip(ChipLawError::Quantise(error)) => explain(file, RunError::Quantise(error)),
        RunError::Quantise(QuantiseError::Gains(unfit)) => {
            let lines = unfit.iter().map(|gain| refuse(gain.key, &gain.because()));
            anyhow!(lines.collect::<Vec<_>>().join("\n"))
        }
        RunError::Quantise(QuantiseError::Law(error)) => {
            anyhow!(refuse(key_of(&error), &error.to_string()))
        }
        RunError::Quantise(QuantiseError::Setting { key, because, .. }) => {
            anyhow!(refuse(key, &because))
        }
        RunError::Quantise(QuantiseError::DelayUnknown) => {
            anyhow!(refuse("controller.computation_delay_s", &error.to_string()))
        }
        RunError::Quantise(QuantiseError::Motion(error)) => {
            anyhow!(refuse("motion.travel_mm", &error.to_string()))
        }
        RunError::Quantise(QuantiseError::Travel(_)) => {
            anyhow!(refuse("motion.travel_mm", &error.to_string()))
        }
        RunError::Quantise(QuantiseError::Setpoints(SetpointError::TooLong { .. })) => {
            anyhow!(refuse("controller.sample_time_s", &error.to_string()))
        }
        error => anyhow!("{}: {error}", file.case.name),
    }
}

/// The key that a refusal of the law is best laid at.
fn key_of(error: &LawError) -> &'static str {
    let part = match error {
        LawError::Negative { part, .. }
        | LawError::FractionBits { part, .. }
        | LawError::TermTooWide { part, .. } => *part,
        LawError::DerivativeTooCoarse { .. } => Part::Derivative,
        LawError::ErrorSumRange { .. } => Part::Integral,
        LawError::FilterSmoothing(_) | LawError::FilterFractionBits { .. } => {
            return "controller.derivative_filter_s";
        }
        LawError::Tracking(_) => return "controller.tracking_time_s",
        _ => Part::Proportional,
    };
    key(part)
}
