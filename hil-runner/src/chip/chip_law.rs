//! Rung `firmware` on a chip: the same parameters, the same registers and the
//! same requests as on the host, over a line; the codes come back.

use firmware::axis::Inputs;
use firmware::law::Law as AxisLaw;
use firmware::{Dac, Next, Observed, State, counts};
use firmware_link::request::MOST_SETPOINTS;
use firmware_link::{
    Events, Identity, Reply, Request, SourceKind, Step, Stepped, plan, settings as wire,
};
use hil_core::case::{Case, Law};
use hil_core::chip_cost::{Chip, ChipReport, ExecutionFigures};
use hil_core::controllers::{
    Arrivals, FROM_REST, Parts, Reported, Setpoint, Setup, Source, StreamedQueue, World,
    compensated,
};
use hil_core::error::RunError;
use hil_core::message::{Command, Link, LinkError, Measurement};
use hil_core::quantise::{FixedPointGains, QuantiseError};
use hil_core::run::{Outcome, RowSink, RunOptions, run_over};
use thiserror::Error;

use super::client::{Client, ClientError};
use super::meter::Meter;

/// A configured chip, sample by sample.
#[derive(Debug)]
pub struct ChipLaw<'c> {
    client: &'c mut Client,
    kind: Kind,
    gains: FixedPointGains,
    /// The converter that the codes are for.
    dac: Dac,
    meter: Meter,
}

/// The controller on the chip.
#[derive(Debug)]
enum Kind {
    /// The paper's law alone.
    Paper,
    /// An axis.
    Axis(Box<RemoteAxis>),
}

/// The host's part of an axis on a chip.
#[derive(Debug)]
struct RemoteAxis {
    world: World,
    reported: Reported,
    /// The law that the chip has, and the one from the gain change on.
    law: AxisLaw,
    next_law: Option<AxisLaw>,
    /// The queue, where the setpoints come with the samples.
    queue: Option<Box<StreamedQueue>>,
}

impl ChipLaw<'_> {
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
        let count = counts::wrap(measurement.position_counts.whole());
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
            out_of_range: stepped.out_of_range,
            execution: Some(self.meter.time(stepped.ticks)),
            ..Command::whole(measurement.tick, stepped.error_counts, stepped.code)
        })
    }
}

