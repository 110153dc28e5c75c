//! The axis as a hybrid automaton: a mode with its smooth equations, a state,
//! and changes of mode where a guard reaches zero ([`guard`]).
//!
//! Every solver that locates events moves an [`Automaton`]; what happens at one
//! instant is the same for all of them and stands here.

pub(crate) mod guard;

use self::guard::{Guard, Guards};
use crate::model::amplifier::Stage;
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::direction::Direction;
use crate::model::joint::{Contact, JointMode};
use crate::model::pid::Side;
use crate::model::state::{CURRENT, EPSILON, EPSILON_DOT, State, Vector};
use crate::numerics::seconds;
use crate::observe::extremes::{FIGURES, figures_at};
use crate::observe::{ContactChange, Interior, Span, Watch};

/// Reason why the plant could not be advanced. The state stays where the last
/// completed step left it; the run cannot go on.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlantError {
    /// A state left the finite numbers.
    #[error("the state left the finite numbers at t = {time_s} s")]
    NonFinite {
        /// Time \[s\].
        time_s: f64,
    },
    /// The adaptive step fell below what the clock resolves, or one interval
    /// took more steps than [`crate::Plant`] allows: the plant is too stiff,
    /// or the state runs away in finite time.
    #[error(
        "the solver's step became too short at t = {time_s} s: either the state runs away \
         there (a resistance that drives the carriage), or something is too stiff for it \
         (a tiny inductance or inertia, a huge stiffness, damping or gain)"
    )]
    TooStiff {
        /// Time \[s\].
        time_s: f64,
    },
    /// Solver `exact` was asked to solve a plant with a quadratic resistance.
    #[error("solver exact needs a plant without quadratic resistance; dopri5 solves it")]
    NotAffine,
    /// Runs side by side were asked for that do not go so: with a current drive, or a load
    /// that comes and goes.
    #[error("only voltage drives and loads that act at all times go side by side")]
    NotSideBySide,
    /// The run's work reached what its observer allows.
    #[error("more work than the run may take by t = {time_s} s")]
    OutOfWork {
        /// Time \[s\].
        time_s: f64,
    },
    /// More mode changes in one interval than [`crate::Plant`] allows.
    #[error("the contact or the friction changes its mode without end at t = {time_s} s")]
    TooManyEvents {
        /// Time \[s\].
        time_s: f64,
    },
}

/// Mode changes within one interval after which the plant gives up: ten
/// thousand in a sample or a row are no rattle that anyone could use.
const MAX_EVENTS: u32 = 10_000;

/// Mode changes at one and the same instant after which the plant gives up: a
/// contact, a break of stiction and a limit can coincide, more cannot.
const MAX_EVENTS_AT_ONCE: u32 = 8;

/// An interval that is advanced over from event to event.
#[derive(Debug, Default)]
pub(crate) struct Interval {
    pub(crate) start_s: f64,
    pub(crate) length_s: f64,
    /// Time gone since the start \[s\].
    pub(crate) done_s: f64,
    /// Steps taken by a solver that counts them.
    pub(crate) steps: f64,
    events: u32,
}

impl Interval {
    pub(crate) fn new(start_s: f64, length_s: f64) -> Self {
        Self {
            start_s,
            length_s,
            ..Self::default()
        }
    }

    pub(crate) fn now_s(&self) -> f64 {
        self.start_s + self.done_s
    }

    /// Counts work of the run.
    pub(crate) fn count_work(&self, amount: u64, watch: &mut impl Watch) -> Result<(), PlantError> {
        let (time_s, goes_on) = (self.now_s(), watch.work(amount));
        goes_on
            .then_some(())
            .ok_or(PlantError::OutOfWork { time_s })
    }

    pub(crate) fn count_event(&mut self) -> Result<(), PlantError> {
        self.events += 1;
        let (time_s, goes_on) = (self.now_s(), self.events <= MAX_EVENTS);
        goes_on
            .then_some(())
            .ok_or(PlantError::TooManyEvents { time_s })
    }
}

/// The axis in a mode and a state at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Automaton {
    pub(crate) axis: Axis,
    pub(crate) mode: Mode,
    pub(crate) y: Vector,
    pub(crate) time_ns: u64,
    /// The guard whose surface the state lies on since the last mode change.
    pub(crate) fresh: Option<Guard>,
}

impl Automaton {
    /// At rest at zero, the joint centred in its gap or on a flank, time 0.
    pub(crate) fn new(axis: Axis, flank: Option<Direction>) -> Self {
        let mut start = Self {
            axis,
            mode: axis.mode_at_rest(),
            y: Vector::zeros(),
            time_ns: 0,
            fresh: None,
        };
        if let Some(flank) = flank {
            start.mode.joint = JointMode::Loaded(flank);
            start.y[EPSILON] = axis.start_rad;
        }
        start
    }

    /// Takes over a state within the present mode.
    pub(crate) fn set(&mut self, state: &State, time_ns: u64) {
        self.y = state.to_vector();
        self.time_ns = time_ns;
    }

