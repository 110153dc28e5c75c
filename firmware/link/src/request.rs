//! Requests of the host.

use heapless::Vec;

use crate::body::{Header, Reader, halves};
use crate::frame::{Frame, LARGEST_BODY};
use crate::plan;
use crate::planned::Planned;
use firmware::Codes;
use firmware::axis::{AxisState, Inputs};
use firmware::reference::{InPlace, Next, Setpoint, Stretch};
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
    /// \[counts\], with their rates or without, or a plan ([`crate::plan::words`]).
    Memory(&'a [u8]),
    /// The next words of the memory, which the chip plans itself; refused as unknown
    /// where it cannot.
    Plan(&'a Planned),
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
    /// The memory is a table of setpoints with their rates
    /// ([`firmware::reference::next_rated`]).
    Rates,
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

    /// Without an event.
    pub(crate) const NONE: Self = Self(0);

    /// The set of the lower four bits.
    pub(crate) const fn of_bits(bits: u8) -> Self {
        Self(bits & 0xf)
    }

    /// The lower four bits.
    pub(crate) const fn bits(self) -> u8 {
        self.0
    }

    /// With `event`; those that no one may ask for are left out.
    pub fn insert(&mut self, event: Event) {
        self.0 |= Self(0xf).filter(|known| known == event).0;
    }

    /// Its events in their order.
    pub fn iter(self) -> impl Iterator<Item = Event> {
        let has = move |event: &Event| !self.filter(|known| known == *event).is_empty();
        Self::ORDER.into_iter().filter(has)
    }

    /// Tells whether an axis that was just made takes all of them: it is disabled, so that
    /// there is nothing to reset, and it starts where it is enabled.
    pub(crate) const fn suit_a_new_axis(self) -> bool {
        let [reset, enable, start] = [0x2, 0x4, 0x8];
        self.0 & reset == 0 && self.0 & (enable | start) != start
    }

    /// Those of its events, in their order, of which `kept` says so.
    pub(crate) fn filter(self, mut kept: impl FnMut(Event) -> bool) -> Self {
        let (mut bit, mut set) = (1, 0);
        for event in Self::ORDER {
            if self.0 & bit != 0 && kept(event) {
                set |= bit;
            }
            bit = bit.wrapping_shl(1);
        }
        Self(set)
    }

    /// Tells whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// Kinds of requests on the line; those of replies have the upper bit.
pub(crate) mod kind {
    pub(crate) const HELLO: u8 = 0x01;
    pub(crate) const SETTINGS: u8 = 0x03;
    pub(crate) const MEMORY: u8 = 0x04;
    pub(crate) const PLAN: u8 = 0x05;
    pub(crate) const BEGIN: u8 = 0x06;
    pub(crate) const STEP: u8 = 0x07;
    pub(crate) const STATUS: u8 = 0x09;
}

/// Flags of a step: what it has besides the motor's register.
const EMERGENCY_STOP: u8 = 0x10;
const LOAD: u8 = 0x20;
/// Tick, failed transfers, and whether the motor's register is missing.
const ODD: u8 = 0x40;
const NEXT: u8 = 0x80;

/// Kinds of a source's answer; a setpoint of the motion is 0.
const LAST: u8 = 1;
const STRETCH: u8 = 2;

/// `flag` where it is set, or 0.
pub(crate) const fn flag(flag: u8, set: bool) -> u8 {
    if set { flag } else { 0 }
}

impl Request<'_> {
    /// The request as a body; `None` for a payload that does not fit.
    ///
    /// `last_tick` is that of the step before, which a step only mentions where
    /// its own does not follow.
    pub fn body(&self, session: u16, number: u32, last_tick: u64) -> Option<Vec<u8, LARGEST_BODY>> {
        let mut frame = Frame::EMPTY;
        frame.begin(&Header {
            kind: self.kind(),
            session,
            number,
        });
        let to = &mut frame;
        match self {
            Self::Hello | Self::Status => {}
            Self::Settings(payload) | Self::Memory(payload) => to.bytes(payload),
            Self::Plan(planned) => planned.write(to),
            Self::Begin {
                configuration,
                source,
                events,
            } => {
                to.number(*configuration, 4);
                to.put(events.0);
                to.put(match source {
                    SourceKind::Table => 0,
                    SourceKind::Plan => 1,
                    SourceKind::Step => 2,
                    SourceKind::Rates => 3,
                });
            }
            Self::Step(step) => step.write(to, last_tick.wrapping_add(1)),
        }
        Vec::from_slice(frame.body()?).ok()
    }

    /// Kind on the line; it begins a part's share of the
    /// configuration's CRC.
    pub const fn kind(&self) -> u8 {
        match self {
            Self::Hello => kind::HELLO,
            Self::Settings(_) => kind::SETTINGS,
            Self::Memory(_) => kind::MEMORY,
            Self::Plan(_) => kind::PLAN,
            Self::Begin { .. } => kind::BEGIN,
            Self::Step(_) => kind::STEP,
            Self::Status => kind::STATUS,
        }
    }
}

impl Step {
    /// Its fields; a tick that is not the one that `follows` among them.
    fn write(&self, to: &mut Frame, follows: u64) {
        let inputs = &self.inputs;
        let odd = inputs.tick != follows || inputs.failed_transfers != 0 || self.motor_unread;
        to.put(
            self.events.0
                | flag(EMERGENCY_STOP, inputs.emergency_stop)
                | flag(LOAD, inputs.load_register.is_some())
                | flag(ODD, odd)
                | flag(NEXT, self.next != Next::Underrun),
        );
        to.number(inputs.motor_register, 4);
        if let Some(register) = inputs.load_register {
            to.number(register, 4);
        }
        if odd {
            to.words(&halves(inputs.tick.cast_signed()));
            to.number(inputs.failed_transfers, 4);
            to.put(u8::from(self.motor_unread));
        }
        match &self.next {
            Next::Setpoint(setpoint) => write_setpoint(to, 0, setpoint),
            Next::Last(setpoint) => write_setpoint(to, LAST, setpoint),
            Next::Stretch(stretch) => {
                to.put(STRETCH);
                to.words(&stretch.to_words().map(i32::cast_unsigned));
            }
            Next::Underrun => {}
        }
    }
}

fn write_setpoint(to: &mut Frame, kind: u8, setpoint: &Setpoint) {
    to.put(kind);
    let rated = [setpoint.position, setpoint.velocity, setpoint.acceleration];
    to.words(&rated.map(i32::cast_unsigned));
    to.put(u8::from(setpoint.ahead.is_some()));
    if let Some(ahead) = setpoint.ahead {
        to.words(&halves(ahead.to_bits()));
    }
}

/// A [`Step`] as it came: the source's answer stays in its bytes until it is asked
/// for.
#[derive(Debug)]
pub(crate) struct Arrived<'a> {
    pub(crate) events: Events,
    pub(crate) inputs: Inputs,
    pub(crate) motor_unread: bool,
    /// Empty without an answer.
    pub(crate) next: Reader<'a>,
    /// False where its length is not what it says, or a byte has no such value.
    pub(crate) is_whole: bool,
    /// False where it brings a stretch that is none.
    pub(crate) is_fit: bool,
}

