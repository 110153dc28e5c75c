//! The controller's end of the line: bytes in, frames out.
//!
//! A [`Server`] knows neither a line nor a board, so that every target, and the
//! host's tests, run the same one. A request that changes something is carried out
//! once: its number must be the next one, and the frame that answered the last is
//! kept for a repetition.
//!
//! ```text
//! byte ─► Receiver ─► request ─┬─ carried out ─► frame that is kept ─► line
//!            ▲                 │
//!            └──── its memory ─┴─ refused, or nothing to carry out ──► line
//! ```
//!
//! Everything happens in the server's own memory, which is all zeros at the start.

use crate::body::{Header, Reader};
use crate::frame::{Frame, Received, Receiver, crc32_on};
use crate::plan;
use crate::reply::{self, Identity, LARGEST_REPLY_FRAME, Nak, write_stepped};
use crate::request::{Arrived, Events, SourceKind, begin, kind, next};
use firmware::axis::{AxisOutput, AxisState, Inputs};
use firmware::reference::{
    InPlace, Next, Observed, SetpointSource, SetpointTable, Stretch, TablePlace,
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
    /// Its memory is also that of the answers that are not kept.
    receiver: Receiver,
}

impl Server {
    /// Waits for a HELLO.
    pub const START: Self = Self {
        session: Session {
            now: Progress::START,
            kept: Frame::EMPTY,
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
        let (host, number, answer) = match self.receiver.take(byte) {
            None => return &[],
            Some(Received::Damaged) => {
                let now = &session.now;
                let answer = Answer::Nak(Nak::Damaged);
                (now.host.unwrap_or(0), now.next, answer)
            }
            Some(Received::Body(body)) => {
                let (mut header, mut from) = (Header::default(), Reader::new(body));
                if !header.fill(&mut from) {
                    return &[];
                }
                let answer = session.answer(&header, &mut from, memory, target);
                (header.session, header.number, answer)
            }
        };
        if let Answer::Kept = answer {
            let kept: &Frame<[u8]> = &session.kept;
            return kept.line().unwrap_or_default();
        }
        let steps = session.now.steps;
        say(
            &mut self.receiver.frame,
            host,
            number,
            &answer,
            steps,
            target,
        )
    }
}

/// An answer that is not kept.
#[inline(never)]
fn say<'a>(
    to: &'a mut Frame<[u8]>,
    host: u16,
    number: u32,
    answer: &Answer,
    steps: u32,
    target: &impl Target,
) -> &'a [u8] {
    match answer {
        Answer::Nak(nak) => {
            to.begin(reply::kind::NAK, host, number);
            nak.write(to);
        }
        Answer::Record => {
            to.begin(reply::kind::STATUS, host, number);
            to.u32(target.stack_bytes());
            to.u32(steps);
        }
        _ => {
            to.begin(reply::kind::HELLO, host, number);
            target.identity().write(to);
        }
    }
    to.end();
    to.take_line().unwrap_or_default()
}

/// What is said to a request.
enum Answer {
    /// The frame that is kept.
    Kept,
    Identity,
    Record,
    Nak(Nak),
}

/// A session with a host.
#[derive(Debug)]
#[repr(C)]
struct Session {
    now: Progress,
    /// The answer to the last request that was carried out; empty before the first.
    kept: Frame<[u8; LARGEST_REPLY_FRAME]>,
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
    /// Number of the next request.
    next: u32,
    /// CRC-32 over the parts so far.
    configuration: u32,
    steps: u32,
    /// The tick that follows the last one.
    tick: u64,
    /// The next word of a plan, or entry of a table.
    at: usize,
    place: TablePlace,
}