    /// A copy in the same mode at another state and time.
    pub(crate) fn at(&self, state: &State, time_ns: u64) -> Self {
        Self {
            y: state.to_vector(),
            time_ns,
            ..*self
        }
    }

    /// State now.
    pub(crate) fn state(&self) -> State {
        self.axis.state(&self.y)
    }

    /// Contact of the joint now.
    pub(crate) fn contact(&self) -> Contact {
        self.mode.joint.contact()
    }

    /// The figures now, x_ref being `x_ref_m` and no voltage at the motor.
    pub(crate) fn figures(&self, x_ref_m: f64) -> [f64; FIGURES] {
        figures_at(&self.axis, &self.mode, &self.y, (x_ref_m, 0.0))
    }

    /// `ẍ = p·γ̈` now \[m/s²\].
    pub(crate) fn acceleration_mps2(&self) -> f64 {
        self.axis.carriage_acceleration_mps2(&self.mode, &self.y)
    }

    /// Moves on to `y`, and hands the piece of the solution that leads there to the
    /// observer: it starts at `start_s` and is `length_s` long.
    #[inline(always)]
    pub(crate) fn move_along(
        &mut self,
        drive: &Drive<'_>,
        (start_s, length_s): (f64, f64),
        y: Vector,
        interior: &dyn Interior,
        watch: &mut impl Watch,
    ) {
        watch.span(&Span {
            axis: &self.axis,
            drive,
            modes: (self.mode, self.mode),
            start_s,
            length_s,
            y: (&self.y, &y),
            interior,
        });
        self.y = y;
    }

    #[inline]
    pub(crate) fn guards(&self, drive: &Drive<'_>) -> Guards {
        let feedback = matches!(drive, Drive::Feedback(_));
        self.mode
            .guards(self.axis.releases(), self.axis.stage, feedback)
    }

    /// Gives the motor what an ideal current loop makes of a new command at once.
    pub(crate) fn take_up(&mut self, drive: &Drive<'_>) {
        if self.axis.stage == Stage::IdealCurrent {
            let time_s = seconds(self.time_ns);
            self.y[CURRENT] = self.axis.command(&self.mode, drive, time_s, &self.y);
        }
    }

    /// Changes the mode at `guard` and reports a change of contact.
    pub(crate) fn switch(
        &mut self,
        guard: Guard,
        drive: &Drive<'_>,
        interval: &Interval,
        watch: &mut impl Watch,
    ) {
        let from = self.contact();
        let acceleration_before_mps2 = self.acceleration_mps2();
        self.mode = self.axis.switch(guard, &self.mode, &mut self.y);
        let opposite = guard.opposite(&self.mode);
        self.fresh = self
            .guards(drive)
            .contains(&Some(opposite))
            .then_some(opposite);
        let to = self.contact();
        if from != to {
            watch.contact_change(&ContactChange {
                time_s: interval.now_s(),
                from,
                to,
                impact: matches!(guard, Guard::Meet(_)),
                epsilon_dot_radps: self.y[EPSILON_DOT],
                acceleration_before_mps2,
                acceleration_after_mps2: self.acceleration_mps2(),
            });
        } else {
            // Whether it was too much is asked with the next piece.
            let _ = watch.work(1);
        }
    }

    /// Changes modes until every guard holds at this very instant: a contact
    /// may break the stick, a new voltage may move a rigid axis off rest.
    /// Returns the derivative.
    pub(crate) fn settle(
        &mut self,
        drive: &Drive<'_>,
        interval: &Interval,
        watch: &mut impl Watch,
    ) -> Result<Vector, PlantError> {
        let time_s = interval.now_s();
        for _ in 0..MAX_EVENTS_AT_ONCE {
            let now = (time_s, Side::After);
            let dy = self.axis.derivative(&self.mode, drive, now, &self.y);
            let here = (&self.y, &dy);
            let values = self.guards(drive).into_iter().flatten().map(|guard| {
                let (value, rate) = self.axis.guard(guard, &self.mode, drive, now, here);
                (guard, value, rate)
            });
            let leaves = |guard| self.axis.leaves_from_rest(guard, (drive, time_s), here);
            let broken = values.into_iter().find(|&(guard, value, rate)| {
                let is_broken =
                    value < 0.0 || value == 0.0 && rate < 0.0 || leaves(guard).is_some();
                self.fresh != Some(guard) && is_broken
            });
            let Some((mut guard, value, _)) = broken else {
                return Ok(dy);
            };
            let left = leaves(guard);
            if let Some(flank) = left {
                // By as much as an event is found behind its surface, so that no rounding
                // takes it back. Of no torque there is nothing to let go of first.
                let noise_rad = self.axis.parting_noise_rad;
                self.y[EPSILON] -= noise_rad.copysign(self.y[EPSILON]);
                guard = Guard::Part(flank);
            }
            self.switch(guard, drive, interval, watch);
            // That way, and by a command that jumps past the limit, the surface is left behind.
            let jumps = value < 0.0 && matches!(guard, Guard::Saturate(_) | Guard::Desaturate(_));
            if left.is_some() || jumps {
                self.fresh = None;
            }
        }
        Err(PlantError::TooManyEvents { time_s })
    }
}
