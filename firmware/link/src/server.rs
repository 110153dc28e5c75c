//! The controller's end of the line: requests in, replies out.
//!
//! A [`Server`] knows neither a line nor a board. It takes the body of a frame
//! and gives the reply, so that every target, and the host's tests, run the
//! same one. A request that changes something is carried out once: its number
//! must be the next one, and the reply to the last is kept for a repetition.

use heapless::Vec;

use crate::body::{Header, Reader, Wire};
use crate::frame::{Received, crc32_on};
use crate::reply::{Identity, LARGEST_REPLY, Nak, Reply, Status, Stepped};
use crate::request::{Events, Request, SourceKind, Step};
use crate::{plan, settings};
use firmware::axis::{Axis, AxisOutput, AxisState, Inputs};
use firmware::controller::{Controller, ControllerState};
use firmware::counts;
use firmware::motion::{MotionPlan, MotionState, PlanHead};
use firmware::reference::{Next, Observed, Setpoint, SetpointSource, SetpointTable};
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

/// The controller of a session.
#[derive(Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, in the chip's static memory, as large as its largest"
)]
enum Machine {
    /// None yet.
    None,
    /// The paper's. It stands on a wheel of counts that turns with the
    /// setpoint: its own table holds 0 and it is fed `c − r`.
    Paper(Controller<1>, ControllerState),
    /// The axis in service.
    Axis(Axis, AxisState),
}

/// Source of the axis' setpoints.
#[derive(Debug)]
struct Source<'t, const N: usize> {
    kind: SourceKind,
    table: &'t mut SetpointTable<N>,
    /// The next entry of the table; 32 bits, because a chip has no more in one
    /// word, and the last entry is held at their end too.
    k: u32,
    plan: MotionPlan,
    motion: MotionState,
    /// Setpoint that came with the step.
    given: Next,
}

impl<const N: usize> Source<'_, N> {
    /// The next entry; as [`firmware::reference::TableSource`].
    fn entry(&mut self) -> Next {
        let position = self.table.at(u64::from(self.k));
        let before = self.table.at(u64::from(self.k.saturating_sub(1)));
        self.k = self.k.saturating_add(1);
        let entries = self.table.as_counts().len();
        if usize::try_from(self.k).is_ok_and(|k| k < entries) {
            Next::Setpoint(Setpoint {
                position,
                velocity: counts::difference(position, before),
                acceleration: 0,
            })
        } else {
            Next::Last(Setpoint {
                position,
                ..Setpoint::default()
            })
        }
    }
}