impl Progress {
    const START: Self = Self {
        host: None,
        settled: false,
        begun: false,
        source: SourceKind::Table,
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
    fn answer<const N: usize>(
        &mut self,
        header: &Header,
        from: &mut Reader<'_>,
        memory: &mut SetpointTable<N>,
        target: &mut impl Target,
    ) -> Answer {
        let (now, payload) = (&mut self.now, from.rest());
        let known = now.host == Some(header.session);
        if header.kind == kind::HELLO {
            if !known {
                *now = Progress::START;
                now.host = Some(header.session);
                now.next = 1;
                self.kept.length = 0;
                memory.rest_at(0);
            }
            return Answer::Identity;
        }
        if !known {
            return Answer::Nak(Nak::Session);
        }
        // Of a request of another kind it says nothing and is not looked at.
        let mut step = Arrived::read(from, now.tick);
        let is_whole = match header.kind {
            kind::STATUS => return Answer::Record,
            kind::SETTINGS | kind::MEMORY => true,
            #[cfg(feature = "planner")]
            kind::PLAN => true,
            kind::BEGIN => begin(payload).is_some(),
            kind::STEP => from.has_ended(),
            _ => false,
        };
        let expected = now.next;
        if !is_whole {
            return Answer::Nak(Nak::Request);
        }
        if header.number.wrapping_add(1) == expected && self.kept.length > 0 {
            return Answer::Kept;
        }
        if header.number != expected {
            return Answer::Nak(Nak::Number { expected });
        }
        let begun = now.begun;
        let done = match header.kind {
            kind::SETTINGS => self.settle(payload),
            kind::STEP if begun => self.step(header, &mut step, memory, target),
            kind::MEMORY if !begun => remember(payload, memory),
            #[cfg(feature = "planner")]
            kind::PLAN if !begun => crate::planned::remember(payload, memory),
            kind::BEGIN if !begun => self.begin(payload, memory.as_counts()),
            _ => Err(Nak::Request),
        };
        if let Err(nak) = done {
            return Answer::Nak(nak);
        }
        let kept: &mut Frame<[u8]> = &mut self.kept;
        if header.kind != kind::STEP {
            let crc = crc32_on(self.now.configuration, &[header.kind]);
            self.now.configuration = crc32_on(crc, payload);
            kept.begin(reply::kind::TAKEN, header.session, header.number);
        }
        kept.end();
        self.now.next = expected.wrapping_add(1);
        Answer::Kept
    }

    #[inline(never)]
    fn settle(&mut self, payload: &[u8]) -> Result<(), Nak> {
        let mut from = Reader::new(payload);
        if payload.len() != 4 * Settings::WORDS {
            return Err(Nak::Request);
        }
        let mut words = Words::ZERO;
        words.0.iter_mut().for_each(|word| *word = from.u32());
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
        let mut state = Ok(axis.state());
        let _ = events.filter(|event| {
            state = state.and_then(|state| state.after(event));
            false
        });
        if state.is_err() {
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
        header: &Header,
        step: &mut Arrived<'_>,
        memory: &SetpointTable<N>,
        target: &mut impl Target,
    ) -> Result<(), Nak> {
        let (now, axis) = (&mut self.now, &mut self.axis);
        if !takes(axis, step.next) {
            return Err(Nak::Request);
        }
        let refused = ask_for(axis, step.events);
        if step.motor_unread {
            (step.inputs.motor_register, _) = axis.last_registers();
        }
        let given = step.next;
        let mut source = Source { now, memory, given };
        let (output, ticks) = timed(axis, &step.inputs, &mut source, target);
        now.steps = now.steps.wrapping_add(1);
        now.tick = step.inputs.tick.wrapping_add(1);
        let to: &mut Frame<[u8]> = &mut self.kept;
        to.begin(reply::kind::STEPPED, header.session, header.number);
        write_stepped(to, &output, refused, ticks, axis.fault());
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

/// Tells whether a stretch that comes with a step is one.
#[inline(never)]
fn takes(axis: &AxisState, mut given: Reader<'_>) -> bool {
    let mut stretch = Stretch::default();
    next(&mut given, &mut stretch) != InPlace::Stretch || plan::advance_to_end(&mut stretch, axis)
}

/// One sample of the axis, with its time.
#[inline(never)]
fn timed<const N: usize>(
    axis: &mut AxisState,
    inputs: &Inputs,
    source: &mut Source<'_, N>,
    target: &mut impl Target,
) -> (AxisOutput, u32) {
    target.start();
    let output = axis.tick(inputs, source);
    (output, target.elapsed())
}

/// Asks for the events in their order; those that were refused.
#[inline(never)]
fn ask_for(axis: &mut AxisState, events: Events) -> Events {
    events.filter(|event| axis.request(event).is_err())
}

/// Source of the axis' setpoints in a sample.
struct Source<'a, const N: usize> {
    now: &'a mut Progress,
    memory: &'a SetpointTable<N>,
    /// Setpoint that came with the step.
    given: Reader<'a>,
}

impl<const N: usize> SetpointSource for Source<'_, N> {
    fn next(&mut self, observed: &Observed) -> Next {
        let mut stretch = Stretch::default();
        self.next_in_place(observed, &mut stretch).with(stretch)
    }

    #[inline]
    fn next_in_place(&mut self, _: &Observed, stretch: &mut Stretch) -> InPlace {
        match self.now.source {
            SourceKind::Table => match self.now.place.next(self.memory) {
                Next::Last(setpoint) => InPlace::Last(setpoint),
                Next::Setpoint(setpoint) => InPlace::Setpoint(setpoint),
                Next::Stretch(_) | Next::Underrun => InPlace::Underrun,
            },
            SourceKind::Plan => plan::next(self.memory.as_counts(), &mut self.now.at, stretch),
            SourceKind::Step => next(&mut self.given, stretch),
        }
    }
}
