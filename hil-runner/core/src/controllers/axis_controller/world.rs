//! What a run brings to its axis, sample by sample, wherever the axis runs:
//! requests, injected faults, a queue that runs dry; and what the axis has
//! reported so far.

use firmware::{Event, Fault, State, counts};

use super::AxisStatus;
use super::board::Shown;
use crate::controllers::whole;
use crate::message::{Command, Measurement};
use crate::options::{AxisOptions, EncoderGlitch};

/// Requests and injected faults. They come at the first sample at or after
/// their time.
#[derive(Debug, Clone)]
pub struct World {
    settings: AxisOptions,
    period_ns: u64,
    /// The count at which the encoder froze.
    frozen_counts: Option<f64>,
}

impl World {
    /// The world of an axis at samples `period_ns` apart.
    pub fn new(settings: AxisOptions, period_ns: u64) -> Self {
        Self {
            settings,
            period_ns,
            frozen_counts: None,
        }
    }

    /// Whether the sample does not come: the loop does not run, and everything
    /// stays as it is.
    pub fn misses(&self, tick: u64) -> bool {
        self.missed_tick() == Some(tick)
    }

    /// What is asked for before this sample, in this order.
    pub fn events(&self, tick: u64) -> impl Iterator<Item = Event> {
        let requests = self.settings.requests;
        [
            (requests.disable_ns, Event::Disable),
            (requests.reset_ns, Event::Reset),
            (requests.enable_ns, Event::Enable),
        ]
        .into_iter()
        .filter_map(move |(at_ns, event)| self.comes(at_ns, tick).then_some(event))
    }

    /// Whether the gains change before this sample.
    pub fn changes_gains(&self, tick: u64) -> bool {
        let change = self.settings.gain_change.map(|change| change.at_ns);
        self.comes(change, tick)
    }

    /// Whether the host no longer fills the queue of setpoints.
    pub fn queue_is_dry(&self, tick: u64) -> bool {
        let dry_ns = self.settings.injections.setpoint_underrun_ns;
        dry_ns.is_some_and(|at_ns| tick * self.period_ns >= at_ns)
    }

    /// What the board shows at this sample.
    pub fn shown(&mut self, measurement: Measurement) -> Shown {
        let tick = measurement.tick;
        let injections = self.settings.injections;
        let mut position = measurement.position_counts;
        if self.comes(injections.encoder_freeze_ns, tick) {
            self.frozen_counts = Some(position);
        }
        position = self.frozen_counts.unwrap_or(position);
        if let Some(EncoderGlitch { at_ns, counts }) = injections.encoder_glitch
            && self.comes(Some(at_ns), tick)
        {
            position += f64::from(counts);
        }
        let requests = self.settings.requests;
        let time_ns = tick * self.period_ns;
        let pressed = requests.emergency_stop_ns.is_some_and(|at| time_ns >= at)
            && requests
                .emergency_stop_release_ns
                .is_none_or(|at| time_ns < at);
        Shown {
            motor_counts: whole(position),
            load_register: measurement
                .load_counts
                .map(|counts| counts::wrap(whole(counts)).cast_unsigned()),
            emergency_stop: pressed,
            bus_fails: self.comes(injections.bus_error_ns, tick),
        }
    }

    /// Whether `tick` is the first sample at or after `at_ns` that is not missed.
    fn comes(&self, at_ns: Option<u64>, tick: u64) -> bool {
        let first = at_ns.map(|at_ns| at_ns.div_ceil(self.period_ns));
        let waits = first.is_some() && first == self.missed_tick();
        first.map(|first| first + u64::from(waits)) == Some(tick)
    }

    /// The sample that does not come.
    fn missed_tick(&self) -> Option<u64> {
        let at_ns = self.settings.injections.missed_tick_ns?;
        Some(at_ns.div_ceil(self.period_ns))
    }
}

/// What the axis has reported so far.
#[derive(Debug, Clone)]
pub struct Reported {
    /// After the last request or sample.
    state: State,
    /// `e` of the last sample that ran \[counts\].
    error_counts: i32,
    /// The code in force.
    code: i32,
    /// The fault that is latched.
    fault: Option<Fault>,
    first_fault: Option<Fault>,
    faults: u32,
    peak_error_counts: u32,
    refused_requests: u32,
}

impl Reported {
    /// Before the first sample, the axis in `state`.
    pub fn new(state: State) -> Self {
        Self {
            state,
            error_counts: 0,
            code: 0,
            fault: None,
            first_fault: None,
            faults: 0,
            peak_error_counts: 0,
            refused_requests: 0,
        }
    }

    /// The state after the last request or sample.
    pub fn state(&self) -> State {
        self.state
    }

    /// A request before a sample, that leads to another state or is refused.
    pub fn asked(&mut self, event: Event) {
        match self.state.after(event) {
            Ok(state) => self.state = state,
            Err(_) => self.refused_requests += 1,
        }
    }

    /// A sample: its state, error and code in force, and the fault that is latched.
    pub fn sampled(&mut self, state: State, error_counts: i32, code: i32, fault: Option<Fault>) {
        if state == State::Fault && self.state != State::Fault {
            self.faults += 1;
            self.first_fault = self.first_fault.or(fault);
        }
        if self.state.is_powered() || state.is_powered() {
            let size = error_counts.unsigned_abs();
            self.peak_error_counts = self.peak_error_counts.max(size);
        }
        (self.state, self.error_counts, self.code) = (state, error_counts, code);
        self.fault = fault;
    }

    /// What the plant and the summary get of it.
    pub fn command(&self, tick: u64, out_of_range: bool) -> Command {
        Command {
            tick,
            error_counts: f64::from(self.error_counts),
            dac_code: f64::from(self.code),
            out_of_range,
            execution: None,
            axis: Some(AxisStatus {
                state: self.state,
                fault: self.fault,
                first_fault: self.first_fault,
                faults: self.faults,
                peak_error_counts: self.peak_error_counts,
                refused_requests: self.refused_requests,
            }),
        }
    }
}
