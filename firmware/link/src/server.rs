//! The controller's end of the line: bytes in, frames out.
//!
//! A [`Server`] knows neither a line nor a board, so that every target, and the
//! host's tests, run the same one. A request that changes something is carried out
//! once: its number must be the next one, and what the last one was answered is
//! kept for a repetition.
//!
//! ```text
//! byte ─► Receiver ─► request ─► session, axis ─► what to say ─┐
//!            ▲                                                 │
//!            └──── its memory ◄────────────────────────────────┘ frame ─► line
//! ```
//!
//! Everything happens in the server's own memory, which is all zeros at the start.

use crate::body::{Header, Reader};
use crate::frame::{Received, Receiver, crc32_on};
use crate::plan;
use crate::planning;
use crate::reply::{self, Identity, Nak, Sample};
use crate::request::{Arrived, Events, SourceKind, begin, kind, next};
use firmware::axis::{AxisState, Inputs};
use firmware::reference::{
    InPlace, Next, Observed, SetpointSource, SetpointTable, Stretch, TablePlace, next_rated,
};
use firmware::settings::{Settings, Unfit, Words};

/// Target as a server needs it.
pub trait Target {
    /// Identity that it tells.
    fn identity(&self) -> Identity;

    /// Starts to measure a sample.
    fn start(&mut self);

    /// Time since [`Target::start`] \[ticks\], less an empty measurement.
    fn elapsed(&mut self) -> u32;

    /// Deepest stack so far \[bytes\]; 0 where it is not known.
    fn stack_bytes(&self) -> u32;
}

/// Serves one host after another.
#[derive(Debug)]
#[repr(C)]
pub struct Server {
    session: Session,
    /// Its memory is also that of the answers.
    receiver: Receiver,
}

impl Server {
    /// Waits for a HELLO.
    pub const START: Self = Self {
        session: Session {
            now: Progress::START,
            header: Header::ZERO,
            sample: Sample::NONE,
            axis: AxisState::START,
        },
        receiver: Receiver::new(),
    };

    /// Takes a byte of the line; the frame to send where it ends a request, or
    /// nothing. `memory` is for the setpoints of every session.
    pub fn take<const N: usize>(
        &mut self,
        byte: u8,
        memory: &mut SetpointTable<N>,
        target: &mut impl Target,
    ) -> &[u8] {
        let session = &mut self.session;
        let done = match self.receiver.take(byte) {
            None => return &[],
            Some(Received::Damaged) => {
                session.header.session = session.now.host.unwrap_or(0);
                session.header.number = session.now.next;
                Err(Nak::Damaged)
            }
            Some(Received::Body(body)) => {
                let Some(payload) = session.header.fill(body) else {
                    return &[];
                };
                session.answer(payload, memory, target)
            }
        };
        self.say(done, target)
    }

    /// The answer to the request at hand, as a frame.
    #[inline(never)]
    fn say(&mut self, done: Result<(), Nak>, target: &impl Target) -> &[u8] {
        let session = &mut self.session;
        let to = &mut self.receiver.frame;
        if done.is_err() {
            session.header.kind = reply::kind::NAK;
        }
        to.begin(&session.header);
        match (done, session.header.kind) {
            (Err(nak), _) => nak.write(to),
            (Ok(()), reply::kind::HELLO) => target.identity().write(to),
            (Ok(()), reply::kind::STATUS) => to.words(&[target.stack_bytes(), session.now.steps]),
            (Ok(()), reply::kind::STEPPED) => session.sample.write(to, session.axis.fault()),
            _ => {}
        }
        to.end().unwrap_or_default()
    }
}

/// A session with a host.
#[derive(Debug)]
#[repr(C)]
struct Session {
    now: Progress,
    /// That of the request at hand, then of its answer.
    header: Header,
    /// The last sample.
    sample: Sample,
    axis: AxisState,
}

