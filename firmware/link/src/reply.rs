//! Answers of the controller.

use heapless::Vec;

use crate::body::{Header, Reader, VERSION, halves};
use crate::frame::Frame;
use crate::request::{Events, flag};
use firmware::axis::AxisOutput;
use firmware::faults::{Fault, FaultCause, FaultValues};
use firmware::states::State;

/// Bytes of the largest reply.
pub const LARGEST_REPLY: usize = 62;

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
    /// Number on the line.
    const fn number(self) -> u8 {
        match self {
            Self::Damaged => 0,
            Self::Session => 1,
            Self::Number { .. } => 2,
            Self::Request => 3,
            Self::Configuration { .. } => 4,
            Self::Settings { .. } => 5,
            Self::Memory => 6,
            Self::Driving => 7,
            Self::Plan { .. } => 8,
        }
    }

    /// What is told beside it.
    const fn value(self) -> u32 {
        match self {
            Self::Number { expected: value }
            | Self::Configuration { here: value }
            | Self::Settings { word: value }
            | Self::Plan { stretch: value } => value,
            _ => 0,
        }
    }

    pub(crate) fn write(self, to: &mut Frame) {
        to.put(self.number());
        to.number(self.value(), 4);
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let (number, value) = (from.u8(), from.u32());
        let known = [
            Self::Damaged,
            Self::Session,
            Self::Number { expected: value },
            Self::Request,
            Self::Configuration { here: value },
            Self::Settings { word: value },
            Self::Memory,
            Self::Driving,
            Self::Plan { stretch: value },
        ];
        known.into_iter().find(|nak| nak.number() == number)
    }
}

/// Kinds of replies on the line.
pub(crate) mod kind {
    pub(crate) const HELLO: u8 = 0x81;
    pub(crate) const TAKEN: u8 = 0x82;
    pub(crate) const STEPPED: u8 = 0x87;
    pub(crate) const STATUS: u8 = 0x89;
    pub(crate) const NAK: u8 = 0xff;
}

/// Flags of a step's results, beside the refused requests.
const POWER: u8 = 0x10;
const OUT_OF_RANGE: u8 = 0x20;
const FAULT: u8 = 0x40;

impl Reply {
    /// The reply as a body; it always fits.
    pub fn body(&self, session: u16, number: u32) -> Option<Vec<u8, LARGEST_REPLY>> {
        let kind = match self {
            Self::Hello(_) => kind::HELLO,
            Self::Taken => kind::TAKEN,
            Self::Stepped(_) => kind::STEPPED,
            Self::Status(_) => kind::STATUS,
            Self::Nak(_) => kind::NAK,
        };
        let mut frame = Frame::EMPTY;
        frame.begin(&Header {
            kind,
            session,
            number,
        });
        let to = &mut frame;
        match self {
            Self::Hello(identity) => identity.write(to),
            Self::Taken => {}
            Self::Stepped(stepped) => stepped.write(to),
            Self::Status(status) => to.words(&[status.stack_bytes, status.steps]),
            Self::Nak(nak) => nak.write(to),
        }
        Vec::from_slice(frame.body()?).ok()
    }

    /// A body and its header; `None` if it is no reply.
    pub fn read(body: &[u8]) -> Option<(Header, Self)> {
        let (header, mut from) = Header::read(body)?;
        let reply = match header.kind {
            kind::HELLO => {
                let version = from.u8();
                if version != VERSION {
                    // The rest of another version's may be anything.
                    let identity = Identity {
                        version,
                        ..Identity::default()
                    };
                    return from.is_good().then_some((header, Self::Hello(identity)));
                }
                Self::Hello(Identity::read(&mut from))
            }
            kind::TAKEN => Self::Taken,
            kind::STEPPED => Self::Stepped(Stepped::read(&mut from)?),
            kind::STATUS => Self::Status(Status {
                stack_bytes: from.u32(),
                steps: from.u32(),
            }),
            kind::NAK => Self::Nak(Nak::read(&mut from)?),
            _ => return None,
        };
        from.has_ended().then_some((header, reply))
    }
}

impl Identity {
    pub(crate) fn write(&self, to: &mut Frame) {
        let [a, b, c, d, e, f, g, h] = self.target;
        to.put(self.version);
        to.words(&[
            u32::from_le_bytes([a, b, c, d]),
            u32::from_le_bytes([e, f, g, h]),
            self.image_crc,
            self.flash_bytes,
            self.ram_bytes,
            self.table_capacity,
            self.timer_hz,
        ]);
    }

    /// What follows this version.
    fn read(from: &mut Reader<'_>) -> Self {
        Self {
            version: VERSION,
            target: from.array(),
            image_crc: from.u32(),
            flash_bytes: from.u32(),
            ram_bytes: from.u32(),
            table_capacity: from.u32(),
            timer_hz: from.u32(),
        }
    }
}

impl Stepped {
    fn write(&self, to: &mut Frame) {
        let sample = Sample {
            output: AxisOutput {
                code: self.code,
                power: self.power,
                state: self.state,
                error_counts: self.error_counts,
                out_of_range: self.out_of_range,
            },
            refused: self.refused,
            ticks: self.ticks,
        };
        sample.write(to, self.fault.as_ref());
    }

    fn read(from: &mut Reader<'_>) -> Option<Self> {
        let (code, error_counts) = (from.i32(), from.i32());
        let state = from.choice(&State::ALL)?;
        let flags = from.u8();
        Some(Self {
            code,
            error_counts,
            state,
            power: flags & POWER != 0,
            out_of_range: flags & OUT_OF_RANGE != 0,
            refused: Events::of_bits(flags),
            ticks: from.u32(),
            fault: match flags & FAULT {
                0 => None,
                _ => Some(Fault {
                    cause: from.choice(&FaultCause::ALL)?,
                    tick: from.u64(),
                    values: FaultValues {
                        setpoint: from.i32(),
                        position: from.i32(),
                        error: from.i32(),
                        code: from.i32(),
                        measured: from.i64(),
                        limit: from.i64(),
                    },
                }),
            },
        })
    }
}

/// The part of a [`Stepped`] that a session keeps; the fault is the axis'.
#[derive(Debug)]
pub(crate) struct Sample {
    pub(crate) output: AxisOutput,
    pub(crate) refused: Events,
    pub(crate) ticks: u32,
}

impl Sample {
    /// All zeros, before the first.
    pub(crate) const NONE: Self = Self {
        output: AxisOutput {
            code: 0,
            power: false,
            state: State::Disabled,
            error_counts: 0,
            out_of_range: false,
        },
        refused: Events::NONE,
        ticks: 0,
    };

    pub(crate) fn write(&self, to: &mut Frame, fault: Option<&Fault>) {
        let output = &self.output;
        to.words(&[
            output.code.cast_unsigned(),
            output.error_counts.cast_unsigned(),
        ]);
        to.put(output.state.number());
        to.put(
            self.refused.bits()
                | flag(POWER, output.power)
                | flag(OUT_OF_RANGE, output.out_of_range)
                | flag(FAULT, fault.is_some()),
        );
        to.number(self.ticks, 4);
        if let Some(fault) = fault {
            let values = &fault.values;
            let [a, b] = halves(fault.tick.cast_signed());
            let [g, h] = halves(values.measured);
            let [i, j] = halves(values.limit);
            to.put(fault.cause.number());
            to.words(&[
                a,
                b,
                values.setpoint.cast_unsigned(),
                values.position.cast_unsigned(),
                values.error.cast_unsigned(),
                values.code.cast_unsigned(),
                g,
                h,
                i,
                j,
            ]);
        }
    }
}
