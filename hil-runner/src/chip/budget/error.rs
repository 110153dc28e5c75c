//! Why there are no figures.

use core::fmt;

use crate::chip::ChipError;
use crate::chip::client::ClientError;
use crate::chip::line::LineError;
use hil_core::error::RunError;
use hil_core::runfile::RunFileErrors;

/// Why there are no figures. What was started has been ended.
#[derive(Debug)]
#[non_exhaustive]
pub enum BudgetError {
    /// There is no line to the chip.
    Chip(ChipError),
    /// The chip does not answer.
    Client(ClientError),
    /// The line has ended before the last figure.
    Line(LineError),
    /// The chip has said nothing for a while.
    Silent,
    /// The chip said what the image for costs does not say.
    Unexpected,
    /// The case that is run does not run.
    Case(RunFileErrors),
    /// The run ended early.
    Run(RunError),
    /// The run visited no state.
    NoSteps,
}

impl fmt::Display for BudgetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Chip(error) => error.fmt(f),
            Self::Client(error) => error.fmt(f),
            Self::Line(error) => error.fmt(f),
            Self::Silent => f.write_str("the chip has stopped telling what its samples cost"),
            Self::Unexpected => f.write_str(
                "the chip tells something else than what its samples cost; its image is of \
                 another version",
            ),
            Self::Case(error) => error.fmt(f),
            Self::Run(error) => error.fmt(f),
            Self::NoSteps => f.write_str("the chip has computed no sample"),
        }
    }
}

impl std::error::Error for BudgetError {}

impl From<ChipError> for BudgetError {
    fn from(error: ChipError) -> Self {
        Self::Chip(error)
    }
}

impl From<ClientError> for BudgetError {
    fn from(error: ClientError) -> Self {
        Self::Client(error)
    }
}

impl From<LineError> for BudgetError {
    fn from(error: LineError) -> Self {
        Self::Line(error)
    }
}

impl From<RunFileErrors> for BudgetError {
    fn from(error: RunFileErrors) -> Self {
        Self::Case(error)
    }
}

impl From<RunError> for BudgetError {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}
