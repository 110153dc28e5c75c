//! Gives a chip the controller of a case.

use core::fmt;

use firmware::{Dac, State};
use firmware_link::request::MOST_SETPOINTS;
use firmware_link::{Events, Request, SourceKind, plan, settings as wire};

use super::super::client::{Client, ClientError};
use super::{ChipLaw, Kind, Meter, RemoteAxis};
use hil_core::case::{Case, Law};
use hil_core::controllers::{
    FROM_REST, Parts, Reported, Setpoint, Setup, Source, StreamedQueue, World, compensated,
};
use hil_core::error::RunError;
use hil_core::message::LinkError;
use hil_core::quantise::{FixedPointGains, QuantiseError};

impl<'c> ChipLaw<'c> {
    /// Begins a session on the chip and gives it the controller of `case`.
    /// `in_qemu`: whether its timer counts instructions.
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

/// Why a chip does not get the controller of a case.
#[derive(Debug)]
#[non_exhaustive]
pub enum ChipLawError {
    /// Only rung `firmware` runs on a chip.
    Law(Law),
    /// The motion is longer than the chip's table of setpoints.
    Table {
        /// Setpoints of the motion.
        needed: usize,
        /// Setpoints that the table holds.
        capacity: u32,
    },
    /// The gains or the motion do not fit the firmware.
    Quantise(QuantiseError),
    /// The chip does not answer, or refuses.
    Client(ClientError),
}

impl fmt::Display for ChipLawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Law(law) => write!(
                f,
                "a chip runs the firmware; the law must be \"firmware\", not \"{}\"",
                law.name()
            ),
            Self::Table { needed, capacity } => write!(
                f,
                "the motion needs {needed} setpoints but the chip's table holds {capacity}; a \
                 longer sample time, a shorter motion or controller.setpoints = \"generator\" \
                 needs fewer"
            ),
            Self::Quantise(error) => error.fmt(f),
            Self::Client(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ChipLawError {}

impl From<QuantiseError> for ChipLawError {
    fn from(error: QuantiseError) -> Self {
        Self::Quantise(error)
    }
}

impl From<ChipLawError> for RunError {
    fn from(error: ChipLawError) -> Self {
        match error {
            ChipLawError::Quantise(refused) => Self::Quantise(refused),
            other => Self::Link(LinkError::Refused(other.to_string())),
        }
    }
}

impl From<ClientError> for ChipLawError {
    fn from(error: ClientError) -> Self {
        Self::Client(error)
    }
}
