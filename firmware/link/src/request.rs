//! Requests of the host.

use heapless::Vec;

use crate::body::{Header, Reader, Wire, Writer};
use crate::frame::LARGEST_BODY;
use firmware::Codes;
use firmware::axis::Inputs;
use firmware::reference::{Next, Setpoint, Stretch};
use firmware::states::Event;

/// Words of one [`Request::Memory`] at most.
pub const MOST_WORDS: usize = 44;

/// A request to the controller.
///
/// All but [`Request::Hello`] and [`Request::Status`] change something; they
/// are numbered from 1 in a session, each is carried out once, and the reply to
/// the last one is kept for a repetition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Request<'a> {
    /// Begins a session, unless it is the present one.
    Hello,
    /// The axis' settings ([`crate::settings::read`]); behind BEGIN other ones of
    /// the axis that runs, from the next sample on.
    Settings(&'a [u8]),
    /// The next words of the memory, 4 bytes each: setpoints of the table
    /// \[counts\], or a plan ([`crate::plan::words`]).
    Memory(&'a [u8]),
    /// The configuration is complete.
    Begin {
        /// CRC-32 over kind and payload of every part, in their order.
        configuration: u32,
        /// Source of the axis' setpoints.
        source: SourceKind,
        /// Asked for at once, before the first sample.
        events: Events,
    },
    /// One sample.
    Step(Step),
    /// Asks for the record of the controller so far.
    Status,
}

/// Source of a controller's setpoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceKind {
    /// The memory is a table of setpoints.
    Table,
    /// The memory is a planned motion.
    Plan,
    /// They come with every [`Step`].
    Step,
}

impl SourceKind {
    /// Every kind, in the order of their numbers on the line.
    const ALL: [Self; 3] = [Self::Table, Self::Plan, Self::Step];
}

/// Inputs of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Asked for before the sample, in this order: disable, reset, enable, start.
    pub events: Events,
    /// Readings of the hardware. Its tick is the one before plus 1, or it is
    /// sent along.
    pub inputs: Inputs,
    /// True if the motor's register could not be read: the last good one stands
    /// for it, as [`firmware::hardware::serve`] has it.
    pub motor_unread: bool,
    /// Answer of the source, where that is [`SourceKind::Step`].
    pub next: Next,
}

/// Requests before a sample, as a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Events(u8);

impl Events {
    /// In the order in which they are asked for.
    pub const ORDER: [Event; 4] = [Event::Disable, Event::Reset, Event::Enable, Event::Start];
    /// The bit of each.
    const BITS: [u8; 4] = [1, 2, 4, 8];

    /// The set of the lower four bits.
    pub(super) const fn of_bits(bits: u8) -> Self {
        Self(bits & 0xf)
    }

    /// The lower four bits.
    pub(super) const fn bits(self) -> u8 {
        self.0
    }

    /// With `event`; those that no one may ask for are left out.
    pub fn insert(&mut self, event: Event) {
        for (bit, known) in Self::BITS.into_iter().zip(Self::ORDER) {
            self.0 |= flag(bit, known == event);
        }
    }

    /// Its events in their order.
    pub fn iter(self) -> impl Iterator<Item = Event> {
        let events = Self::BITS.into_iter().zip(Self::ORDER);
        events.filter_map(move |(bit, event)| (self.0 & bit != 0).then_some(event))
    }

    /// Tells whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// Kinds of requests on the line; those of replies have the upper bit.
mod kind {
    pub(super) const HELLO: u8 = 0x01;
    pub(super) const SETTINGS: u8 = 0x03;
    pub(super) const MEMORY: u8 = 0x04;
    pub(super) const BEGIN: u8 = 0x06;
    pub(super) const STEP: u8 = 0x07;
    pub(super) const STATUS: u8 = 0x09;
}

/// Flags of a step: what it has besides the motor's register.
const EMERGENCY_STOP: u8 = 0x10;
const LOAD: u8 = 0x20;
/// Tick, failed transfers, and whether the motor's register is missing.
const ODD: u8 = 0x40;
const NEXT: u8 = 0x80;

/// `flag` where it is set, or 0.
pub(super) const fn flag(flag: u8, set: bool) -> u8 {
    if set { flag } else { 0 }
}

impl Request<'_> {
    /// The request as a body; `None` for a payload that does not fit.
    ///
    /// `last_tick` is that of the step before, which a step only mentions where
    /// its own does not follow.
    pub fn body(
        mut self,
        session: u16,
        number: u32,
        last_tick: u64,
    ) -> Option<Vec<u8, LARGEST_BODY>> {
        let mut header = Header {
            kind: self.kind(),
            session,
            number,
        };
        Writer::body(|to| {
            header.fields(to)?;
            self.fields(to, last_tick)?;
            to.bytes(self.payload());
            Some(())
        })
    }

