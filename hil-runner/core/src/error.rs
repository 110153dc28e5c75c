//! Why a run could not be made or finished.

use core::fmt;

use plant::PlantError;

use crate::link::LinkError;
use crate::quantise::QuantiseError;

/// Why a run could not be made or finished. Rows up to there were delivered.
#[derive(Debug)]
#[non_exhaustive]
pub enum RunError {
    /// The plant could not be advanced.
    Plant(PlantError),
    /// The controller did not answer.
    Link(LinkError),
    /// The gains or the motion do not fit the firmware.
    Quantise(QuantiseError),
    /// A sampled rung without a sample time.
    NoSampleTime,
    /// A row was not taken: it could not be written, or the run was interrupted.
    Row(std::io::Error),
    /// The run gave no figures: whoever was to make them ended abnormally.
    Lost,
}

impl RunError {
    /// Whether the case makes no run: it was refused before its first sample.
    pub fn is_refusal(&self) -> bool {
        matches!(self, Self::Quantise(_) | Self::NoSampleTime)
    }
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plant(error) => error.fmt(f),
            Self::Link(error) => error.fmt(f),
            Self::Quantise(error) => error.fmt(f),
            Self::NoSampleTime => f.write_str("a sampled law needs controller.sample_time_s"),
            Self::Row(error) => error.fmt(f),
            Self::Lost => f.write_str("the run gave no figures"),
        }
    }
}

impl std::error::Error for RunError {}

impl From<PlantError> for RunError {
    fn from(error: PlantError) -> Self {
        Self::Plant(error)
    }
}
