//! The controller's end of the line: requests in, replies out.
//!
//! A [`Server`] knows neither a line nor a board. It takes the body of a frame
//! and gives the reply, so that every target, and the host's tests, run the
//! same one. A request that changes something is carried out once: its number
//! must be the next one, and the reply to the last is kept for a repetition.

use heapless::Vec;

use crate::body::{Header, Reader};
use crate::frame::{Received, crc32_on};
use crate::reply::{Identity, LARGEST_REPLY, Nak, Reply, Status, Stepped};
use crate::request::{Events, Request, SourceKind, Step};
use crate::{plan, settings};
use firmware::axis::{AxisOutput, AxisState, Inputs};
use firmware::reference::{Next, Observed, SetpointSource, SetpointTable, TablePlace};
use firmware::settings::Unfit;
use firmware::states::State;

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

/// Source of the axis' setpoints.
#[derive(Debug)]
struct Source<'t, const N: usize> {
    kind: SourceKind,
    memory: &'t mut SetpointTable<N>,
    /// The next word of a plan, or entry of a table.
    at: usize,
    place: TablePlace,
    /// Setpoint that came with the step.
    given: Next,
}

impl<const N: usize> SetpointSource for Source<'_, N> {
    #[inline]
    fn next(&mut self, _: &Observed) -> Next {
        match self.kind {
            SourceKind::Table => self.place.next(self.memory),
            SourceKind::Plan => match plan::next(self.memory.as_counts(), self.at) {
                Some((next, after)) => {
                    self.at = after;
                    next
                }
                None => Next::Underrun,
            },
            SourceKind::Step => self.given,
        }
    }
}

/// Serves one host after another.
#[derive(Debug)]
pub struct Server<'t, const N: usize> {
    /// None before the first HELLO.
    session: Option<u16>,
    /// Number of the next request.
    next: u32,
    /// The reply to the one before.
    last: Vec<u8, LARGEST_REPLY>,
    /// CRC-32 over the parts so far.
    configuration: u32,
    begun: bool,
    steps: u32,
    last_tick: u64,
    /// None before its settings.
    axis: Option<AxisState>,
    source: Source<'t, N>,
}

impl<'t, const N: usize> Server<'t, N> {
    /// Waits for a HELLO; the memory is for the setpoints of every session.
    pub const fn new(memory: &'t mut SetpointTable<N>) -> Self {
        Self {
            session: None,
            next: 0,
            last: Vec::new(),
            configuration: 0,
            begun: false,
            steps: 0,
            last_tick: u64::MAX,
            axis: None,
            source: Source {
                kind: SourceKind::Table,
                memory,
                at: 0,
                place: TablePlace::START,
                given: Next::Underrun,
            },
        }
    }

    /// Answers what was received; `None` where there is nothing to say.
    pub fn answer(
        &mut self,
        received: Received<'_>,
        target: &mut impl Target,
    ) -> Option<Vec<u8, LARGEST_REPLY>> {
        let Received::Body(body) = received else {
            let session = self.session.unwrap_or(0);
            return Reply::Nak(Nak::Damaged).body(session, self.next);
        };
        let (header, rest) = Header::read(body)?;
        let mut acted = false;
        let reply = match Request::read(header.kind, rest, self.last_tick) {
            Some(Request::Hello) => {
                self.hello(header);
                Reply::Hello(target.identity())
            }
            _ if self.session != Some(header.session) => Reply::Nak(Nak::Session),
            None => Reply::Nak(Nak::Request),
            Some(Request::Status) => Reply::Status(Status {
                stack_bytes: target.stack_bytes(),
                steps: self.steps,
            }),
            Some(_) if header.number.wrapping_add(1) == self.next && !self.last.is_empty() => {
                return Some(self.last.clone());
            }
            Some(_) if header.number != self.next => Reply::Nak(Nak::Number {
                expected: self.next,
            }),
            Some(request) => {
                let reply = self.carry_out(&request, rest, target);
                acted = !matches!(reply, Reply::Nak(_));
                reply
            }
        };
        let body = reply.body(header.session, header.number)?;
        if acted {
            self.next = self.next.wrapping_add(1);
            self.last.clone_from(&body);
        }
        Some(body)
    }

    /// Forgets the session before, unless this is a repetition.
    #[inline(never)]
    fn hello(&mut self, header: Header) {
        if self.session == Some(header.session) {
            return;
        }
        self.session = Some(header.session);
        self.next = 1;
        self.last.clear();
        self.configuration = 0;
        self.begun = false;
        self.steps = 0;
        self.last_tick = u64::MAX;
        self.axis = None;
        self.source.memory.rest_at(0);
        self.source.at = 0;
        self.source.place = TablePlace::START;
    }

