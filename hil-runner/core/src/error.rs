//! Errors of a run.

use plant::PlantError;

use crate::message::LinkError;
use crate::quantise::QuantiseError;

/// A run that could not be made or finished. Rows up to there were delivered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The plant could not be advanced.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The controller did not answer.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The gains or the motion do not fit the firmware.
    #[error(transparent)]
    Quantise(#[from] QuantiseError),
    /// A sampled rung without a sample time.
    #[error("a sampled law needs controller.sample_time_s")]
    NoSampleTime,
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
        matches!(self, Self::Quantise(_) | Self::NoSampleTime)
    }
}
