//! Answers of the controller.

use heapless::Vec;

use crate::body::{Header, VERSION};
use crate::body::{Reader, Writer};
use crate::request::Events;
use firmware::faults::{Fault, FaultCause, FaultValues};
use firmware::states::State;

/// Bytes of the largest reply.
pub const LARGEST_REPLY: usize = 72;

/// A controller's answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reply {
    /// To HELLO.
    Hello(Identity),
    /// A part of the configuration was taken.
    Taken,
    /// To a step.
    Stepped(Stepped),
    /// To STATUS.
    Status(Status),
    /// The request was not carried out.
    Nak(Nak),
}

/// Identity of the other end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Version of the protocol ([`VERSION`]).
    pub version: u8,
    /// Name of the target, filled up with zeros.
    pub target: [u8; 8],
    /// CRC-32 of the image in flash, as the controller read it.
    pub image_crc: u32,
    /// Flash that the image takes \[bytes\].
    pub flash_bytes: u32,
    /// Static RAM less the table of setpoints \[bytes\].
    pub ram_bytes: u32,
    /// Setpoints that the table holds.
    pub table_capacity: u32,
    /// Frequency of the timer that [`Stepped::ticks`] counts \[Hz\].
    pub timer_hz: u32,
}

/// Results of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stepped {
    /// Code for the converter.
    pub code: i32,
    /// `e` \[counts\].
    pub error_counts: i32,
    /// State after the sample; that of the paper's controller is
    /// [`State::Moving`].
    pub state: State,
    /// True if the power stage is to be on.
    pub power: bool,
    /// True if a declared range was left.
    pub out_of_range: bool,
    /// Requests that the state refused.
    pub refused: Events,
    /// Time that the sample took \[ticks of the timer\], less an empty
    /// measurement.
    pub ticks: u32,
    /// The fault that is latched.
    pub fault: Option<Fault>,
}

/// Record of the controller since it started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status {
    /// Deepest stack so far \[bytes\]; 0 where it is not known.
    pub stack_bytes: u32,
    /// Samples of this session.
    pub steps: u32,
}

/// Reason for which a request was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Nak {
    /// A frame came damaged; the request that it was has to come again.
    Damaged,
    /// There is no session, or another: the controller has restarted, or serves
    /// someone else.
    Session,
    /// Neither the next request nor the last one.
    Number {
        /// The one that is expected.
        expected: u32,
    },
    /// No such request, or not at this time.
    Request,
    /// The configuration is another than that of the host.
    Configuration {
        /// Its CRC-32 here.
        here: u32,
    },
    /// The firmware refuses the settings.
    Settings,
    /// The table of setpoints is full.
    Table,
    /// The controller drives an axis of its own and serves no host meanwhile.
    Driving,
}

mod kind {
    pub(super) const HELLO: u8 = 0x81;
    pub(super) const TAKEN: u8 = 0x82;
    pub(super) const STEPPED: u8 = 0x87;
    pub(super) const STATUS: u8 = 0x89;
    pub(super) const NAK: u8 = 0xff;
}

mod flag {
    pub(super) const POWER: u8 = 0x10;
    pub(super) const OUT_OF_RANGE: u8 = 0x20;
    pub(super) const FAULT: u8 = 0x40;
}

impl Reply {
    /// The reply as a body; it always fits.
    pub fn body(&self, session: u16, number: u32) -> Option<Vec<u8, LARGEST_REPLY>> {
        let mut to = Writer::new();
        let kind = match self {
            Self::Hello(_) => kind::HELLO,
            Self::Taken => kind::TAKEN,
            Self::Stepped(_) => kind::STEPPED,
            Self::Status(_) => kind::STATUS,
            Self::Nak(_) => kind::NAK,
        };
        Header {
            kind,
            session,
            number,
        }
        .write(&mut to);
        match self {
            Self::Hello(identity) => identity.write(&mut to),
            Self::Taken => {}
            Self::Stepped(stepped) => stepped.write(&mut to),
            Self::Status(status) => {
                to.u32(status.stack_bytes);
                to.u32(status.steps);
            }
            Self::Nak(nak) => {
                let (code, value) = match *nak {
                    Nak::Damaged => (0, 0),
                    Nak::Session => (1, 0),
                    Nak::Number { expected } => (2, expected),
                    Nak::Request => (3, 0),
                    Nak::Configuration { here } => (4, here),
                    Nak::Settings => (5, 0),
                    Nak::Table => (6, 0),
                    Nak::Driving => (7, 0),
                };
                to.u8(code);
                to.u32(value);
            }
        }
        to.finish()
    }

