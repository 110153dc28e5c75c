//! Requests of the host.

use heapless::Vec;

use crate::body::Header;
use crate::body::{Reader, Writer};
use crate::frame::LARGEST_BODY;
use firmware::axis::Inputs;
use firmware::reference::{Next, Setpoint};
use firmware::states::Event;

/// Setpoints of one [`Request::Setpoints`] at most.
pub const MOST_SETPOINTS: usize = 44;

/// A request to the controller.
///
/// All but [`Request::Hello`] and [`Request::Status`] change something; they
/// are numbered from 1 in a session, each is carried out once, and the reply to
/// the last one is kept for a repetition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Request<'a> {
    /// Begins a session, unless it is the present one.
    Hello,
    /// The paper's controller: its words and converter
    /// ([`crate::settings::read_paper`]).
    Paper(&'a [u8]),
    /// The axis in service ([`crate::settings::read_axis`]); behind BEGIN other
    /// parameters of the one that runs, from the next sample on.
    Axis(&'a [u8]),
    /// The next setpoints of the table \[counts\], 4 bytes each.
    Setpoints(&'a [u8]),
    /// The next part of a planned motion ([`firmware::MotionPlan`]).
    Plan(&'a [u8]),
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
    /// Other words of the law, from the next sample on
    /// ([`crate::settings::read_law`]).
    Law(&'a [u8]),
    /// Asks for the record of the controller so far.
    Status,
}

/// Source of a controller's setpoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceKind {
    /// The table that was sent.
    Table,
    /// The planned motion that was sent.
    Plan,
    /// They come with every [`Step`].
    Step,
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
        for (place, known) in Self::ORDER.into_iter().enumerate() {
            if known == event {
                self.0 |= bit(place);
            }
        }
    }

    /// Its events in their order.
    pub fn iter(self) -> impl Iterator<Item = Event> {
        let events = Self::ORDER.into_iter().enumerate();
        events.filter_map(move |(place, event)| (self.0 & bit(place) != 0).then_some(event))
    }

    /// Tells whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

const fn bit(place: usize) -> u8 {
    match place {
        0 => 1,
        1 => 2,
        2 => 4,
        _ => 8,
    }
}

/// Kinds of requests on the line; those of replies have the upper bit.
mod kind {
    pub(super) const HELLO: u8 = 0x01;
    pub(super) const PAPER: u8 = 0x02;
    pub(super) const AXIS: u8 = 0x03;
    pub(super) const SETPOINTS: u8 = 0x04;
    pub(super) const PLAN: u8 = 0x05;
    pub(super) const BEGIN: u8 = 0x06;
    pub(super) const STEP: u8 = 0x07;
    pub(super) const LAW: u8 = 0x08;
    pub(super) const STATUS: u8 = 0x09;
}

/// Contents of a step besides the motor's register.
mod flag {
    pub(super) const EMERGENCY_STOP: u8 = 0x10;
    pub(super) const LOAD: u8 = 0x20;
    /// Tick, failed transfers, and whether the motor's register is missing.
    pub(super) const ODD: u8 = 0x40;
    pub(super) const NEXT: u8 = 0x80;
}

impl Request<'_> {
    /// The request as a body; `None` for a payload that does not fit.
    ///
    /// `last_tick` is that of the step before, which a step only mentions where
    /// its own does not follow.
    pub fn body(&self, session: u16, number: u32, last_tick: u64) -> Option<Vec<u8, LARGEST_BODY>> {
        let mut to = Writer::new();
        let kind = self.kind();
        Header {
            kind,
            session,
            number,
        }
        .write(&mut to);
        match self {
            Self::Hello | Self::Status => {}
            Self::Paper(payload)
            | Self::Axis(payload)
            | Self::Setpoints(payload)
            | Self::Plan(payload)
            | Self::Law(payload) => to.bytes(payload),
            Self::Begin {
                configuration,
                source,
                events,
            } => {
                to.u32(*configuration);
                to.u8(events.bits());
                to.u8(match source {
                    SourceKind::Table => 0,
                    SourceKind::Plan => 1,
                    SourceKind::Step => 2,
                });
            }
            Self::Step(step) => step.write(&mut to, last_tick),
        }
        to.finish()
    }

    /// Kind on the line; it begins a part's share of the
    /// configuration's CRC.
    pub const fn kind(&self) -> u8 {
        match self {
            Self::Hello => kind::HELLO,
            Self::Paper(_) => kind::PAPER,
            Self::Axis(_) => kind::AXIS,
            Self::Setpoints(_) => kind::SETPOINTS,
            Self::Plan(_) => kind::PLAN,
            Self::Begin { .. } => kind::BEGIN,
            Self::Step(_) => kind::STEP,
            Self::Law(_) => kind::LAW,
            Self::Status => kind::STATUS,
        }
    }
}

impl<'a> Request<'a> {
    /// The request behind a header of that kind; `None` if there is no such one.
    pub(super) fn read(kind: u8, mut from: Reader<'a>, last_tick: u64) -> Option<Self> {
        Some(match kind {
            kind::HELLO => Self::Hello,
            kind::PAPER => Self::Paper(from.rest()),
            kind::AXIS => Self::Axis(from.rest()),
            kind::SETPOINTS => Self::Setpoints(from.rest()),
            kind::PLAN => Self::Plan(from.rest()),
            kind::LAW => Self::Law(from.rest()),
            kind::STATUS => Self::Status,
            kind::BEGIN => {
                let configuration = from.u32()?;
                let events = Events::of_bits(from.u8()?);
                let source = match from.u8()? {
                    0 => SourceKind::Table,
                    1 => SourceKind::Plan,
                    2 => SourceKind::Step,
                    _ => return None,
                };
                from.end()?;
                Self::Begin {
                    configuration,
                    source,
                    events,
                }
            }
            kind::STEP => Self::Step(Step::read(from, last_tick)?),
            _ => return None,
        })
    }
}

impl Step {
    fn write<const N: usize>(&self, to: &mut Writer<N>, last_tick: u64) {
        let inputs = &self.inputs;
        let follows = inputs.tick == last_tick.wrapping_add(1)
            && inputs.failed_transfers == 0
            && !self.motor_unread;
        let mut flags = self.events.bits();
        for (flag, present) in [
            (flag::EMERGENCY_STOP, inputs.emergency_stop),
            (flag::LOAD, inputs.load_register.is_some()),
            (flag::ODD, !follows),
            (flag::NEXT, self.next != Next::Underrun),
        ] {
            if present {
                flags |= flag;
            }
        }
        to.u8(flags);
        to.u32(inputs.motor_register);
        if let Some(register) = inputs.load_register {
            to.u32(register);
        }
        if !follows {
            to.u64(inputs.tick);
            to.u32(inputs.failed_transfers);
            to.u8(u8::from(self.motor_unread));
        }
        let (last, setpoint) = match self.next {
            Next::Underrun => return,
            Next::Setpoint(setpoint) => (0, setpoint),
            Next::Last(setpoint) => (1, setpoint),
        };
        to.u8(last);
        to.i32(setpoint.position);
        to.i32(setpoint.velocity);
        to.i32(setpoint.acceleration);
    }

    fn read(mut from: Reader<'_>, last_tick: u64) -> Option<Self> {
        let flags = from.u8()?;
        let has = |flag| flags & flag != 0;
        let motor_register = from.u32()?;
        let load_register = if has(flag::LOAD) {
            Some(from.u32()?)
        } else {
            None
        };
        let (tick, failed_transfers, unread) = if has(flag::ODD) {
            (from.u64()?, from.u32()?, from.u8()?)
        } else {
            (last_tick.wrapping_add(1), 0, 0)
        };
        if unread > 1 {
            return None;
        }
        let next = if has(flag::NEXT) {
            let last = from.u8()?;
            let setpoint = Setpoint {
                position: from.i32()?,
                velocity: from.i32()?,
                acceleration: from.i32()?,
            };
            match last {
                0 => Next::Setpoint(setpoint),
                1 => Next::Last(setpoint),
                _ => return None,
            }
        } else {
            Next::Underrun
        };
        from.end()?;
        Some(Self {
            events: Events::of_bits(flags),
            inputs: Inputs {
                tick,
                motor_register,
                load_register,
                emergency_stop: has(flag::EMERGENCY_STOP),
                failed_transfers,
            },
            motor_unread: unread != 0,
            next,
        })
    }
}
