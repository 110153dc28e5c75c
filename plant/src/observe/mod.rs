//! Observation of a solution: one smooth piece at a time and the contact changes
//! between them ([`Watch`]), and the largest values over it ([`extremes`]).
//!
//! A solver hands over each piece with the state at its ends and, as
//! [`Interior`], what it knows of the solution between them.

pub(crate) mod extremes;

use core::fmt;

use self::extremes::{Energies, Extremes};
use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::joint::Contact;
use crate::model::resistance::GuideMode;
use crate::model::state::{State, Vector, gamma};

/// Follows the plant as it is advanced.
pub trait Watch {
    /// A smooth piece of the solution, in order and without holes.
    fn span(&mut self, span: &Span<'_>);
    /// The joint took load or let go, between two spans.
    fn contact_change(&mut self, change: &ContactChange);
    /// Takes note of steps and searches beyond the one step of an interval; `false`
    /// ends the run.
    fn work(&mut self, _amount: u64) -> bool {
        true
    }
}

/// Watches nothing.
impl Watch for () {
    fn span(&mut self, _: &Span<'_>) {}
    fn contact_change(&mut self, _: &ContactChange) {}
}

/// One change of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactChange {
    /// Time \[s\].
    pub time_s: f64,
    /// Contact before.
    pub from: Contact,
    /// Contact after.
    pub to: Contact,
    /// True if the gap closed: taking load again after `no_pull` let go is a
    /// change, but no impact.
    pub impact: bool,
    /// `ε̇` at the change \[rad/s\]: at an impact its magnitude is the speed at
    /// which the gap closes.
    pub epsilon_dot_radps: f64,
    /// Carriage acceleration just before \[m/s²\].
    pub acceleration_before_mps2: f64,
    /// Carriage acceleration just after \[m/s²\].
    pub acceleration_after_mps2: f64,
}

/// The solution between the ends of a span, as its solver knows it.
pub(crate) trait Interior: fmt::Debug {
    /// The state at `start + θ·length` of `span`, 0 < θ < 1.
    fn vector_at(&self, span: &Span<'_>, theta: f64) -> Vector;

    /// Raises `extremes` to those over `span`, its ends included.
    fn raise(&self, span: &Span<'_>, extremes: &mut Extremes);
}

/// A smooth piece of the solution.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    pub(crate) axis: &'a Axis,
    pub(crate) drive: &'a Drive<'a>,
    /// Mode at the start and, where it differs (solver `rk4`), at the end.
    pub(crate) modes: (Mode, Mode),
    pub(crate) start_s: f64,
    pub(crate) length_s: f64,
    pub(crate) y: (&'a Vector, &'a Vector),
    pub(crate) interior: &'a dyn Interior,
}

impl Span<'_> {
    /// Start of the span \[s\].
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// End of the span \[s\].
    pub fn end_s(&self) -> f64 {
        self.start_s + self.length_s
    }

    /// Length of the span \[s\].
    pub fn length_s(&self) -> f64 {
        self.length_s
    }

    /// State at `start + θ·length`, 0 ≤ θ ≤ 1. Solver `rk4` has only the ends
    /// and a cubic between them.
    pub fn state_at(&self, theta: f64) -> State {
        self.axis.state(&self.vector_at(theta))
    }

    /// Carriage acceleration at `start + θ·length` \[m/s²\].
    pub fn acceleration_at_mps2(&self, theta: f64) -> f64 {
        let y = self.vector_at(theta);
        self.axis
            .carriage_acceleration_mps2(self.mode_at(theta), &y)
    }

    /// Contact within the span.
    pub fn contact(&self) -> Contact {
        self.modes.0.joint.contact()
    }

    /// Motor voltage at `start + θ·length` \[V\].
    pub fn voltage_at_v(&self, theta: f64) -> f64 {
        let (time_s, y) = (self.start_s + theta * self.length_s, self.vector_at(theta));
        self.axis
            .voltage_v(self.mode_at(theta), self.drive, time_s, &y)
    }

