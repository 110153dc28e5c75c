//! Rung `firmware` with what a product needs beyond the paper's law: the
//! firmware's [`Axis`] on a board, with its setpoints, requests and faults.
//!
//! The axis is enabled and started before its first sample. Requests and
//! injected faults come at the first sample at or after their time.

mod board;
mod homing;
mod setup;
mod source;

use firmware::axis::{Axis, AxisState};
use firmware::hardware::serve;
use firmware::law::Law;
use firmware::{Event, Fault, State, counts};

use super::whole;
use crate::case::Case;
use crate::message::{Command, Measurement};
use crate::quantise::QuantiseError;
use crate::servo::{EncoderGlitch, GapSource, ServoSettings};
use crate::words::{ServoWords, WordRequest};

pub use board::IoKind;
pub use homing::{GapMeasurement, measure_gap};

pub(super) use board::BenchBoard;
use setup::Setup;
use source::Source;

/// What the axis reports with every command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServoStatus {
    /// State after the sample.
    pub state: State,
    /// The first fault of the run, whether or not it was reset.
    pub first_fault: Option<Fault>,
    /// Faults so far.
    pub faults: u32,
    /// Largest `|e|` while the axis was powered \[counts\].
    pub peak_error_counts: u32,
    /// Requests that the state refused so far.
    pub refused_requests: u32,
}

/// The firmware's axis with its memory, its board and its source of setpoints.
#[derive(Debug, Clone)]
pub struct ServoLaw {
    settings: ServoSettings,
    period_ns: u64,
    axis: Axis,
    words: ServoWords,
    /// The law from the gain change on.
    next_law: Option<Law>,
    state: AxisState,
    board: BenchBoard,
    source: Source,
    /// The count at which the encoder froze.
    frozen_counts: Option<f64>,
    /// `e` of the last sample that ran \[counts\].
    error_counts: i32,
    first_fault: Option<Fault>,
    faults: u32,
    peak_error_counts: u32,
    refused_requests: u32,
}

/// What the words of a case are made from, whether or not it asks for more
/// than the paper's law.
///
/// # Errors
/// [`QuantiseError`] if there is no sample time or the motion cannot be
/// generated.
pub fn word_request(case: &Case) -> Result<WordRequest, QuantiseError> {
    let period_ns = case.controller.sample_time_ns;
    let period_ns = period_ns.ok_or(QuantiseError::NoSampleTime)?;
    Ok(Setup::of(case, period_ns)?.request())
}

/// Whether a run of the case could be set up at this sample time \[ns\], less the
/// measurement of a gap.
///
/// # Errors
/// [`QuantiseError`] with what is in the way.
pub fn accepted(case: &Case, sample_time_ns: u64) -> Result<(), QuantiseError> {
    let setup = Setup::of(case, sample_time_ns)?;
    let law = setup.words()?.law;
    match case.servo.backlash.gap {
        GapSource::Given => setup.axis(law)?,
        GapSource::Measured => setup.axis_without_take_up(law)?,
    };
    setup.next_law()?;
    setup.source()?;
    Ok(())
}

/// The smallest sample time for which a run of the case could be set up \[ns\],
/// to three digits; `None` if the present one has none.
pub fn smallest_sample_time_ns(case: &Case) -> Option<u64> {
    let fits = |sample_time_ns| {
        sample_time_ns >= case.controller.computation_delay_ns
            && accepted(case, sample_time_ns).is_ok()
    };
    let mut fitting = case.controller.sample_time_ns.filter(|&ns| fits(ns))?;
    let mut refused = 0;
    while fitting - refused > 1 && fitting > refused + refused / 1_000 {
        let middle = refused + (fitting - refused) / 2;
        if fits(middle) {
            fitting = middle;
        } else {
            refused = middle;
        }
    }
    Some(fitting)
}

impl ServoLaw {
    /// # Errors
    /// [`QuantiseError`] if a setting fits no word, the motion cannot be
    /// generated, the gap cannot be taken up or measured, or the board has no
    /// such converter.
    pub(crate) fn new(case: &Case, period_ns: u64, io: IoKind) -> Result<Self, QuantiseError> {
        let setup = Setup::of(case, period_ns)?;
        let words = setup.words()?;
        let axis = setup.axis(words.law)?;
        let mut state = AxisState::start(&axis);
        // From rest, before the first sample: the table has no refusal here.
        for event in [Event::Enable, Event::Start] {
            let _ = axis.request(&mut state, event);
        }
        Ok(Self {
            settings: case.servo,
            period_ns,
            axis,
            next_law: setup.next_law()?,
            words,
            state,
            board: BenchBoard::new(case, io)?,
            source: setup.source()?,
            frozen_counts: None,
            error_counts: 0,
            first_fault: None,
            faults: 0,
            peak_error_counts: 0,
            refused_requests: 0,
        })
    }

    /// The words of the law.
    pub fn words(&self) -> &ServoWords {
        &self.words
    }

    pub(crate) fn step(&mut self, measurement: Measurement) -> Command {
        let tick = measurement.tick;
        let injections = self.settings.injections;
        if self.missed_tick() == Some(tick) {
            // The loop does not run: everything stays as it is.
            return self.command(tick, false);
        }
        self.requests(tick);
        self.inputs(measurement);
        if let Source::Queue(queue) = &mut self.source {
            let dry = injections.setpoint_underrun_ns;
            queue.fill(dry.is_some_and(|at_ns| tick * self.period_ns >= at_ns));
        }
        let before = self.state.state();
        let output = serve(
            &self.axis,
            &mut self.state,
            &mut self.board,
            &mut self.source,
            tick,
        );
        self.error_counts = output.error_counts;
        if output.state == State::Fault && before != State::Fault {
            self.faults += 1;
            self.first_fault = self.first_fault.or(self.state.fault().copied());
        }
        if before.is_powered() || output.state.is_powered() {
            let size = output.error_counts.unsigned_abs();
            self.peak_error_counts = self.peak_error_counts.max(size);
        }
        self.command(tick, output.out_of_range)
    }

    fn command(&self, tick: u64, out_of_range: bool) -> Command {
        Command {
            tick,
            error_counts: f64::from(self.error_counts),
            dac_code: f64::from(self.board.code_in_force()),
            out_of_range,
            servo: Some(ServoStatus {
                state: self.state.state(),
                first_fault: self.first_fault,
                faults: self.faults,
                peak_error_counts: self.peak_error_counts,
                refused_requests: self.refused_requests,
            }),
        }
    }

    /// What is asked for before this sample.
    fn requests(&mut self, tick: u64) {
        let requests = self.settings.requests;
        for (at_ns, event) in [
            (requests.disable_ns, Event::Disable),
            (requests.reset_ns, Event::Reset),
            (requests.enable_ns, Event::Enable),
        ] {
            if self.comes(at_ns, tick) && self.axis.request(&mut self.state, event).is_err() {
                self.refused_requests += 1;
            }
        }
        let change = self.settings.gain_change.map(|change| change.at_ns);
        if self.comes(change, tick)
            && let Some(law) = self.next_law
            && law != *self.axis.law()
        {
            self.axis.set_law(law);
            self.state.gains_changed();
        }
    }

    /// What the board shows at this sample.
    fn inputs(&mut self, measurement: Measurement) {
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
        self.board.set_inputs(board::Shown {
            motor_counts: whole(position),
            load_register: measurement
                .load_counts
                .map(|counts| counts::wrap(whole(counts)).cast_unsigned()),
            emergency_stop: pressed,
            bus_fails: self.comes(injections.bus_error_ns, tick),
        });
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
