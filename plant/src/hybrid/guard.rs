//! Modes of the axis and the guards that end them.
//!
//! Within one mode the equations are smooth. Each mode has a few guards:
//! functions that are positive inside the mode; the first to reach zero ends
//! it. The modes and their guards:
//!
//! ```text
//! joint      Open ──ε = ±b──► Loaded ──|ε| = b──► Open
//!                             Loaded ──Ψ = 0 (no_pull)──► Released ──|ε| = b──► Open
//!                             Released ──Ψ > 0──► Loaded
//! guide      Forward, Backward ──γ̇ = 0──► Stuck or the other direction
//!            Stuck ──|τ| = p·a0──► Forward, Backward
//! amplifier  Linear ◄──|command| = its limit──► AtLimit    (continuous law only)
//! stage      Follows ◄──|u| = V_max──► Saturated            (current loop)
//!            Follows ──|I| = I_max──► Holding ──V_c within──► Follows
//!            Holding ◄──no voltage holds it──► Overrun      (current limit)
//! ```

use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::axis::{Axis, Drive, Mode, demand};
use crate::model::direction::Direction;
use crate::model::joint::{ElasticJoint, Flank, JointMode};
use crate::model::pid::Side;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT, Vector, gamma_dot};

/// Reasons for which a mode ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Guard {
    /// `b − s·ε`: the gap closes on a flank.
    Meet(Flank),
    /// `s·ε − b`: the flank comes away.
    Part(Flank),
    /// `s·Ψ`: the flank would have to pull.
    Release(Flank),
    /// `−s·Ψ` of the released flank: it would push again.
    Reload(Flank),
    /// `s·γ̇`: sliding comes to rest.
    Stop(Direction),
    /// `p·a0 − s·(τ − p·F_load)`: dry friction gives way.
    Break(Direction),
    /// `limit − s·command`: the demand reaches the limit.
    Limit(Direction),
    /// `s·command − limit`: the demand comes back from the limit.
    Unlimit(Direction),
    /// `V_max − s·u`: the current loop has all the voltage that there is.
    Saturate(Direction),
    /// `s·u − V_max`: it needs less again.
    Desaturate(Direction),
    /// `I_max − s·I`: the current reaches its limit.
    Hold(Direction),
    /// `s·(V_c − V_h)`: the commanded voltage no longer pushes the current, held by V_h, out.
    LetGo(Direction),
    /// `V_max + s·V_h`: the voltage that holds the current reaches its own limit.
    Overrun(Direction),
    /// `s·I − I_max`: the current comes back to its limit.
    Return(Direction),
}

/// The guards of a mode: at most two each for joint, guide, amplifier and stage.
pub(crate) type Guards = [Option<Guard>; 8];

impl Mode {
    /// The guards of this mode. `releases` says whether a loaded flank lets
    /// go where it would pull, `feedback` whether the command follows the
    /// continuous law.
    pub(crate) fn guards(&self, releases: bool, stage: Stage, feedback: bool) -> Guards {
        let [a, b] = match self.joint {
            JointMode::Rigid | JointMode::Gapless => [None, None],
            JointMode::Open => [
                Some(Guard::Meet(Flank::Drive)),
                Some(Guard::Meet(Flank::Coast)),
            ],
            JointMode::Loaded(flank) if releases => [Some(Guard::Release(flank)), None],
            JointMode::Loaded(flank) => [Some(Guard::Part(flank)), None],
            JointMode::Released(flank) => [Some(Guard::Part(flank)), Some(Guard::Reload(flank))],
        };
        let [c, d] = match self.guide {
            GuideMode::AsWritten => [None, None],
            GuideMode::Forward => [Some(Guard::Stop(Direction::Positive)), None],
            GuideMode::Backward => [Some(Guard::Stop(Direction::Negative)), None],
            GuideMode::Stuck => [
                Some(Guard::Break(Direction::Positive)),
                Some(Guard::Break(Direction::Negative)),
            ],
        };
        let [e, f] = match self.amplifier {
            _ if !feedback => [None, None],
            AmplifierMode::Linear => [
                Some(Guard::Limit(Direction::Positive)),
                Some(Guard::Limit(Direction::Negative)),
            ],
            AmplifierMode::AtUpper => [Some(Guard::Unlimit(Direction::Positive)), None],
            AmplifierMode::AtLower => [Some(Guard::Unlimit(Direction::Negative)), None],
        };
        let both = |guard: fn(Direction) -> Guard| {
            [Direction::Positive, Direction::Negative].map(|d| Some(guard(d)))
        };
        let [g, h] = match (stage, self.stage) {
            (Stage::Voltage | Stage::IdealCurrent, _) => [None, None],
            (Stage::LimitedVoltage { .. }, StageMode::Follows) => both(Guard::Hold),
            (Stage::CurrentLoop { .. }, StageMode::Follows) => both(Guard::Saturate),
            (_, StageMode::Saturated(d)) => [Some(Guard::Desaturate(d)), None],
            (_, StageMode::Holding(d)) => [Some(Guard::LetGo(d)), Some(Guard::Overrun(d))],
            (_, StageMode::Overrun(d)) => [Some(Guard::Return(d)), None],
        };
        [a, b, c, d, e, f, g, h]
    }
}