    /// Kind on the line; it begins a part's share of the
    /// configuration's CRC.
    pub const fn kind(&self) -> u8 {
        match self {
            Self::Hello => kind::HELLO,
            Self::Settings(_) => kind::SETTINGS,
            Self::Memory(_) => kind::MEMORY,
            Self::Begin { .. } => kind::BEGIN,
            Self::Step(_) => kind::STEP,
            Self::Status => kind::STATUS,
        }
    }

    const fn payload(&self) -> &[u8] {
        match self {
            Self::Settings(payload) | Self::Memory(payload) => payload,
            Self::Hello | Self::Begin { .. } | Self::Step(_) | Self::Status => &[],
        }
    }

    /// Contents but for a payload.
    fn fields(&mut self, wire: &mut impl Wire, last_tick: u64) -> Option<()> {
        match self {
            Self::Begin {
                configuration,
                source,
                events,
            } => {
                wire.u32(configuration)?;
                wire.u8(&mut events.0)?;
                *events = Events::of_bits(events.0);
                wire.choice(source, &SourceKind::ALL)
            }
            Self::Step(step) => step.fields(wire, last_tick),
            _ => Some(()),
        }
    }
}

impl<'a> Request<'a> {
    /// The request behind a header of that kind; `None` if there is no such one.
    pub(super) fn read(kind: u8, mut from: Reader<'a>, last_tick: u64) -> Option<Self> {
        let payload = from.rest();
        let mut request = match kind {
            kind::HELLO => return Some(Self::Hello),
            kind::SETTINGS => return Some(Self::Settings(payload)),
            kind::MEMORY => return Some(Self::Memory(payload)),
            kind::STATUS => return Some(Self::Status),
            kind::BEGIN => Self::Begin {
                configuration: 0,
                source: SourceKind::Table,
                events: Events::default(),
            },
            // As it is without the odd fields: the tick follows the last one.
            kind::STEP => Self::Step(Step {
                events: Events::default(),
                inputs: Inputs {
                    tick: last_tick.wrapping_add(1),
                    ..Inputs::default()
                },
                motor_unread: false,
                next: Next::Underrun,
            }),
            _ => return None,
        };
        request.fields(&mut from, last_tick)?;
        from.end()?;
        Some(request)
    }
}

impl Step {
    fn fields(&mut self, wire: &mut impl Wire, last_tick: u64) -> Option<()> {
        let inputs = &mut self.inputs;
        let follows = inputs.tick == last_tick.wrapping_add(1)
            && inputs.failed_transfers == 0
            && !self.motor_unread;
        let mut flags = self.events.0
            | flag(EMERGENCY_STOP, inputs.emergency_stop)
            | flag(LOAD, inputs.load_register.is_some())
            | flag(ODD, !follows)
            | flag(NEXT, self.next != Next::Underrun);
        wire.u8(&mut flags)?;
        self.events = Events::of_bits(flags);
        inputs.emergency_stop = flags & EMERGENCY_STOP != 0;
        wire.u32(&mut inputs.motor_register)?;
        if flags & LOAD != 0 {
            wire.u32(inputs.load_register.get_or_insert_default())?;
        }
        if flags & ODD != 0 {
            wire.u64(&mut inputs.tick)?;
            wire.u32(&mut inputs.failed_transfers)?;
            wire.flag(&mut self.motor_unread)?;
        }
        if flags & NEXT != 0 {
            let zero = Setpoint::default();
            let kinds = [
                Next::Setpoint(zero),
                Next::Last(zero),
                Next::Stretch(Stretch::default()),
            ];
            wire.choice(&mut self.next, &kinds)?;
            match &mut self.next {
                Next::Setpoint(setpoint) | Next::Last(setpoint) => {
                    setpoint_fields(setpoint, wire)?;
                }
                Next::Stretch(stretch) => {
                    let mut words = stretch.to_words();
                    words.iter_mut().try_for_each(|word| wire.i32(word))?;
                    *stretch = Stretch::from_words(&words);
                }
                Next::Underrun => {}
            }
        }
        Some(())
    }
}

fn setpoint_fields(setpoint: &mut Setpoint, wire: &mut impl Wire) -> Option<()> {
    wire.i32(&mut setpoint.position)?;
    wire.i32(&mut setpoint.velocity)?;
    wire.i32(&mut setpoint.acceleration)?;
    let mut computed = setpoint.ahead.is_some();
    wire.flag(&mut computed)?;
    if computed {
        let mut bits = setpoint.ahead.unwrap_or_default().to_bits();
        wire.i64(&mut bits)?;
        setpoint.ahead = Some(Codes::from_bits(bits));
    }
    Some(())
}