impl<const N: usize> SetpointSource for Source<'_, N> {
    fn next(&mut self, _: &Observed) -> Next {
        match self.kind {
            SourceKind::Table => self.entry(),
            SourceKind::Plan => self.plan.next(&mut self.motion),
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
    machine: Machine,
    source: Source<'t, N>,
}

impl<'t, const N: usize> Server<'t, N> {
    /// Waits for a HELLO; the table is for the setpoints of every session.
    pub fn new(table: &'t mut SetpointTable<N>) -> Self {
        Self {
            session: None,
            next: 0,
            last: Vec::new(),
            configuration: 0,
            begun: false,
            steps: 0,
            last_tick: u64::MAX,
            machine: Machine::None,
            source: Source {
                kind: SourceKind::Table,
                table,
                k: 0,
                plan: MotionPlan::default(),
                motion: MotionState::default(),
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
        self.machine = Machine::None;
        self.source.table.rest_at(0);
        self.source.k = 0;
        self.source.plan.begin(PlanHead::default());
        self.source.motion = MotionState::default();
    }

    fn carry_out(
        &mut self,
        request: &Request<'_>,
        payload: Reader<'_>,
        target: &mut impl Target,
    ) -> Reply {
        let done = match request {
            Request::Step(step) if self.begun => return self.step(step, target),
            Request::Law(payload) if self.begun => self.change_law(payload),
            Request::Axis(payload) => self.axis(payload),
            Request::Step(_) | Request::Law(_) | Request::Hello | Request::Status => {
                Err(Nak::Request)
            }
            _ if self.begun => Err(Nak::Request),
            Request::Paper(payload) => self.paper(payload),
            Request::Setpoints(payload) => self.setpoints(payload),
            Request::Plan(payload) => {
                plan::take_part(&mut self.source.plan, payload).ok_or(Nak::Settings)
            }
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
    fn paper(&mut self, payload: &[u8]) -> Result<(), Nak> {
        let law = settings::read_law(payload).ok_or(Nak::Settings)?;
        let controller = Controller::new(law, SetpointTable::resting_at(0));
        let state = ControllerState::start(&controller);
        self.machine = Machine::Paper(controller, state);
        Ok(())
    }

    #[inline(never)]
    fn axis(&mut self, payload: &[u8]) -> Result<(), Nak> {
        let axis = settings::read_axis(payload).ok_or(Nak::Settings)?;
        match &mut self.machine {
            Machine::Axis(running, state) if self.begun => {
                *running = axis;
                state.gains_changed();
            }
            _ if self.begun => return Err(Nak::Request),
            machine => *machine = Machine::Axis(axis, AxisState::start(&axis)),
        }
        Ok(())
    }

    #[inline(never)]
    fn setpoints(&mut self, payload: &[u8]) -> Result<(), Nak> {
        let mut from = Reader::new(payload);
        while from.end().is_none() {
            let mut setpoint = 0;
            from.i32(&mut setpoint).ok_or(Nak::Request)?;
            self.source.table.push(setpoint).map_err(|_| Nak::Table)?;
        }
        Ok(())
    }

    fn begin(&mut self, configuration: u32, kind: SourceKind, events: Events) -> Result<(), Nak> {
        if configuration != self.configuration {
            return Err(Nak::Configuration {
                here: self.configuration,
            });
        }
        match &mut self.machine {
            Machine::None => return Err(Nak::Request),
            Machine::Paper(..) => {}
            Machine::Axis(axis, state) => {
                if !ask_for(axis, state, events).is_empty() {
                    return Err(Nak::Request);
                }
            }
        }
        self.source.kind = kind;
        self.begun = true;
        Ok(())
    }

    #[inline(never)]
    fn change_law(&mut self, payload: &[u8]) -> Result<(), Nak> {
        let Machine::Axis(axis, state) = &mut self.machine else {
            return Err(Nak::Request);
        };
        axis.set_law(settings::read_law(payload).ok_or(Nak::Settings)?);
        state.gains_changed();
        Ok(())
    }

    fn step(&mut self, step: &Step, target: &mut impl Target) -> Reply {
        let source = &mut self.source;
        source.given = step.next;
        let stepped = match &mut self.machine {
            Machine::None => return Reply::Nak(Nak::Request),
            Machine::Paper(controller, state) => {
                paper_step(controller, state, source, &step.inputs, target)
            }
            Machine::Axis(axis, state) => axis_step(axis, state, source, step, target),
        };
        self.steps = self.steps.wrapping_add(1);
        self.last_tick = step.inputs.tick;
        Reply::Stepped(stepped)
    }
}

/// One sample of the paper's controller. A function of its own has all registers
/// for the sample: 34 instructions fewer of 174 on an m4.
#[inline(never)]
fn paper_step<const N: usize>(
    controller: &Controller<1>,
    state: &mut ControllerState,
    source: &mut Source<'_, N>,
    inputs: &Inputs,
    target: &mut impl Target,
) -> Stepped {
    target.start();
    let setpoint = source.table.at(u64::from(source.k));
    source.k = source.k.saturating_add(1);
    let count = inputs.motor_register.cast_signed();
    let output = controller.tick(state, counts::difference(count, setpoint));
    let ticks = target.elapsed();
    Stepped {
        code: output.code,
        error_counts: output.error_counts,
        state: State::Moving,
        power: true,
        out_of_range: output.out_of_range,
        refused: Events::default(),
        ticks,
        fault: None,
    }
}

/// One sample of the axis, with its time; likewise 5 fewer of 449.
#[inline(never)]
fn timed<const N: usize>(
    axis: &Axis,
    state: &mut AxisState,
    source: &mut Source<'_, N>,
    inputs: &Inputs,
    target: &mut impl Target,
) -> (AxisOutput, u32) {
    target.start();
    let output = axis.tick(state, inputs, source);
    (output, target.elapsed())
}

/// One step of the axis in service.
#[inline(never)]
fn axis_step<const N: usize>(
    axis: &Axis,
    state: &mut AxisState,
    source: &mut Source<'_, N>,
    step: &Step,
    target: &mut impl Target,
) -> Stepped {
    let refused = ask_for(axis, state, step.events);
    let mut inputs = step.inputs;
    if step.motor_unread {
        (inputs.motor_register, _) = state.last_registers();
    }
    let (output, ticks) = timed(axis, state, source, &inputs, target);
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
fn ask_for(axis: &Axis, state: &mut AxisState, events: Events) -> Events {
    let mut refused = Events::default();
    for event in events.iter() {
        if axis.request(state, event).is_err() {
            refused.insert(event);
        }
    }
    refused
}