/// How far a session is.
#[derive(Debug)]
struct Progress {
    /// Its number; none before the first HELLO.
    host: Option<u16>,
    /// The axis has its settings.
    settled: bool,
    begun: bool,
    source: SourceKind,
    /// Kind of the answer to the last request that was carried out; 0 before the first.
    kept: u8,
    /// Number of the next request.
    next: u32,
    /// CRC-32 over the parts so far.
    configuration: u32,
    steps: u32,
    /// The tick that follows the last one.
    tick: u64,
    /// The next word of a plan, or of a table with rates.
    at: usize,
    place: TablePlace,
}

impl Progress {
    const START: Self = Self {
        host: None,
        settled: false,
        begun: false,
        source: SourceKind::Table,
        kept: 0,
        next: 0,
        configuration: 0,
        steps: 0,
        tick: 0,
        at: 0,
        place: TablePlace::START,
    };
}

impl Session {
    /// Carries out a request, if it is one and the next.
    #[inline(never)]
    fn answer<const N: usize>(
        &mut self,
        payload: &[u8],
        memory: &mut SetpointTable<N>,
        target: &mut impl Target,
    ) -> Result<(), Nak> {
        let (header, now) = (&mut self.header, &mut self.now);
        let kind = header.kind;
        let known = now.host == Some(header.session);
        if kind == kind::HELLO {
            if !known {
                *now = Progress::START;
                now.host = Some(header.session);
                now.next = 1;
                memory.rest_at(0);
            }
            header.kind = reply::kind::HELLO;
            return Ok(());
        }
        if !known {
            return Err(Nak::Session);
        }
        // Of a request of another kind it says nothing and is not looked at.
        let mut step = Arrived::read(payload, now.tick, &self.axis);
        if kind == kind::STATUS {
            header.kind = reply::kind::STATUS;
            return Ok(());
        }
        let is_whole = if kind == kind::STEP {
            step.is_whole
        } else if kind == kind::BEGIN {
            begin(payload).is_some()
        } else {
            kind == kind::SETTINGS || kind == kind::MEMORY || planning::takes(kind)
        };
        if !is_whole {
            return Err(Nak::Request);
        }
        let expected = now.next;
        if header.number.wrapping_add(1) == expected && now.kept != 0 {
            header.kind = now.kept;
            return Ok(());
        }
        if header.number != expected {
            return Err(Nak::Number { expected });
        }
        if kind == kind::SETTINGS {
            self.settle(payload)?;
        } else if now.begun != (kind == kind::STEP) {
            return Err(Nak::Request);
        } else if kind == kind::STEP {
            self.step(&mut step, memory, target)?;
        } else if kind == kind::MEMORY {
            remember(payload, memory)?;
        } else if planning::takes(kind) {
            planning::remember(payload, memory)?;
        } else {
            self.begin(payload, memory.as_counts())?;
        }
        let now = &mut self.now;
        now.next = expected.wrapping_add(1);
        now.kept = reply::kind::STEPPED;
        if kind != kind::STEP {
            now.kept = reply::kind::TAKEN;
            now.configuration = crc32_on(now.configuration, &[kind]);
            now.configuration = crc32_on(now.configuration, payload);
        }
        self.header.kind = now.kept;
        Ok(())
    }

    #[inline(never)]
    fn settle(&mut self, payload: &[u8]) -> Result<(), Nak> {
        let (bytes, ragged) = payload.as_chunks();
        if bytes.len() != Settings::WORDS || !ragged.is_empty() {
            return Err(Nak::Request);
        }
        let mut words = Words::ZERO;
        for (word, bytes) in words.0.iter_mut().zip(bytes) {
            *word = u32::from_le_bytes(*bytes);
        }
        let accepted = if self.now.begun {
            self.axis.change_in_place(&words)
        } else {
            self.axis.start_in_place(&words)
        };
        self.now.settled |= accepted.is_ok();
        accepted.map_err(|Unfit { word }| Nak::Settings { word: word.into() })
    }

