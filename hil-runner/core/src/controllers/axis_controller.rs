//! Rung `firmware` with everything beyond the paper's law: the firmware's [`Axis`]
//! on a board, with its setpoints, requests and faults.
//!
//! The axis is enabled and started before its first sample. Requests and
//! injected faults come at the first sample at or after their time.

use firmware::axis::{Axis, AxisState};
use firmware::hardware::serve;
use firmware::law::Law;

use super::backlash::compensated;
use super::board::BenchBoard;
use super::setpoint::LastTable;
use super::setup::{Setup, started};
use super::world::{Arrivals, Reported, Source, World};
use crate::case::Case;
use crate::io::IoKind;
use crate::message::{AxisStatus, Command, Measurement};
use crate::options::GapSource;
use crate::quantise::{FixedPointGains, QuantiseError};

/// The firmware's axis with its memory, its board and its source of setpoints.
#[derive(Debug, Clone)]
pub struct AxisController {
    axis: Axis,
    /// The gains in fixed point, with their rounding.
    pub(super) gains: FixedPointGains,
    /// The law from the gain change on.
    next_law: Option<Law>,
    state: AxisState,
    board: BenchBoard,
    source: Source,
    world: World,
    reported: Reported,
}

/// Tells whether a run of the case could be set up at this sample time \[ns\], less
/// the measurement of a gap.
///
/// # Errors
/// [`QuantiseError`] with what is in the way.
pub fn accepted(case: &Case, sample_time_ns: u64) -> Result<(), QuantiseError> {
    let setup = Setup::of(case, sample_time_ns)?;
    let law = setup.law()?.law;
    match case.options.backlash.gap {
        GapSource::Given => compensated(&setup, law)?,
        GapSource::Measured => setup.axis(law)?,
    };
    setup.next_law()?;
    Ok(())
}

/// The smallest sample time for which a run of the case could be set up \[ns\],
/// to three digits; `None` if the present one has none.
pub fn smallest_sample_time_ns(case: &Case) -> Option<u64> {
    // A step that is measured and misses its deadline is a verdict, not a refusal.
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
    /// [`QuantiseError`] if a setting has no fixed-point form, the motion cannot be
    /// generated, the gap cannot be measured or crossed, or the board has no such
    /// converter.
    pub fn new(case: &Case, period_ns: u64, io: IoKind) -> Result<Self, QuantiseError> {
        Self::with_table(case, period_ns, io, &mut LastTable::default())
    }

    /// The same with the last table of setpoints, if that is the case's.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_table(
        case: &Case,
        period_ns: u64,
        io: IoKind,
        last: &mut LastTable,
    ) -> Result<Self, QuantiseError> {
        let setup = Setup::of(case, period_ns)?;
        let scaled = setup.law()?;
        let axis = compensated(&setup, scaled.law)?;
        let state = started(&axis);
        Ok(Self {
            reported: Reported::new(state.state()),
            world: World::new(&case.options, period_ns),
            axis,
            next_law: setup.next_law()?.filter(|law| *law != scaled.law),
            gains: scaled.fixed_point(),
            state,
            board: BenchBoard::new(case, io)?,
            source: setup.source_with(&scaled.law, last),
        })
    }

    /// One sample.
    pub fn step(&mut self, measurement: Measurement) -> Command {
        let out_of_range = self.sample(measurement);
        self.reported.command(measurement.tick, out_of_range)
    }

    /// The code in force after one sample.
    pub fn code(&mut self, measurement: Measurement) -> i32 {
        self.sample(measurement);
        self.reported.code
    }

    /// The report so far.
    pub fn status(&self) -> AxisStatus {
        self.reported.status
    }

    /// Takes a sample; whether it was outside the declared ranges.
    fn sample(&mut self, measurement: Measurement) -> bool {
        let tick = measurement.tick;
        let mut queue_is_dry = false;
        if self.world.is_quiet(tick) {
            self.board.set_inputs(self.world.shown(measurement));
        } else {
            let Some(arrivals) = self.world.at(measurement) else {
                return false;
            };
            self.take(&arrivals);
            self.board.set_inputs(arrivals.shown);
            queue_is_dry = arrivals.queue_is_dry;
        }
        if let Source::Queue(queue) = &mut self.source {
            queue.fill(queue_is_dry);
        }
        let output = serve(&mut self.state, &mut self.board, &mut self.source, tick);
        let code = self.board.code_in_force();
        let fault = self.state.fault().copied();
        self.reported
            .sampled(output.state, output.error_counts, code, fault);
        output.out_of_range
    }

    /// Requests and other gains before a sample.
    fn take(&mut self, arrivals: &Arrivals) {
        for event in arrivals.events.into_iter().flatten() {
            self.reported.asked(event);
            // The report has counted a refusal.
            let _ = self.state.request(event);
        }
        if arrivals.gains_change
            && let Some(law) = self.next_law.take()
        {
            self.axis.set_law(law);
            self.state.change(&self.axis);
        }
    }
}