    /// A body and its header; `None` if it is no reply.
    pub fn read(body: &[u8]) -> Option<(Header, Self)> {
        let (header, mut from) = Header::read(body)?;
        let reply = match header.kind {
            // The rest of another version's may be anything.
            kind::HELLO => return Some((header, Self::Hello(Identity::read(from)?))),
            kind::TAKEN => Self::Taken,
            kind::STEPPED => Self::Stepped(Stepped::read(&mut from)?),
            kind::STATUS => Self::Status(Status {
                stack_bytes: from.u32()?,
                steps: from.u32()?,
            }),
            kind::NAK => {
                let (code, value) = (from.u8()?, from.u32()?);
                Self::Nak(match code {
                    0 => Nak::Damaged,
                    1 => Nak::Session,
                    2 => Nak::Number { expected: value },
                    3 => Nak::Request,
                    4 => Nak::Configuration { here: value },
                    5 => Nak::Settings,
                    6 => Nak::Table,
                    7 => Nak::Driving,
                    _ => return None,
                })
            }
            _ => return None,
        };
        from.end()?;
        Some((header, reply))
    }
}

impl Identity {
    fn write<const N: usize>(&self, to: &mut Writer<N>) {
        to.u8(self.version);
        to.bytes(&self.target);
        for number in [
            self.image_crc,
            self.flash_bytes,
            self.ram_bytes,
            self.table_capacity,
            self.timer_hz,
        ] {
            to.u32(number);
        }
    }

    fn read(mut from: Reader<'_>) -> Option<Self> {
        let mut identity = Self {
            version: from.u8()?,
            target: [0; 8],
            image_crc: 0,
            flash_bytes: 0,
            ram_bytes: 0,
            table_capacity: 0,
            timer_hz: 0,
        };
        if identity.version != VERSION {
            return Some(identity);
        }
        for byte in &mut identity.target {
            *byte = from.u8()?;
        }
        for number in [
            &mut identity.image_crc,
            &mut identity.flash_bytes,
            &mut identity.ram_bytes,
            &mut identity.table_capacity,
            &mut identity.timer_hz,
        ] {
            *number = from.u32()?;
        }
        from.end()?;
        Some(identity)
    }
}

impl Stepped {
    fn write<const N: usize>(&self, to: &mut Writer<N>) {
        to.i32(self.code);
        to.i32(self.error_counts);
        to.u8(number_of(&State::ALL, &self.state));
        let mut flags = self.refused.bits();
        for (flag, set) in [
            (flag::POWER, self.power),
            (flag::OUT_OF_RANGE, self.out_of_range),
            (flag::FAULT, self.fault.is_some()),
        ] {
            if set {
                flags |= flag;
            }
        }
        to.u8(flags);
        to.u32(self.ticks);
        let Some(fault) = self.fault else { return };
        to.u8(number_of(&FaultCause::ALL, &fault.cause));
        to.u64(fault.tick);
        let values = fault.values;
        for value in [values.setpoint, values.position, values.error, values.code] {
            to.i32(value);
        }
        to.i64(values.measured);
        to.i64(values.limit);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let code = from.i32()?;
        let error_counts = from.i32()?;
        let state = *State::ALL.get(usize::from(from.u8()?))?;
        let flags = from.u8()?;
        let ticks = from.u32()?;
        let fault = if flags & flag::FAULT != 0 {
            Some(Fault {
                cause: *FaultCause::ALL.get(usize::from(from.u8()?))?,
                tick: from.u64()?,
                values: FaultValues {
                    setpoint: from.i32()?,
                    position: from.i32()?,
                    error: from.i32()?,
                    code: from.i32()?,
                    measured: from.i64()?,
                    limit: from.i64()?,
                },
            })
        } else {
            None
        };
        Some(Self {
            code,
            error_counts,
            state,
            power: flags & flag::POWER != 0,
            out_of_range: flags & flag::OUT_OF_RANGE != 0,
            refused: Events::of_bits(flags),
            ticks,
            fault,
        })
    }
}

/// The place of a value in the list of all.
fn number_of<T: PartialEq>(all: &[T], value: &T) -> u8 {
    let place = all.iter().position(|known| known == value);
    // The lists are complete, and short.
    place
        .and_then(|place| u8::try_from(place).ok())
        .unwrap_or(u8::MAX)
}