    fn begin(&mut self, payload: &[u8], words: &[i32]) -> Result<(), Nak> {
        let (configuration, events, source) = begin(payload).ok_or(Nak::Request)?;
        let (now, axis) = (&mut self.now, &mut self.axis);
        if configuration != now.configuration {
            let here = now.configuration;
            return Err(Nak::Configuration { here });
        }
        if !now.settled {
            return Err(Nak::Request);
        }
        if source == SourceKind::Plan {
            let stretch = |stretch| Nak::Plan { stretch };
            plan::check(words, axis).map_err(stretch)?;
        }
        // All of them or none.
        if !events.suit_a_new_axis() {
            return Err(Nak::Request);
        }
        ask_for(axis, events);
        now.source = source;
        now.begun = true;
        Ok(())
    }

    /// One step of the axis in service.
    fn step<const N: usize>(
        &mut self,
        step: &mut Arrived<'_>,
        memory: &SetpointTable<N>,
        target: &mut impl Target,
    ) -> Result<(), Nak> {
        let (now, sample, axis) = (&mut self.now, &mut self.sample, &mut self.axis);
        if !step.is_fit {
            return Err(Nak::Request);
        }
        sample.refused = ask_for(axis, step.events);
        if step.motor_unread {
            (step.inputs.motor_register, _) = axis.last_registers();
        }
        now.steps = now.steps.wrapping_add(1);
        now.tick = step.inputs.tick.wrapping_add(1);
        let given = &mut step.next;
        let mut source = Source { now, memory, given };
        timed(axis, &step.inputs, &mut source, target, sample);
        Ok(())
    }
}

/// Appends words to the memory.
#[inline(never)]
fn remember<const N: usize>(payload: &[u8], memory: &mut SetpointTable<N>) -> Result<(), Nak> {
    let (words, ragged) = payload.as_chunks();
    if !ragged.is_empty() {
        return Err(Nak::Request);
    }
    if words.len() > memory.room() {
        return Err(Nak::Memory);
    }
    for word in words {
        // There is room.
        let _ = memory.push(i32::from_le_bytes(*word));
    }
    Ok(())
}

/// One sample of the axis, with its time.
#[inline(never)]
fn timed<const N: usize>(
    axis: &mut AxisState,
    inputs: &Inputs,
    source: &mut Source<'_, '_, N>,
    target: &mut impl Target,
    sample: &mut Sample,
) {
    target.start();
    let output = axis.tick(inputs, source);
    // Where the results are kept is none of the sample's time.
    sample.ticks = target.elapsed();
    sample.output = output;
}

/// Asks for the events in their order; those that were refused.
#[inline(never)]
fn ask_for(axis: &mut AxisState, events: Events) -> Events {
    events.filter(|event| axis.request(event).is_err())
}

/// Source of the axis' setpoints in a sample.
struct Source<'a, 'b, const N: usize> {
    now: &'a mut Progress,
    memory: &'a SetpointTable<N>,
    /// Setpoint that came with the step.
    given: &'a mut Reader<'b>,
}

impl<const N: usize> SetpointSource for Source<'_, '_, N> {
    fn next(&mut self, observed: &Observed) -> Next {
        let mut stretch = Stretch::default();
        self.next_in_place(observed, &mut stretch).with(stretch)
    }

    #[inline]
    fn next_in_place(&mut self, _: &Observed, stretch: &mut Stretch) -> InPlace {
        let (now, words) = (&mut *self.now, self.memory.as_counts());
        let next = match now.source {
            SourceKind::Table => now.place.next(self.memory),
            SourceKind::Rates => next_rated(words, &mut now.at),
            SourceKind::Plan => return plan::next(words, &mut now.at, stretch),
            SourceKind::Step => return next(self.given, stretch),
        };
        match next {
            Next::Last(setpoint) => InPlace::Last(setpoint),
            Next::Setpoint(setpoint) => InPlace::Setpoint(setpoint),
            Next::Stretch(_) | Next::Underrun => InPlace::Underrun,
        }
    }
}