impl Guard {
    /// The guard on the same surface in the mode that this one leads to; its
    /// value there is zero at first and must not be found again.
    pub(crate) fn opposite(self, next: &Mode) -> Self {
        let turned = |d: Direction| match d {
            Direction::Positive => Direction::Negative,
            Direction::Negative => Direction::Positive,
        };
        match self {
            Self::Meet(flank) => Self::Part(flank),
            Self::Part(flank) => Self::Meet(flank),
            Self::Release(flank) => Self::Reload(flank),
            Self::Reload(flank) => Self::Release(flank),
            Self::Break(direction) => Self::Stop(direction),
            // From sliding straight into the other direction, or on.
            Self::Stop(direction) => match (next.guide, direction) {
                (GuideMode::Backward, Direction::Positive)
                | (GuideMode::Forward, Direction::Negative) => Self::Stop(turned(direction)),
                _ => self,
            },
            Self::Limit(direction) => Self::Unlimit(direction),
            Self::Unlimit(direction) => Self::Limit(direction),
            Self::Saturate(direction) => Self::Desaturate(direction),
            Self::Desaturate(direction) => Self::Saturate(direction),
            // The current still stands at its limit.
            Self::LetGo(direction) => Self::Hold(direction),
            Self::Overrun(direction) => Self::Return(direction),
            Self::Hold(_) | Self::Return(_) => self,
        }
    }
}

/// A guard and its rate with the other sign.
fn negated((value, rate): (f64, f64)) -> (f64, f64) {
    (-value, -rate)
}

/// Rounding of γ̇ = β̇ − ε̇ \[rad/s\]: a screw that has
/// just begun to slide behind a running gear must not stop because of it. Nor
/// must one at the very start of a run, where both speeds are next to nothing.
pub(crate) fn speed_noise(y: &Vector) -> f64 {
    1e-15 + 4.0 * f64::EPSILON * y[BETA_DOT].abs()
}

impl Axis {
    /// Rounding of the torque of a flank \[N m\]: that of
    /// δ, and that of the current, which is what the voltage leaves of the
    /// induced one. A motor that runs up to the speed at which it carries no
    /// current must not let go of its load on the way because of it.
    pub(crate) fn release_noise_nm(&self, joint: ElasticJoint, y: &Vector) -> f64 {
        let (motor, z) = (&self.motor, self.gear_ratio);
        let km = motor.torque_constant_nm_per_a / z;
        // The torque of the current that the induced voltage alone would drive.
        let braking_nm = km * (km * y[BETA_DOT]).abs() / motor.resistance_ohm;
        let current_nm = if braking_nm.is_finite() {
            self.current_noise * braking_nm
        } else {
            0.0
        };
        joint.stiffness_nm_per_rad * self.parting_noise_rad + current_nm
    }

