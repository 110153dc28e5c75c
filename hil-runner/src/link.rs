//! Where controller and plant meet: counts and codes on one side, angles and
//! volts on the other.
//!
//! A [`Link`] carries one [`Measurement`] to the controller and its
//! [`Command`] back, once per sample. In the same process that is a function
//! call; between two threads it is a pair of channels. Both give the same
//! bits: the plant waits for the answer.

use core::fmt;

use crossbeam_channel::{Receiver, Sender};

use crate::law::Controller;
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
}

/// The controller in the same thread.
impl Link for Controller {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        Ok(self.step(measurement))
    }
}

/// The plant's end of a pair of channels.
#[derive(Debug)]
pub struct ChannelLink {
    measurements: Sender<Measurement>,
    commands: Receiver<Command>,
}

/// The controller's end of a pair of channels.
#[derive(Debug)]
pub struct ChannelController {
    measurements: Receiver<Measurement>,
    commands: Sender<Command>,
}

/// Two ends of a lockstep connection between a plant thread and a controller
/// thread. One message fits in each direction: there is never more in flight.
pub fn channel_pair() -> (ChannelLink, ChannelController) {
    let (measurements, from_plant) = crossbeam_channel::bounded(1);
    let (commands, to_plant) = crossbeam_channel::bounded(1);
    let plant_end = ChannelLink {
        measurements,
        commands: to_plant,
    };
    let controller_end = ChannelController {
        measurements: from_plant,
        commands,
    };
    (plant_end, controller_end)
}

impl Link for ChannelLink {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let tick = measurement.tick;
        let closed = || LinkError::Closed { tick };
        self.measurements.send(measurement).map_err(|_| closed())?;
        let command = self.commands.recv().map_err(|_| closed())?;
        if command.tick != tick {
            return Err(LinkError::WrongTick {
                asked: tick,
                answered: command.tick,
            });
        }
        Ok(command)
    }
}

impl ChannelController {
    /// Answers measurements until the plant's end is dropped.
    pub fn serve(self, mut controller: Controller) {
        for measurement in &self.measurements {
            if self.commands.send(controller.step(measurement)).is_err() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_controller_that_is_gone_is_an_error() {
        let (mut link, controller) = channel_pair();
        drop(controller);
        let measurement = Measurement {
            tick: 7,
            position_counts: 0.0,
            load_counts: None,
        };
        assert_eq!(
            link.exchange(measurement),
            Err(LinkError::Closed { tick: 7 })
        );
    }

    #[test]
    fn an_answer_to_another_sample_is_an_error() {
        let (mut link, controller) = channel_pair();
        let answer = Command {
            tick: 6,
            error_counts: 0.0,
            dac_code: 0.0,
            out_of_range: false,
            busy: None,
            servo: None,
        };
        controller.commands.send(answer).unwrap();
        let measurement = Measurement {
            tick: 7,
            position_counts: 0.0,
            load_counts: None,
        };
        let wrong = LinkError::WrongTick {
            asked: 7,
            answered: 6,
        };
        assert_eq!(link.exchange(measurement), Err(wrong));
    }
}
