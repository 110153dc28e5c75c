//! Answers of the controller.

use heapless::Vec;

use crate::body::{Header, VERSION, Wire, Writer};
use crate::request::{Events, flag};
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
    /// The firmware refuses a word of the settings.
    Settings {
        /// Its place.
        word: u32,
    },
    /// The memory is full.
    Memory,
    /// The controller drives an axis of its own and serves no host meanwhile.
    Driving,
    /// The plan has a jump, or a stretch that is none.
    Plan {
        /// Place of the stretch.
        stretch: u32,
    },
}

impl Nak {
    /// Every reason, in the order of their numbers on the line.
    const ALL: [Self; 9] = [
        Self::Damaged,
        Self::Session,
        Self::Number { expected: 0 },
        Self::Request,
        Self::Configuration { here: 0 },
        Self::Settings { word: 0 },
        Self::Memory,
        Self::Driving,
        Self::Plan { stretch: 0 },
    ];
}

mod kind {
    pub(super) const HELLO: u8 = 0x81;
    pub(super) const TAKEN: u8 = 0x82;
    pub(super) const STEPPED: u8 = 0x87;
    pub(super) const STATUS: u8 = 0x89;
    pub(super) const NAK: u8 = 0xff;
}

/// Flags of a step's results, beside the refused requests.
const POWER: u8 = 0x10;
const OUT_OF_RANGE: u8 = 0x20;
const FAULT: u8 = 0x40;

impl Reply {
    /// The reply as a body; it always fits.
    pub fn body(mut self, session: u16, number: u32) -> Option<Vec<u8, LARGEST_REPLY>> {
        let kind = match self {
            Self::Hello(_) => kind::HELLO,
            Self::Taken => kind::TAKEN,
            Self::Stepped(_) => kind::STEPPED,
            Self::Status(_) => kind::STATUS,
            Self::Nak(_) => kind::NAK,
        };
        let mut header = Header {
            kind,
            session,
            number,
        };
        Writer::body(|to| {
            header.fields(to)?;
            self.fields(to)
        })
    }

    /// A body and its header; `None` if it is no reply.
    pub fn read(body: &[u8]) -> Option<(Header, Self)> {
        let (header, mut from) = Header::read(body)?;
        let mut reply = match header.kind {
            kind::HELLO => Self::Hello(Identity::default()),
            kind::TAKEN => Self::Taken,
            kind::STEPPED => Self::Stepped(Stepped::default()),
            kind::STATUS => Self::Status(Status::default()),
            kind::NAK => Self::Nak(Nak::Damaged),
            _ => return None,
        };
        reply.fields(&mut from)?;
        match reply {
            // The rest of another version's may be anything.
            Self::Hello(identity) if identity.version != VERSION => {}
            _ => from.end()?,
        }
        Some((header, reply))
    }

    fn fields(&mut self, wire: &mut impl Wire) -> Option<()> {
        match self {
            Self::Hello(identity) => identity.fields(wire),
            Self::Taken => Some(()),
            Self::Stepped(stepped) => stepped.fields(wire),
            Self::Status(status) => {
                wire.u32(&mut status.stack_bytes)?;
                wire.u32(&mut status.steps)
            }
            Self::Nak(nak) => {
                wire.choice(nak, &Nak::ALL)?;
                match nak {
                    Nak::Number { expected: value }
                    | Nak::Configuration { here: value }
                    | Nak::Settings { word: value }
                    | Nak::Plan { stretch: value } => wire.u32(value),
                    _ => wire.u32(&mut 0),
                }
            }
        }
    }
}

impl Identity {
    /// Of another version nothing but the version is known.
    fn fields(&mut self, wire: &mut impl Wire) -> Option<()> {
        wire.u8(&mut self.version)?;
        if self.version != VERSION {
            return Some(());
        }
        self.target.iter_mut().try_for_each(|byte| wire.u8(byte))?;
        wire.u32(&mut self.image_crc)?;
        wire.u32(&mut self.flash_bytes)?;
        wire.u32(&mut self.ram_bytes)?;
        wire.u32(&mut self.table_capacity)?;
        wire.u32(&mut self.timer_hz)
    }
}

impl Stepped {
    fn fields(&mut self, wire: &mut impl Wire) -> Option<()> {
        wire.i32(&mut self.code)?;
        wire.i32(&mut self.error_counts)?;
        wire.choice(&mut self.state, &State::ALL)?;
        let mut flags = self.refused.bits()
            | flag(POWER, self.power)
            | flag(OUT_OF_RANGE, self.out_of_range)
            | flag(FAULT, self.fault.is_some());
        wire.u8(&mut flags)?;
        self.refused = Events::of_bits(flags);
        self.power = flags & POWER != 0;
        self.out_of_range = flags & OUT_OF_RANGE != 0;
        wire.u32(&mut self.ticks)?;
        if flags & FAULT == 0 {
            return Some(());
        }
        let fault = self.fault.get_or_insert(Fault {
            cause: FaultCause::EmergencyStop,
            tick: 0,
            values: FaultValues::default(),
        });
        wire.choice(&mut fault.cause, &FaultCause::ALL)?;
        wire.u64(&mut fault.tick)?;
        wire.i32(&mut fault.values.setpoint)?;
        wire.i32(&mut fault.values.position)?;
        wire.i32(&mut fault.values.error)?;
        wire.i32(&mut fault.values.code)?;
        wire.i64(&mut fault.values.measured)?;
        wire.i64(&mut fault.values.limit)
    }
}