    fn carry_out(
        &mut self,
        request: &Request<'_>,
        payload: Reader<'_>,
        target: &mut impl Target,
    ) -> Reply {
        let done = match request {
            Request::Step(step) if self.begun => return self.step(step, target),
            Request::Settings(payload) => self.settings(payload),
            Request::Step(_) | Request::Hello | Request::Status => Err(Nak::Request),
            _ if self.begun => Err(Nak::Request),
            Request::Memory(payload) => self.remember(payload),
            Request::Begin {
                configuration,
                source,
                events,
            } => self.begin(*configuration, *source, *events),
        };
        match done {
            Ok(()) if !self.begun => {
                let crc = crc32_on(self.configuration, &[request.kind()]);
                self.configuration = crc32_on(crc, payload.rest());
                Reply::Taken
            }
            Ok(()) => Reply::Taken,
            Err(nak) => Reply::Nak(nak),
        }
    }

    #[inline(never)]
    fn settings(&mut self, payload: &[u8]) -> Result<(), Nak> {
        let settings = settings::read(payload).ok_or(Nak::Request)?;
        let accepted = match &mut self.axis {
            Some(axis) if self.begun => axis.change_to(&settings),
            axis => AxisState::start_with(&settings).map(|state| *axis = Some(state)),
        };
        accepted.map_err(|Unfit { word }| Nak::Settings { word: word.into() })
    }

    #[inline(never)]
    fn remember(&mut self, payload: &[u8]) -> Result<(), Nak> {
        let (words, ragged) = payload.as_chunks();
        if !ragged.is_empty() {
            return Err(Nak::Request);
        }
        if words.len() > self.source.memory.room() {
            return Err(Nak::Memory);
        }
        for word in words {
            let word = i32::from_le_bytes(*word);
            self.source.memory.push(word).map_err(|_| Nak::Memory)?;
        }
        Ok(())
    }

    fn begin(&mut self, configuration: u32, kind: SourceKind, events: Events) -> Result<(), Nak> {
        if configuration != self.configuration {
            return Err(Nak::Configuration {
                here: self.configuration,
            });
        }
        let axis = self.axis.as_mut().ok_or(Nak::Request)?;
        if kind == SourceKind::Plan {
            let stretch = |stretch| Nak::Plan { stretch };
            plan::check(self.source.memory.as_counts(), axis).map_err(stretch)?;
        }
        // All of them or none.
        let after = |state: State, event| state.after(event);
        if events.iter().try_fold(axis.state(), after).is_err() {
            return Err(Nak::Request);
        }
        ask_for(axis, events);
        self.source.kind = kind;
        self.begun = true;
        Ok(())
    }

    fn step(&mut self, step: &Step, target: &mut impl Target) -> Reply {
        let Some(axis) = &mut self.axis else {
            return Reply::Nak(Nak::Request);
        };
        if let Next::Stretch(stretch) = step.next
            && plan::end_of(stretch, axis).is_none()
        {
            return Reply::Nak(Nak::Request);
        }
        self.source.given = step.next;
        let stepped = axis_step(axis, &mut self.source, step, target);
        self.steps = self.steps.wrapping_add(1);
        self.last_tick = step.inputs.tick;
        Reply::Stepped(stepped)
    }
}

/// One sample of the axis, with its time.
#[inline(never)]
fn timed<const N: usize>(
    state: &mut AxisState,
    source: &mut Source<'_, N>,
    inputs: &Inputs,
    target: &mut impl Target,
) -> (AxisOutput, u32) {
    target.start();
    let output = state.tick(inputs, source);
    (output, target.elapsed())
}

/// One step of the axis in service.
#[inline(never)]
fn axis_step<const N: usize>(
    state: &mut AxisState,
    source: &mut Source<'_, N>,
    step: &Step,
    target: &mut impl Target,
) -> Stepped {
    let refused = ask_for(state, step.events);
    let mut inputs = step.inputs;
    if step.motor_unread {
        (inputs.motor_register, _) = state.last_registers();
    }
    let (output, ticks) = timed(state, source, &inputs, target);
    Stepped {
        code: output.code,
        error_counts: output.error_counts,
        state: output.state,
        power: output.power,
        out_of_range: output.out_of_range,
        refused,
        ticks,
        fault: state.fault().copied(),
    }
}

/// Asks for the events in their order; those that were refused.
fn ask_for(state: &mut AxisState, events: Events) -> Events {
    let mut refused = Events::default();
    for event in events.iter() {
        if state.request(event).is_err() {
            refused.insert(event);
        }
    }
    refused
}