    /// The energies of a piece of the exact solution, whatever the voltage is, from the heat of
    /// joint, armature and a linear resistance \[J\]: what went in has become heat, work
    /// against constant forces, or is stored.
    ///
    /// ```text
    /// ∫V·I dt = ∫c·ε̇² dt + ∫R·I² dt + ∫p·a1·γ̇² dt + p·(±a0 + F_load)·Δγ + Δstored
    /// ```
    #[inline(always)]
    pub(crate) fn balanced_energies(
        &self,
        joint_j: f64,
        armature_j: f64,
        guide_j: f64,
    ) -> Energies {
        let (axis, mode, (start, end)) = (self.axis, &self.modes.0, self.y);
        let mut electrical_j = (joint_j + armature_j)
            + (axis.stored_energy_j(mode, end) - axis.stored_energy_j(mode, start));
        // Stuck, nothing moves.
        if mode.guide != GuideMode::Stuck {
            let force_n = axis.resistance.polynomial(mode.guide)[0] + axis.load_force_n;
            let moved_rad = gamma(end) - gamma(start);
            electrical_j += guide_j + axis.pitch_m_per_rad * force_n * moved_rad;
        }
        [joint_j, armature_j, electrical_j]
    }

    pub(crate) fn mode_at(&self, theta: f64) -> &Mode {
        let (start, end) = &self.modes;
        if theta < 1.0 { start } else { end }
    }

    pub(crate) fn vector_at(&self, theta: f64) -> Vector {
        let (y0, y1) = self.y;
        match theta {
            _ if theta <= 0.0 => *y0,
            _ if theta >= 1.0 => *y1,
            _ => self.interior.vector_at(self, theta),
        }
    }
}

impl Extremes {
    /// Counts the time with `±V_max` at the motor, and that with the current held at its limit
    /// or beyond or its command at its own; of a held command that stands at a limit, but for
    /// that of a voltage drive with a current limit, the caller knows.
    #[cold]
    fn count_limits(&mut self, span: &Span<'_>) {
        let mode = &span.modes.0;
        let at_limit = mode.amplifier != AmplifierMode::Linear;
        let voltage_is_limited = match (span.axis.stage, mode.stage) {
            (_, StageMode::Saturated(_) | StageMode::Overrun(_)) => true,
            (Stage::Voltage, _) => at_limit,
            (Stage::LimitedVoltage { limit_v, .. }, StageMode::Follows) => match span.drive {
                Drive::Held(voltage_v) => voltage_v.abs() >= limit_v,
                Drive::Feedback(_) => at_limit,
            },
            _ => false,
        };
        let current_is_limited = match span.axis.stage {
            Stage::Voltage => false,
            Stage::LimitedVoltage { .. } => mode.stage != StageMode::Follows,
            Stage::IdealCurrent | Stage::CurrentLoop { .. } => at_limit,
        };
        if voltage_is_limited {
            self.voltage_limited_s += span.length_s;
        }
        if current_is_limited {
            self.current_limited_s += span.length_s;
        }
    }
}

impl Watch for Extremes {
    fn span(&mut self, span: &Span<'_>) {
        let papers = span.axis.stage.is_papers();
        if !papers || span.modes.0.amplifier != AmplifierMode::Linear {
            self.count_limits(span);
        }
        span.interior.raise(span, self);
    }

    fn contact_change(&mut self, change: &ContactChange) {
        self.contact_changes += 1;
        self.work += 1;
        self.impacts += u64::from(change.impact);
        if change.impact {
            let closing_radps = change.epsilon_dot_radps.abs();
            self.hardest_impact_radps = self.hardest_impact_radps.max(closing_radps);
        }
    }

    fn work(&mut self, amount: u64) -> bool {
        self.work += amount;
        self.work <= self.work_limit
    }
}
