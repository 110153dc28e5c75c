//! Errors of a run, and the keys of the run file that caused them.

use firmware::Refusal;
use firmware::law::Part;
use firmware::refusal::What;
use plant::{Motion, PlantError};

use crate::message::LinkError;
use crate::quantise::{QuantiseError, UnfitGain, key};
use crate::runfile::{RunFile, RunFileErrors, motion_key};

/// A run that could not be made or finished. Rows up to there were delivered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The plant could not be advanced.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The run took more work than `run.work_limit` allows.
    #[error(
        "stopped at t = {time_s} s of {duration_s} s with {work} steps and searches within the \
         samples; run.work_limit = {limit} allows no more. If that is not a small limit, something is far faster than a \
         sample (a time constant from a tiny inductance or inertia, a huge resistance, stiffness \
         or damping) or rattles; a larger run.work_limit lets the run go on"
    )]
    OutOfWork {
        /// Time reached \[s\].
        time_s: f64,
        /// Time of the whole run \[s\].
        duration_s: f64,
        /// Work that was counted.
        work: u64,
        /// `run.work_limit`.
        limit: u64,
    },
    /// The controller did not answer.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The gains or the motion do not fit the firmware.
    #[error(transparent)]
    Quantise(#[from] QuantiseError),
    /// A row was not taken: it could not be written, or the run was interrupted.
    #[error("{0}")]
    Row(std::io::Error),
    /// The run gave no figures: whoever was to make them ended abnormally.
    #[error("the run gave no figures")]
    Lost,
}

impl RunError {
    /// True if the case makes no run: it was refused before its first sample.
    pub fn is_refusal(&self) -> bool {
        matches!(self, Self::Quantise(_))
    }
}

/// The error of a run of this file as the user should read it.
pub fn explain(file: &RunFile, error: &RunError) -> String {
    let lines = refusals(file, error);
    if lines.is_empty() {
        return format!("{}: {error}", file.case.name);
    }
    let lines = lines.iter().map(ToString::to_string);
    lines.collect::<Vec<_>>().join("\n")
}

/// The keys of this file at which the error of a run is best laid, if it is at one.
pub fn refusals(file: &RunFile, error: &RunError) -> Vec<RunFileErrors> {
    let RunError::Quantise(refused) = error else {
        return Vec::new();
    };
    let key = match refused {
        QuantiseError::Gains(unfit) => {
            let refuse = |gain: &UnfitGain| file.refuse(gain.key, &gain.because());
            return unfit.iter().map(refuse).collect();
        }
        QuantiseError::Setting { key, because, .. } => return vec![file.refuse(key, because)],
        QuantiseError::Refused(refusal) => key_of(refusal, &file.case.motion),
        QuantiseError::DelayUnknown => Some("controller.computation_delay_s"),
        _ => None,
    };
    let refuse = |key| file.refuse(key, &refused.to_string());
    key.map(refuse).into_iter().collect()
}

/// The key that a refusal of the firmware is best laid at, if there is one.
fn key_of(refusal: &Refusal, motion: &Motion) -> Option<&'static str> {
    let part = match refusal.what {
        What::Gain(part, _) | What::FractionBits(part, _) | What::Term(part, _) => part,
        What::Terms => Part::Proportional,
        What::Difference(_) => Part::Derivative,
        What::ErrorSum | What::IntegralBits => Part::Integral,
        What::FilterSmoothing | What::FilterFractionBits => {
            return Some("controller.derivative_filter_s");
        }
        What::Tracking => return Some("controller.tracking_time_s"),
        What::Period
        | What::Travel
        | What::Rise
        | What::Fall
        | What::Duration
        | What::Velocity
        | What::Acceleration(_) => return Some(motion_key(motion)),
        _ => return None,
    };
    Some(key(part))
}
