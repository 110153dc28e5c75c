//! A run as its axis sees it, sample by sample, wherever the axis runs: setpoints,
//! requests, injected faults, a queue that runs dry; and the axis' reports so far.

use std::sync::Arc;

use firmware::law::Law;
use firmware::reference::{TablePlace, next_rated};
use firmware::{
    Event, Fault, MotionPlan, Next, Observed, Setpoint, SetpointSource, State, Stream, Streamed,
    Stretch, counts,
};

use crate::message::{AxisStatus, Command, Measurement};
use crate::options::{AxisOptions, Feedback};

/// Hardware as the axis finds it at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shown {
    /// Position of the motor \[counts\].
    pub motor_counts: i64,
    /// Register of the motor's encoder.
    pub motor_register: u32,
    /// Register of the load's encoder, where there is one.
    pub load_register: Option<u32>,
    /// The emergency stop is asserted.
    pub emergency_stop: bool,
    /// The transfer of the motor's register fails.
    pub bus_fails: bool,
}

/// Everything that comes with one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrivals {
    /// Requests before it, in this order.
    pub events: [Option<Event>; 3],
    /// The gains change before it.
    pub gains_change: bool,
    /// The host no longer fills the queue of setpoints.
    pub queue_is_dry: bool,
    /// The hardware.
    pub shown: Shown,
}

/// Requests and injected faults, by the samples at which they come: the first at or
/// after their time.
#[derive(Debug, Clone)]
pub struct World {
    requests: [(Option<u64>, Event); 3],
    gain_change: Option<u64>,
    dry: Option<u64>,
    stop: Option<u64>,
    stop_release: Option<u64>,
    freeze: Option<u64>,
    glitch: Option<(u64, i32)>,
    bus_error: Option<u64>,
    missed: Option<u64>,
    /// The first sample with which any of these comes.
    first: u64,
    /// The bits of the motor's register, and of the load's.
    masks: [u32; 2],
    /// The count at which the encoder froze.
    frozen_counts: Option<i64>,
}

impl World {
    /// The world of an axis at samples `period_ns` apart.
    pub fn new(options: &AxisOptions, period_ns: u64) -> Self {
        let (requests, injections) = (&options.requests, &options.injections);
        let from = |at_ns: Option<u64>| at_ns.map(|at_ns| at_ns.div_ceil(period_ns));
        let missed = from(injections.missed_tick_ns);
        // Nothing comes at a sample that is missed; it waits for the next.
        let once = |at_ns| from(at_ns).map(|tick| tick + u64::from(missed == Some(tick)));
        // A counter of n bits shows n bits; the load's is as wide where it closes the loop.
        let mask = u32::MAX >> (u32::BITS - options.encoders.counter_bits);
        let glitch = injections.encoder_glitch;
        let mut world = Self {
            requests: [
                (once(requests.disable_ns), Event::Disable),
                (once(requests.reset_ns), Event::Reset),
                (once(requests.enable_ns), Event::Enable),
            ],
            gain_change: once(options.gain_change.map(|change| change.at_ns)),
            dry: from(injections.setpoint_underrun_ns),
            stop: from(requests.emergency_stop_ns),
            stop_release: from(requests.emergency_stop_release_ns),
            freeze: once(injections.encoder_freeze_ns),
            glitch: once(glitch.map(|glitch| glitch.at_ns)).zip(glitch.map(|glitch| glitch.counts)),
            bus_error: once(injections.bus_error_ns),
            missed,
            first: u64::MAX,
            masks: match options.law.feedback {
                Feedback::Dual => [mask, mask],
                Feedback::Motor => [mask, u32::MAX],
            },
            frozen_counts: None,
        };
        let [disable, reset, enable] = world.requests.map(|(at, _)| at);
        let ticks = [
            disable,
            reset,
            enable,
            world.gain_change,
            world.dry,
            world.stop,
            world.stop_release,
            world.freeze,
            world.glitch.map(|(at, _)| at),
            world.bus_error,
            world.missed,
        ];
        world.first = ticks.into_iter().flatten().min().unwrap_or(u64::MAX);
        world
    }

    /// True of a sample before any of it comes.
    pub fn is_quiet(&self, tick: u64) -> bool {
        tick < self.first
    }