impl<'a> Arrived<'a> {
    /// Reads the fields; the tick `follows` where there is none.
    #[inline(never)]
    pub(crate) fn read(payload: &'a [u8], follows: u64, axis: &AxisState) -> Self {
        let mut from = Reader::new(payload);
        let flags = from.u8();
        let mut step = Self {
            events: Events::of_bits(flags),
            inputs: Inputs {
                tick: follows,
                motor_register: from.u32(),
                load_register: (flags & LOAD != 0).then(|| from.u32()),
                emergency_stop: flags & EMERGENCY_STOP != 0,
                failed_transfers: 0,
            },
            motor_unread: false,
            next: Reader::new(&[]),
            is_whole: false,
            is_fit: true,
        };
        if flags & ODD != 0 {
            step.inputs.tick = from.u64();
            step.inputs.failed_transfers = from.u32();
            step.motor_unread = from.flag();
        }
        let mut stretch = Stretch::default();
        let is_stretch = flags & NEXT != 0 && {
            step.next = from;
            matches!(next(&mut from, &mut stretch), InPlace::Stretch)
        };
        step.is_whole = from.has_ended();
        if step.is_whole && is_stretch {
            step.is_fit = plan::advance_to_end(&mut stretch, axis);
        }
        step
    }
}

/// Configuration, events and source of a [`Request::Begin`].
pub(crate) const fn begin(payload: &[u8]) -> Option<(u32, Events, SourceKind)> {
    let [a, b, c, d, events, source] = *payload else {
        return None;
    };
    let source = match source {
        0 => SourceKind::Table,
        1 => SourceKind::Plan,
        2 => SourceKind::Step,
        3 => SourceKind::Rates,
        _ => return None,
    };
    let configuration = u32::from_le_bytes([a, b, c, d]);
    Some((configuration, Events::of_bits(events), source))
}

/// The source's answer; an underrun, and a mistake of the reader, where there is none.
#[inline(never)]
pub(crate) fn next(from: &mut Reader<'_>, stretch: &mut Stretch) -> InPlace {
    let kind = from.u8();
    if kind == STRETCH {
        let mut words = [0; Stretch::WORDS];
        words.iter_mut().for_each(|word| *word = from.i32());
        stretch.set_words(&words);
        return InPlace::Stretch;
    }
    let setpoint = Setpoint {
        position: from.i32(),
        velocity: from.i32(),
        acceleration: from.i32(),
        ahead: from.flag().then(|| Codes::from_bits(from.i64())),
    };
    from.expect_flag(kind);
    if !from.is_good() {
        InPlace::Underrun
    } else if kind == LAST {
        InPlace::Last(setpoint)
    } else {
        InPlace::Setpoint(setpoint)
    }
}
