//! Where controller and plant meet: counts and codes on one side, angles and
//! volts on the other.
//!
//! A [`Link`] carries one [`Measurement`] to the controller and its
//! [`Command`] back, once per sample. In the same process that is a function
//! call; between two threads it is a pair of channels. Both give the same
//! bits: the plant waits for the answer.

use core::fmt;

use crate::chip_cost::{ChipReport, ExecutionFigures};
use crate::controllers::Controller;
use crate::message::{Command, Measurement};

/// Why the controller gave no answer.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum LinkError {
    /// The controller is gone.
    Closed {
        /// Sample at which it was missed.
        tick: u64,
    },
    /// The controller answered another sample than the one asked.
    WrongTick {
        /// Sample that was asked.
        asked: u64,
        /// Sample that was answered.
        answered: u64,
    },
    /// The chip does not take the controller, or tells nothing at the end; a
    /// sentence.
    Refused(String),
    /// The controller on its chip gave no answer.
    Chip {
        /// Sample that was asked.
        tick: u64,
        /// Why, a sentence.
        because: String,
    },
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed { tick } => write!(f, "the controller stopped answering at sample {tick}"),
            Self::WrongTick { asked, answered } => write!(
                f,
                "the controller answered sample {answered} when asked for sample {asked}"
            ),
            Self::Refused(because) => f.write_str(because),
            Self::Chip { tick, because } => write!(f, "at sample {tick}: {because}"),
        }
    }
}

impl std::error::Error for LinkError {}

/// A way to the controller.
pub trait Link {
    /// Sends a measurement and waits for the command.
    ///
    /// # Errors
    /// [`LinkError`] if no or another answer comes; the run cannot go on.
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError>;

    /// After the last sample: the cost of a chip's part of the run, whose steps
    /// took what `_execution` holds; `None` where no chip is at the end.
    ///
    /// # Errors
    /// [`LinkError`] if the chip does not answer any more.
    fn cost(
        &mut self,
        _execution: ExecutionFigures,
        _period_ns: u64,
    ) -> Result<Option<ChipReport>, LinkError> {
        Ok(None)
    }
}

/// The controller in the same thread.
impl Link for Controller {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        Ok(self.step(measurement))
    }
}