    /// The hardware at a quiet sample.
    #[inline]
    pub fn shown(&self, measurement: Measurement) -> Shown {
        let [_, load_mask] = self.masks;
        let load_counts = measurement.load_counts;
        Shown {
            load_register: load_counts.map(|counts| register(counts, load_mask)),
            ..self.motor_at(measurement.position_counts.whole())
        }
    }

    /// The motor's encoder at so many counts.
    fn motor_at(&self, motor_counts: i64) -> Shown {
        let [motor_mask, _] = self.masks;
        Shown {
            motor_counts,
            motor_register: register(motor_counts, motor_mask),
            ..Shown::default()
        }
    }

    /// Everything that comes with a sample; `None` where it does not come itself: the
    /// loop does not run, and everything stays as it is.
    pub fn at(&mut self, measurement: Measurement) -> Option<Arrivals> {
        let (tick, quiet) = (measurement.tick, self.shown(measurement));
        let comes = |at: Option<u64>| at == Some(tick);
        let since = |from: Option<u64>| from.is_some_and(|from| tick >= from);
        if comes(self.missed) {
            return None;
        }
        let position = quiet.motor_counts;
        if comes(self.freeze) {
            self.frozen_counts = Some(position);
        }
        let mut motor_counts = self.frozen_counts.unwrap_or(position);
        if let Some((at, counts)) = self.glitch
            && at == tick
        {
            motor_counts = motor_counts.saturating_add(counts.into());
        }
        Some(Arrivals {
            events: self.requests.map(|(at, event)| comes(at).then_some(event)),
            gains_change: comes(self.gain_change),
            queue_is_dry: since(self.dry),
            shown: Shown {
                load_register: quiet.load_register,
                emergency_stop: since(self.stop) && !since(self.stop_release),
                bus_fails: comes(self.bus_error),
                ..self.motor_at(motor_counts)
            },
        })
    }
}

/// A counter's register: so many bits of its counts.
fn register(counts: i64, mask: u32) -> u32 {
    counts::wrap(counts).cast_unsigned() & mask
}

/// Reports of the axis so far.
#[derive(Debug, Clone)]
pub struct Reported {
    /// The state is that after the last request or sample.
    pub status: AxisStatus,
    /// `e` of the last sample that ran \[counts\].
    error_counts: i32,
    /// The code in force.
    pub code: i32,
}

impl Reported {
    /// Before the first sample, the axis in `state`.
    pub fn new(state: State) -> Self {
        Self {
            status: AxisStatus {
                state,
                ..AxisStatus::default()
            },
            error_counts: 0,
            code: 0,
        }
    }

    /// A request before a sample, that leads to another state or is refused.
    pub fn asked(&mut self, event: Event) {
        match self.status.state.after(event) {
            Ok(state) => self.status.state = state,
            Err(_) => self.status.refused_requests += 1,
        }
    }

    /// A sample: its state, error and code in force, and the fault that is latched.
    pub fn sampled(&mut self, state: State, error_counts: i32, code: i32, fault: Option<Fault>) {
        let status = &mut self.status;
        if state == State::Fault && status.state != State::Fault {
            status.faults += 1;
            status.first_fault = status.first_fault.or(fault);
        }
        if status.state.is_powered() || state.is_powered() {
            let size = error_counts.unsigned_abs();
            status.peak_error_counts = status.peak_error_counts.max(size);
        }
        (status.state, status.fault) = (state, fault);
        (self.error_counts, self.code) = (error_counts, code);
    }

    /// Answer to the plant, with the report for the summary.
    pub fn command(&self, tick: u64, out_of_range: bool) -> Command {
        Command {
            out_of_range,
            axis: Some(self.status),
            ..Command::whole(tick, self.error_counts, self.code)
        }
    }
}

/// The sources of a run.
#[derive(Debug, Clone)]
pub enum Source {
    /// The table in the controller's memory.
    Table(Table),
    /// The firmware's generator.
    Generator(Box<Generator>),
    /// A queue that the host keeps filled.
    Queue(Box<StreamedQueue>),
}

impl Source {
    /// A queue that is filled from there.
    pub(super) fn queue(supply: Supply) -> Self {
        Self::Queue(Box::new(StreamedQueue {
            supply,
            stream: Stream::new(),
            ended: false,
            last: None,
        }))
    }
}

