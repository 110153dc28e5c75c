//! Controller and plant in two threads, a channel in each direction: the shape
//! that real time needs. It gives the same bits as a function call, since the
//! plant waits for the answer.

use crossbeam_channel::{Receiver, Sender};
use hil_core::case::{Case, Law};
use hil_core::controllers::Controller;
use hil_core::error::RunError;
use hil_core::message::{Command, Link, LinkError, Measurement};
use hil_core::quantise::FixedPointGains;
use hil_core::run::{self, Outcome, RowSink, RunOptions};

/// Connection of controller and plant on one machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LinkKind {
    /// A function call: the fast path of everything.
    #[default]
    InProcess,
    /// Two threads and a pair of channels.
    Channel,
}

impl LinkKind {
    /// Runs a case over this connection; see [`run::run`].
    ///
    /// # Errors
    /// As [`run::run`].
    pub fn run(
        self,
        case: &Case,
        options: RunOptions,
        sink: &mut RowSink<'_>,
    ) -> Result<Outcome, RunError> {
        if self == Self::InProcess || case.controller.law == Law::Continuous {
            return run::run(case, options, sink);
        }
        Self::Channel.run_with(case, options, run::controller(case, options.io)?, sink)
    }

    /// The same with a controller that is ready for its first sample.
    ///
    /// # Errors
    /// As [`run::run_over`].
    pub(crate) fn run_with(
        self,
        case: &Case,
        options: RunOptions,
        mut controller: Controller,
        sink: &mut RowSink<'_>,
    ) -> Result<Outcome, RunError> {
        if self == Self::InProcess {
            return run::run_over(case, options, &mut controller, sink);
        }
        let (mut plant_end, controller_end) = channel_pair();
        plant_end.gains = controller.gains();
        std::thread::scope(|scope| {
            let served = scope.spawn(move || controller_end.serve(controller));
            let outcome = run::run_over(case, options, &mut plant_end, sink);
            // Hanging up ends the controller's thread.
            drop(plant_end);
            // A controller that ended abnormally has stopped answering, which the
            // plant's end has told.
            drop(served.join());
            outcome
        })
    }
}

/// The plant's end of a pair of channels.
#[derive(Debug)]
pub struct ChannelLink {
    measurements: Sender<Measurement>,
    commands: Receiver<Command>,
    gains: Option<FixedPointGains>,
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
        gains: None,
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

    fn gains(&self) -> Option<FixedPointGains> {
        self.gains.clone()
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
    use hil_core::message::Steps;

    use super::*;

    #[test]
    fn a_controller_that_is_gone_is_an_error() {
        let (mut link, controller) = channel_pair();
        drop(controller);
        let measurement = Measurement {
            tick: 7,
            position_counts: Steps::Whole(0),
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
        let answer = Command::whole(6, 0, 0);
        controller.commands.send(answer).unwrap();
        let measurement = Measurement {
            tick: 7,
            position_counts: Steps::Whole(0),
            load_counts: None,
        };
        let wrong = LinkError::WrongTick {
            asked: 7,
            answered: 6,
        };
        assert_eq!(link.exchange(measurement), Err(wrong));
    }
}