impl RemoteAxis {
    /// Everything that comes before the sample, and the sample itself.
    fn prepare(
        &mut self,
        client: &mut Client,
        tick: u64,
        arrivals: Arrivals,
    ) -> Result<Step, ClientError> {
        let mut events = Events::default();
        for event in arrivals.events.into_iter().flatten() {
            self.reported.asked(event);
            events.insert(event);
        }
        if arrivals.gains_change
            && let Some(law) = self.next_law
            && law != self.law
        {
            let payload = wire::write_law(&law).ok_or(ClientError::TooLong)?;
            client.take(&Request::Law(&payload))?;
            self.law = law;
        }
        let shown = arrivals.shown;
        let inputs = Inputs {
            tick,
            motor_register: if shown.bus_fails {
                0
            } else {
                shown.motor_register
            },
            load_register: shown.load_register,
            emergency_stop: shown.emergency_stop,
            failed_transfers: u32::from(shown.bus_fails),
        };
        let mut next = Next::Underrun;
        if let Some(queue) = &mut self.queue {
            queue.fill(arrivals.queue_is_dry);
            // Only an axis that moves takes from the queue.
            if self.reported.state() == State::Moving {
                next = queue.next(&Observed::default());
            }
        }
        Ok(Step {
            events,
            inputs,
            motor_unread: shown.bus_fails,
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
        let Some(arrivals) = axis.world.at(measurement) else {
            return Ok(axis.reported.command(tick, false));
        };
        let step = axis.prepare(self.client, tick, arrivals)?;
        let stepped = self.step(step)?;
        let execution = Some(self.meter.time(stepped.ticks));
        let Kind::Axis(axis) = &mut self.kind else {
            return Err(ClientError::Unexpected);
        };
        // Without power the amplifier gets 0 V, whatever the code.
        let code = if stepped.power { stepped.code } else { 0 };
        axis.reported
            .sampled(stepped.state, stepped.error_counts, code, stepped.fault);
        Ok(Command {
            execution,
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

    fn gains(&self) -> Option<FixedPointGains> {
        Some(self.gains.clone())
    }

    fn cost(
        &mut self,
        execution: ExecutionFigures,
        period_ns: u64,
    ) -> Result<Option<ChipReport>, LinkError> {
        let status = match self.client.request(&Request::Status) {
            Ok(Reply::Status(status)) => status,
            Ok(_) => return Err(LinkError::Refused(ClientError::Unexpected.to_string())),
            Err(error) => return Err(LinkError::Refused(error.to_string())),
        };
        let identity = self.client.identity();
        let chip = Chip {
            name: name_of(identity),
            image_crc: identity.image_crc,
            flash_bytes: identity.flash_bytes,
            ram_bytes: identity.ram_bytes,
            stack_bytes: Some(status.stack_bytes).filter(|bytes| *bytes > 0),
            clock_hz: self.meter.clock_hz(),
        };
        Ok(Some(execution.report(chip, period_ns)))
    }
}

impl<'c> ChipLaw<'c> {
    /// Begins a session on the chip and gives it the controller of `case`.
    /// `in_qemu`: its timer counts instructions.
    ///
    /// # Errors
    /// [`ChipLawError`] if the case has no such controller, or the chip does not
    /// take it.
    pub fn new(client: &'c mut Client, case: &Case, in_qemu: bool) -> Result<Self, ChipLawError> {
        let Some(period_ns) = case.controller.sample_time_ns else {
            return Err(ChipLawError::Quantise(QuantiseError::NoSampleTime));
        };
        if case.controller.law != Law::Firmware {
            return Err(ChipLawError::Law(case.controller.law));
        }
        let dac = Dac::with_bits(case.dac.bits).map_err(QuantiseError::Dac)?;
        client.begin_session()?;
        let (kind, gains) = if case.options.is_off() {
            paper(client, case, period_ns)?
        } else {
            axis(client, case, period_ns)?
        };
        let meter = Meter::new(client.identity(), in_qemu, case.target);
        Ok(Self {
            client,
            kind,
            gains,
            dac,
            meter,
        })
    }
}

fn paper(
    client: &mut Client,
    case: &Case,
    period_ns: u64,
) -> Result<(Kind, FixedPointGains), ChipLawError> {
    let Parts { gains, dac } = Parts::of(case, period_ns)?;
    let payload = wire::write_paper(gains.pid.words(), dac).ok_or(ClientError::TooLong)?;
    client.take(&Request::Paper(&payload))?;
    let table = Setpoint::new(case, period_ns).table()?;
    send_table(client, table.as_counts())?;
    client.begin(SourceKind::Table, Events::default())?;
    Ok((Kind::Paper, gains.fixed_point()))
}

fn axis(
    client: &mut Client,
    case: &Case,
    period_ns: u64,
) -> Result<(Kind, FixedPointGains), ChipLawError> {
    let setup = Setup::of(case, period_ns)?;
    let scaled = setup.law()?;
    let axis = compensated(&setup, scaled.law)?;
    let payload = wire::write_axis(&axis).ok_or(ClientError::TooLong)?;
    client.take(&Request::Axis(&payload))?;
    let mut queue: Option<Box<StreamedQueue>> = None;
    let source = match setup.source()? {
        Source::Table(table) => {
            send_table(client, table.table().as_counts())?;
            SourceKind::Table
        }
        Source::Generator(generator) => {
            for part in plan::parts(generator.plan()) {
                client.take(&Request::Plan(&part))?;
            }
            SourceKind::Plan
        }
        Source::Queue(streamed) => {
            queue = Some(streamed);
            SourceKind::Step
        }
    };
    let mut events = Events::default();
    let mut reported = Reported::new(State::Disabled);
    for event in FROM_REST {
        reported.asked(event);
        events.insert(event);
    }
    client.begin(source, events)?;
    let kind = Kind::Axis(Box::new(RemoteAxis {
        world: World::new(&case.options, period_ns),
        reported,
        law: scaled.law,
        next_law: setup.next_law()?,
        queue,
    }));
    Ok((kind, scaled.fixed_point()))
}

fn send_table(client: &mut Client, setpoints: &[i32]) -> Result<(), ChipLawError> {
    let capacity = client.identity().table_capacity;
    if u32::try_from(setpoints.len()).is_ok_and(|needed| needed > capacity) {
        return Err(ChipLawError::Table {
            needed: setpoints.len(),
            capacity,
        });
    }
    for some in setpoints.chunks(MOST_SETPOINTS) {
        let bytes: Vec<u8> = some.iter().flat_map(|count| count.to_le_bytes()).collect();
        client.take(&Request::Setpoints(&bytes))?;
    }
    Ok(())
}

/// A chip for a run, and the reading of its timer.
#[derive(Debug)]
pub struct ChipUnderTest<'c> {
    /// The line to it.
    pub client: &'c mut Client,
    /// True if it runs in QEMU: its timer counts instructions then.
    pub in_qemu: bool,
}

/// Runs a case of rung `firmware` with its controller on a chip, and delivers
/// its rows to `sink`. Every code is the chip's; the plant's time stands still
/// until it is there. Where the delay is measured, each code acts so long after
/// its sample as its step took by the chip's clock.
///
/// # Errors
/// As [`run_over`], and [`LinkError::Refused`] if the chip does not take the
/// controller or does not answer at the end.
pub fn run_on_chip(
    case: &Case,
    options: RunOptions,
    chip: &mut ChipUnderTest<'_>,
    sink: &mut RowSink<'_>,
) -> Result<Outcome, RunError> {
    let mut law = ChipLaw::new(chip.client, case, chip.in_qemu)?;
    run_over(case, options, &mut law, sink)
}

/// The name that a chip gives itself; what is no letter, number or sign is a question
/// mark.
pub fn name_of(identity: &Identity) -> String {
    let name = identity.target.iter().take_while(|byte| **byte != 0);
    name.map(|byte| match char::from(*byte) {
        sign if sign.is_ascii_graphic() => sign,
        _ => '?',
    })
    .collect()
}

/// A reason for which a chip does not get the controller of a case.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ChipLawError {
    /// Only rung `firmware` runs on a chip.
    #[error("a chip runs the firmware; the law must be \"firmware\", not \"{}\"", .0.name())]
    Law(Law),
    /// The motion is longer than the chip's table of setpoints.
    #[error(
        "the motion needs {needed} setpoints but the chip's table holds {capacity}; a longer sample \
         time, a shorter motion or controller.setpoints = \"generator\" needs fewer"
    )]
    Table {
        /// Setpoints of the motion.
        needed: usize,
        /// Setpoints that the table holds.
        capacity: u32,
    },
    /// The gains or the motion do not fit the firmware.
    #[error(transparent)]
    Quantise(#[from] QuantiseError),
    /// The chip does not answer, or refuses.
    #[error(transparent)]
    Client(#[from] ClientError),
}

impl From<ChipLawError> for RunError {
    fn from(error: ChipLawError) -> Self {
        match error {
            ChipLawError::Quantise(refused) => Self::Quantise(refused),
            other => Self::Link(LinkError::Refused(other.to_string())),
        }
    }
}