    /// A guard's value and its rate at one side of an instant, from the state and
    /// its derivative.
    pub(crate) fn guard(
        &self,
        guard: Guard,
        mode: &Mode,
        drive: &Drive<'_>,
        (time_s, side): (f64, Side),
        (y, dy): (&Vector, &Vector),
    ) -> (f64, f64) {
        let gap = |flank: Flank, b: f64| {
            let s = flank.sign();
            (s * y[EPSILON] - b, s * dy[EPSILON])
        };
        let torque = |joint: ElasticJoint, flank: Flank| {
            let s = flank.sign();
            (
                s * joint.flank_torque_nm(flank, y[EPSILON], y[EPSILON_DOT]),
                s * joint.flank_torque_rate(dy[EPSILON], dy[EPSILON_DOT]),
            )
        };
        let limit = |direction: Direction| match drive {
            // A held voltage has no limit left to reach.
            Drive::Held(_) => (1.0, 0.0),
            Drive::Feedback(pid) => {
                let (beta, beta_dot, beta_ddot) = (y[BETA], dy[BETA], dy[BETA_DOT]);
                let s = direction.sign();
                (
                    pid.limit() - s * demand(pid, time_s, y),
                    -s * pid.demand_rate(time_s, side, beta, beta_dot, beta_ddot),
                )
            }
        };
        let behind = |guard: Guard| {
            let command = self.command(mode, drive, time_s, y);
            let rates = [dy[BETA], dy[BETA_DOT]];
            let rate = self.command_rate(mode, drive, (time_s, side), y[BETA], rates);
            self.stage_guard(guard, (command, rate), (y, dy))
        };
        match (guard, self.joint) {
            (Guard::Meet(flank), Some(joint)) => negated(gap(flank, joint.backlash_half_rad)),
            (Guard::Part(flank), Some(joint)) => {
                let noise_rad = self.release_noise_nm(joint, y) / joint.stiffness_nm_per_rad;
                gap(flank, joint.backlash_half_rad - noise_rad)
            }
            (Guard::Release(flank), Some(joint)) => {
                let (value, rate) = torque(joint, flank);
                (value + self.release_noise_nm(joint, y), rate)
            }
            (Guard::Reload(flank), Some(joint)) => negated(torque(joint, flank)),
            (Guard::Stop(direction), _) => {
                let s = direction.sign();
                (speed_noise(y) + s * gamma_dot(y), s * gamma_dot(dy))
            }
            (Guard::Break(direction), _) => {
                let s = direction.sign();
                (
                    self.holding_torque_nm - s * self.driving_torque_nm(mode, y),
                    -s * self.moving_torque_rate(mode, dy),
                )
            }
            (Guard::Limit(direction), _) => limit(direction),
            (Guard::Unlimit(direction), _) => negated(limit(direction)),
            (
                Guard::Saturate(_)
                | Guard::Desaturate(_)
                | Guard::Hold(_)
                | Guard::LetGo(_)
                | Guard::Overrun(_)
                | Guard::Return(_),
                _,
            ) => behind(guard),
            // A rigid axis has no joint guards.
            (_, None) => (1.0, 0.0),
        }
    }

