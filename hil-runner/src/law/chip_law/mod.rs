//! Rung `firmware` on a chip: the same parameters, the same registers and the
//! same requests as on the host, over a line; the codes come back.

mod configure;
mod meter;

use firmware::axis::Inputs;
use firmware::law::Law;
use firmware::{Board, Dac, Next, Observed, State, counts};
use firmware_link::{Events, Reply, Request, Status, Step, Stepped, settings as wire};

use super::servo_law::{BenchBoard, Reported, StreamedQueue, World};
use super::whole;
use crate::chip::client::{Client, ClientError};
use crate::link::{Link, LinkError};
use crate::message::{Command, Measurement};

pub use configure::ChipLawError;
pub use meter::Meter;

/// A configured chip, sample by sample.
#[derive(Debug)]
pub struct ChipLaw<'c> {
    client: &'c mut Client,
    kind: Kind,
    /// The converter that the codes are for.
    dac: Dac,
    meter: Meter,
}

/// What runs on the chip.
#[derive(Debug)]
enum Kind {
    /// The paper's law alone.
    Paper,
    /// An axis.
    Axis(Box<RemoteAxis>),
}

/// What the host keeps for an axis on a chip.
#[derive(Debug)]
struct RemoteAxis {
    world: World,
    reported: Reported,
    /// Makes registers of counts, as on the host.
    board: BenchBoard,
    /// The law that the chip has, and the one from the gain change on.
    law: Law,
    next_law: Option<Law>,
    /// Where the setpoints come with the samples.
    queue: Option<Box<StreamedQueue>>,
}

impl ChipLaw<'_> {
    /// How the chip has fared, and the clock that its times are given at
    /// \[Hz\].
    ///
    /// # Errors
    /// [`ChipLawError`] if the chip does not answer.
    pub fn end(self) -> Result<(Status, u64), ChipLawError> {
        match self.client.request(&Request::Status)? {
            Reply::Status(status) => Ok((status, self.meter.clock_hz())),
            _ => Err(ChipLawError::Client(ClientError::Unexpected)),
        }
    }

    fn step(&mut self, step: Step) -> Result<Stepped, ClientError> {
        let stepped = self.client.step(step)?;
        // A frame that is whole may still come from a controller that is not.
        let code = stepped.code;
        if code < self.dac.min_code() || code > self.dac.max_code() {
            let largest = self.dac.max_code();
            return Err(ClientError::Code { code, largest });
        }
        Ok(stepped)
    }

    /// The paper's law: a register in, a code out.
    fn paper(&mut self, measurement: Measurement) -> Result<Command, ClientError> {
        let count = counts::wrap(whole(measurement.position_counts));
        let stepped = self.step(Step {
            events: Events::default(),
            inputs: Inputs {
                tick: measurement.tick,
                motor_register: count.cast_unsigned(),
                ..Inputs::default()
            },
            motor_unread: false,
            next: Next::Underrun,
        })?;
        Ok(Command {
            tick: measurement.tick,
            error_counts: f64::from(stepped.error_counts),
            dac_code: f64::from(stepped.code),
            out_of_range: stepped.out_of_range,
            busy: Some(self.meter.busy(stepped.ticks)),
            servo: None,
        })
    }
}

impl RemoteAxis {
    /// Everything that comes before the sample, and the sample itself.
    fn prepare(
        &mut self,
        client: &mut Client,
        measurement: Measurement,
    ) -> Result<Step, ClientError> {
        let tick = measurement.tick;
        let mut events = Events::default();
        for event in self.world.events(tick) {
            self.reported.asked(event);
            events.insert(event);
        }
        if self.world.changes_gains(tick)
            && let Some(law) = self.next_law
            && law != self.law
        {
            let payload = wire::write_law(&law).ok_or(ClientError::TooLong)?;
            client.take(&Request::Law(&payload))?;
            self.law = law;
        }
        self.board.set_inputs(self.world.shown(measurement));
        let motor = self.board.motor_register();
        let inputs = Inputs {
            tick,
            motor_register: motor.as_ref().copied().unwrap_or(0),
            // Neither of the two can fail here.
            load_register: self.board.load_register().ok().flatten(),
            emergency_stop: self.board.emergency_stop().unwrap_or(false),
            failed_transfers: u32::from(motor.is_err()),
        };
        let mut next = Next::Underrun;
        if let Some(queue) = &mut self.queue {
            queue.fill(self.world.queue_is_dry(tick));
            // Only an axis that moves takes from the queue.
            if self.reported.state() == State::Moving {
                next = queue.next(&Observed::default());
            }
        }
        Ok(Step {
            events,
            inputs,
            motor_unread: motor.is_err(),
            next,
        })
    }
}

impl ChipLaw<'_> {
    fn sample(&mut self, measurement: Measurement) -> Result<Command, ClientError> {
        let Kind::Axis(axis) = &mut self.kind else {
            return self.paper(measurement);
        };
        let tick = measurement.tick;
        if axis.world.misses(tick) {
            return Ok(axis.reported.command(tick, false));
        }
        let step = axis.prepare(self.client, measurement)?;
        let stepped = self.step(step)?;
        let busy = Some(self.meter.busy(stepped.ticks));
        let Kind::Axis(axis) = &mut self.kind else {
            return Err(ClientError::Unexpected);
        };
        // Without power the amplifier gets 0 V, whatever the code.
        let code = if stepped.power { stepped.code } else { 0 };
        axis.reported
            .sampled(stepped.state, stepped.error_counts, code, stepped.fault);
        Ok(Command {
            busy,
            ..axis.reported.command(tick, stepped.out_of_range)
        })
    }
}

impl Link for ChipLaw<'_> {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let tick = measurement.tick;
        self.sample(measurement).map_err(|error| LinkError::Chip {
            tick,
            because: error.to_string(),
        })
    }
}