impl SetpointSource for Source {
    fn next(&mut self, observed: &Observed) -> Next {
        match self {
            Self::Table(table) => table.next(),
            Self::Generator(generator) => generator.next(),
            Self::Queue(queue) => queue.next(observed),
        }
    }
}

/// A table as words of a controller's memory, and how far it has been read.
#[derive(Debug, Clone)]
pub struct Table {
    /// Positions, or three words a sample where the rates stand beside them.
    pub words: Arc<[i32]>,
    /// Velocity and acceleration follow each position.
    pub has_rates: bool,
    place: TablePlace,
    at: usize,
}

impl Table {
    pub(super) fn new(words: Vec<i32>, has_rates: bool) -> Self {
        Self {
            words: words.into(),
            has_rates,
            place: TablePlace::START,
            at: 0,
        }
    }

    fn next(&mut self) -> Next {
        if self.has_rates {
            return next_rated(&self.words, &mut self.at);
        }
        let last = self.words.last().copied().unwrap_or(0);
        self.place.next_of(&self.words, last)
    }
}

/// The stretches of a motion, and how far they have been taken.
#[derive(Debug, Clone)]
pub struct Generator {
    /// The stretches, in their order.
    pub stretches: Vec<Stretch>,
    /// The end of the motion \[counts, modulo 2^32\].
    pub end: i32,
    taken: usize,
}

impl Generator {
    pub(super) fn new(plan: &MotionPlan, law: &Law) -> Self {
        Self {
            stretches: plan.stretches(law.words(), 0).collect(),
            end: plan.head().end,
            taken: 0,
        }
    }

    fn next(&mut self) -> Next {
        let next = self.stretches.get(self.taken).copied();
        self.taken += 1;
        let end = Setpoint {
            position: self.end,
            ..Setpoint::default()
        };
        next.map_or(Next::Last(end), Next::Stretch)
    }
}

/// Setpoints that wait between the link and the axis.
const WAITING: usize = 16;

/// Setpoints for a queue, one after the other.
#[derive(Debug, Clone)]
pub(super) enum Supply {
    /// From a generator of the host: the present stretch at the last sample, what is left of
    /// it, and the fraction bits of its velocity.
    Stretches(Generator, Stretch, u32, u8),
    /// From a table, where no generator makes the motion.
    Table(Table),
}

impl Supply {
    pub(super) fn of_stretches(generator: Generator, velocity_bits: u8) -> Self {
        Self::Stretches(generator, Stretch::default(), 0, velocity_bits)
    }

    fn next(&mut self) -> Streamed {
        let next = match self {
            Self::Stretches(_, stretch, left @ 1.., bits) => {
                stretch.advance();
                *left -= 1;
                Next::Setpoint(stretch.first(*bits))
            }
            Self::Stretches(generator, stretch, left, bits) => match generator.next() {
                Next::Stretch(next) => {
                    (*stretch, *left) = (next, next.samples - 1);
                    Next::Setpoint(next.first(*bits))
                }
                end => end,
            },
            Self::Table(table) => table.next(),
        };
        match next {
            Next::Setpoint(setpoint) => Streamed::Setpoint(setpoint),
            Next::Last(setpoint) => Streamed::Last(setpoint),
            // Stretches are taken above, and a table has a setpoint at least.
            Next::Stretch(_) | Next::Underrun => Streamed::Last(Setpoint::default()),
        }
    }
}

/// A queue that the host keeps full.
#[derive(Debug, Clone)]
pub struct StreamedQueue {
    supply: Supply,
    stream: Stream<WAITING>,
    /// The end of the motion was sent.
    ended: bool,
    /// End of the motion, once the axis has taken it.
    last: Option<Setpoint>,
}

impl StreamedQueue {
    /// Sends what there is room for; nothing where the link is `broken`.
    pub fn fill(&mut self, broken: bool) {
        let (mut sender, _) = self.stream.split();
        while !broken && !self.ended && sender.room() > 0 {
            let item = self.supply.next();
            self.ended = matches!(item, Streamed::Last(_));
            // There is room, by the loop's condition.
            let _ = sender.send(item);
        }
    }

    /// The next setpoint.
    pub fn next(&mut self, observed: &Observed) -> Next {
        if let Some(last) = self.last {
            return Next::Last(last);
        }
        let (_, mut receiver) = self.stream.split();
        let next = receiver.next(observed);
        if let Next::Last(last) = next {
            self.last = Some(last);
        }
        next
    }
}
