//! Rung `firmware` with what a product needs beyond the paper's law: the
//! firmware's [`Axis`] on a board, with its setpoints, requests and faults.
//!
//! The axis is enabled and started before its first sample. Requests and
//! injected faults come at the first sample at or after their time.

mod board;
mod homing;
mod setup;
mod source;
mod world;

use firmware::axis::{Axis, AxisState};
use firmware::hardware::serve;
use firmware::law::Law;
use firmware::{Event, Fault, State};

use crate::case::Case;
use crate::message::{Command, Measurement};
use crate::options::GapSource;
use crate::quantise::QuantiseError;
use crate::scaling::{ScaledLaw, ScalingRequest};

pub use board::IoKind;
pub use homing::{GapMeasurement, measure_gap};

pub use board::BenchBoard;
pub use setup::Setup;
pub use source::{Source, StreamedQueue};
pub use world::{Reported, World};

/// What is asked of the axis before its first sample.
pub const FROM_REST: [Event; 2] = [Event::Enable, Event::Start];

/// What the axis reports with every command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisStatus {
    /// State after the sample.
    pub state: State,
    /// The fault that is latched.
    pub fault: Option<Fault>,
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
pub struct AxisController {
    axis: Axis,
    words: ScaledLaw,
    /// The law from the gain change on.
    next_law: Option<Law>,
    state: AxisState,
    board: BenchBoard,
    source: Source,
    world: World,
    reported: Reported,
}

/// What the words of a case are made from, whether or not it asks for more
/// than the paper's law.
///
/// # Errors
/// [`QuantiseError`] if there is no sample time or the motion cannot be
/// generated.
pub fn scaling_request(case: &Case) -> Result<ScalingRequest, QuantiseError> {
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
    match case.options.backlash.gap {
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
    // A step that is measured and comes late is a verdict, not a refusal.
    let delay_ns = case.controller.computation_delay.fixed_ns().unwrap_or(0);
    let fits =
        |sample_time_ns| sample_time_ns >= delay_ns && accepted(case, sample_time_ns).is_ok();
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

impl AxisController {
    /// # Errors
    /// [`QuantiseError`] if a setting fits no word, the motion cannot be
    /// generated, the gap cannot be taken up or measured, or the board has no
    /// such converter.
    pub fn new(case: &Case, period_ns: u64, io: IoKind) -> Result<Self, QuantiseError> {
        let setup = Setup::of(case, period_ns)?;
        let words = setup.words()?;
        let axis = setup.axis(words.law)?;
        let mut state = AxisState::start(&axis);
        // From rest, before the first sample: the table has no refusal here.
        for event in FROM_REST {
            let _ = axis.request(&mut state, event);
        }
        Ok(Self {
            reported: Reported::new(state.state()),
            world: World::new(case.options, period_ns),
            axis,
            next_law: setup.next_law()?,
            words,
            state,
            board: BenchBoard::new(case, io)?,
            source: setup.source()?,
        })
    }

    /// The words of the law.
    pub fn words(&self) -> &ScaledLaw {
        &self.words
    }

    /// One sample.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        let tick = measurement.tick;
        if self.world.misses(tick) {
            return self.reported.command(tick, false);
        }
        for event in self.world.events(tick) {
            self.reported.asked(event);
            // The report has counted a refusal.
            let _ = self.axis.request(&mut self.state, event);
        }
        if self.world.changes_gains(tick)
            && let Some(law) = self.next_law
            && law != *self.axis.law()
        {
            self.axis.set_law(law);
            self.state.gains_changed();
        }
        self.board.set_inputs(self.world.shown(measurement));
        if let Source::Queue(queue) = &mut self.source {
            queue.fill(self.world.queue_is_dry(tick));
        }
        let output = serve(
            &self.axis,
            &mut self.state,
            &mut self.board,
            &mut self.source,
            tick,
        );
        let code = self.board.code_in_force();
        let fault = self.state.fault().copied();
        self.reported
            .sampled(output.state, output.error_counts, code, fault);
        self.reported.command(tick, output.out_of_range)
    }
}