    /// True if an axis that rests on a flank without a load first moves away from it. Value
    /// and rate of the guard are nothing there: what comes first of an acceleration, a
    /// current and a command of the continuous law says so.
    pub(crate) fn leaves_from_rest(
        &self,
        guard: Guard,
        (drive, time_s): (&Drive<'_>, f64),
        (y, dy): (&Vector, &Vector),
    ) -> bool {
        let (Guard::Part(flank) | Guard::Release(flank)) = guard else {
            return false;
        };
        let s = flank.sign();
        let at_rest = s * y[EPSILON] == self.backlash_half_rad()
            && [EPSILON_DOT, BETA_DOT, CURRENT]
                .iter()
                .all(|&i| y[i] == 0.0);
        let first = match drive {
            _ if dy[EPSILON_DOT] != 0.0 => dy[EPSILON_DOT],
            Drive::Feedback(pid) if dy[CURRENT] == 0.0 => pid.first_direction(time_s),
            _ => dy[CURRENT],
        };
        at_rest && s * first < 0.0
    }

    /// The same of a guard behind the command, which comes with its rate.
    fn stage_guard(
        &self,
        guard: Guard,
        (command, command_rate): (f64, f64),
        (y, dy): (&Vector, &Vector),
    ) -> (f64, f64) {
        let (limit_v, limit_a, omega_radps) = self.stage.numbers();
        let demanded = |d: Direction| {
            let s = d.sign();
            let rate = self.loop_voltage_v(omega_radps, command_rate, dy);
            (
                s * self.loop_voltage_v(omega_radps, command, y) - limit_v,
                s * rate,
            )
        };
        let current = |d: Direction| (d.sign() * y[CURRENT] - limit_a, d.sign() * dy[CURRENT]);
        let (held_v, held_rate) = (self.holding_voltage_v(y), self.holding_voltage_v(dy));
        match guard {
            Guard::Saturate(d) => negated(demanded(d)),
            Guard::Desaturate(d) => demanded(d),
            Guard::Hold(d) => negated(current(d)),
            Guard::Return(d) => current(d),
            Guard::LetGo(d) => {
                let s = d.sign();
                (s * (command - held_v), s * (command_rate - held_rate))
            }
            Guard::Overrun(d) => (limit_v + d.sign() * held_v, d.sign() * held_rate),
            _ => (1.0, 0.0),
        }
    }

    /// The mode after `guard` has reached zero. Where the next mode starts on
    /// the same surface, the state is put exactly onto it.
    pub(crate) fn switch(&self, guard: Guard, mode: &Mode, y: &mut Vector) -> Mode {
        let mut next = *mode;
        let b = self.joint.map_or(0.0, |joint| joint.backlash_half_rad);
        match guard {
            Guard::Meet(flank) => {
                y[EPSILON] = flank.sign() * b;
                next.joint = JointMode::Loaded(flank);
            }
            // Not moved back by the parting noise: the torque of that last
            // stretch is nothing, the angle would add up.
            Guard::Part(_) => next.joint = JointMode::Open,
            Guard::Release(flank) => next.joint = JointMode::Released(flank),
            Guard::Reload(flank) => next.joint = JointMode::Loaded(flank),
            Guard::Stop(direction) => {
                // The screw rests; behind a joint the gear output keeps its speed.
                if self.joint.is_some() {
                    y[EPSILON_DOT] = y[BETA_DOT];
                } else {
                    y[BETA_DOT] = 0.0;
                }
                let torque_nm = direction.sign() * self.driving_torque_nm(mode, y);
                next.guide = match (torque_nm, direction) {
                    (t, _) if t.abs() <= self.holding_torque_nm => GuideMode::Stuck,
                    (t, Direction::Positive) if t < 0.0 => GuideMode::Backward,
                    (t, Direction::Negative) if t < 0.0 => GuideMode::Forward,
                    _ => mode.guide,
                };
            }
            Guard::Break(Direction::Positive) => next.guide = GuideMode::Forward,
            Guard::Break(Direction::Negative) => next.guide = GuideMode::Backward,
            Guard::Limit(Direction::Positive) => next.amplifier = AmplifierMode::AtUpper,
            Guard::Limit(Direction::Negative) => next.amplifier = AmplifierMode::AtLower,
            Guard::Unlimit(_) => next.amplifier = AmplifierMode::Linear,
            Guard::Saturate(d) => next.stage = StageMode::Saturated(d),
            Guard::Hold(d) | Guard::Return(d) => {
                y[CURRENT] = d.sign() * self.stage.numbers().1;
                next.stage = StageMode::Holding(d);
            }
            Guard::Overrun(d) => next.stage = StageMode::Overrun(d),
            Guard::Desaturate(_) | Guard::LetGo(_) => next.stage = StageMode::Follows,
        }
        next
    }
}
