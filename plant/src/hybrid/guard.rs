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
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::direction::Direction;
use crate::model::joint::{ElasticJoint, JointMode};
use crate::model::pid::Side;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT, Vector, gamma_dot};

/// Reasons for which a mode ends, with the flank or direction; s is its sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Guard {
    /// `b − s·ε`: the gap closes on a flank.
    Meet(Direction),
    /// `s·ε − b`: the flank comes away.
    Part(Direction),
    /// `s·Ψ`: the flank would have to pull.
    Release(Direction),
    /// `−s·Ψ` of the released flank: it would push again.
    Reload(Direction),
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
        let both = |guard: fn(Direction) -> Guard| Direction::BOTH.map(|d| Some(guard(d)));
        let none = [None, None];
        let [a, b] = match self.joint {
            JointMode::Rigid | JointMode::Gapless => none,
            JointMode::Open => both(Guard::Meet),
            JointMode::Loaded(flank) if releases => [Some(Guard::Release(flank)), None],
            JointMode::Loaded(flank) => [Some(Guard::Part(flank)), None],
            JointMode::Released(flank) => [Some(Guard::Part(flank)), Some(Guard::Reload(flank))],
        };
        let [c, d] = match self.guide {
            GuideMode::AsWritten => none,
            GuideMode::Slides(d) => [Some(Guard::Stop(d)), None],
            GuideMode::Stuck => both(Guard::Break),
        };
        let [e, f] = match self.amplifier {
            _ if !feedback => none,
            AmplifierMode::Linear => both(Guard::Limit),
            AmplifierMode::AtLimit(d) => [Some(Guard::Unlimit(d)), None],
        };
        let [g, h] = match (stage, self.stage) {
            (Stage::Voltage | Stage::IdealCurrent, _) => none,
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
        match self {
            Self::Meet(d) => Self::Part(d),
            Self::Part(d) => Self::Meet(d),
            Self::Release(d) => Self::Reload(d),
            Self::Reload(d) => Self::Release(d),
            Self::Break(d) => Self::Stop(d),
            // From sliding straight into the other direction, or on.
            Self::Stop(d) if next.guide == GuideMode::Slides(d.turned()) => Self::Stop(d.turned()),
            Self::Limit(d) => Self::Unlimit(d),
            Self::Unlimit(d) => Self::Limit(d),
            Self::Saturate(d) => Self::Desaturate(d),
            Self::Desaturate(d) => Self::Saturate(d),
            // The current still stands at its limit.
            Self::LetGo(d) => Self::Hold(d),
            Self::Overrun(d) => Self::Return(d),
            Self::Stop(_) | Self::Hold(_) | Self::Return(_) => self,
        }
    }
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
        now: (f64, Side),
        (y, dy): (&Vector, &Vector),
    ) -> (f64, f64) {
        // `s·q − limit` and its rate, and the same with the other sign.
        let beyond = |d: Direction, (q, rate): (f64, f64), limit: f64| {
            (d.sign() * q - limit, d.sign() * rate)
        };
        let within = |d, q, limit| {
            let (value, rate) = beyond(d, q, limit);
            (-value, -rate)
        };
        // No mode without a joint has guards of one.
        let joint = self.joint.unwrap_or_default();
        let b = joint.backlash_half_rad;
        let epsilon = (y[EPSILON], dy[EPSILON]);
        let torque = |flank| {
            let torque_nm = joint.flank_torque_nm(flank, y[EPSILON], y[EPSILON_DOT]);
            let rate = joint.flank_torque_rate(dy[EPSILON], dy[EPSILON_DOT]);
            (torque_nm, rate)
        };
        let (limit_v, limit_a, omega_radps) = self.stage.numbers();
        let command = || {
            let rates = [dy[BETA], dy[BETA_DOT]];
            let rate = self.command_rate(mode, drive, now, y[BETA], rates);
            (self.command(mode, drive, now.0, y), rate)
        };
        let loop_voltage = || {
            let (command, rate) = command();
            (
                self.loop_voltage_v(omega_radps, command, y),
                self.loop_voltage_v(omega_radps, rate, dy),
            )
        };
        let held = || (self.holding_voltage_v(y), self.holding_voltage_v(dy));
        let current = (y[CURRENT], dy[CURRENT]);
        match guard {
            Guard::Meet(d) => within(d, epsilon, b),
            Guard::Part(d) => {
                let noise_rad = self.release_noise_nm(joint, y) / joint.stiffness_nm_per_rad;
                beyond(d, epsilon, b - noise_rad)
            }
            Guard::Release(d) => beyond(d, torque(d), -self.release_noise_nm(joint, y)),
            Guard::Reload(d) => within(d, torque(d), 0.0),
            Guard::Stop(d) => beyond(d, (gamma_dot(y), gamma_dot(dy)), -speed_noise(y)),
            Guard::Break(d) => {
                let rate = self.moving_torque_rate(mode, dy);
                let torque = (self.driving_torque_nm(mode, y), rate);
                within(d, torque, self.holding_torque_nm)
            }
            Guard::Limit(d) | Guard::Unlimit(d) => {
                let Drive::Feedback(pid) = drive else {
                    // A held voltage has no limit left to reach.
                    return (1.0, 0.0);
                };
                let rate = pid.demand_rate(now.0, now.1, y[BETA], dy[BETA], dy[BETA_DOT]);
                let demand = (pid.demand(now.0, y), rate);
                match guard {
                    Guard::Limit(_) => within(d, demand, pid.limit()),
                    _ => beyond(d, demand, pid.limit()),
                }
            }
            Guard::Saturate(d) => within(d, loop_voltage(), limit_v),
            Guard::Desaturate(d) => beyond(d, loop_voltage(), limit_v),
            Guard::Hold(d) => within(d, current, limit_a),
            Guard::Return(d) => beyond(d, current, limit_a),
            Guard::LetGo(d) => {
                let ((command, rate), (held_v, held_rate)) = (command(), held());
                beyond(d, (command - held_v, rate - held_rate), 0.0)
            }
            Guard::Overrun(d) => beyond(d, held(), -limit_v),
        }
    }

    /// The guard's flank if an axis that rests on it without a load first moves away from it.
    /// Value and rate of the guard are nothing there: what comes first of an acceleration, a
    /// current and a command of the continuous law says so.
    pub(crate) fn leaves_from_rest(
        &self,
        guard: Guard,
        (drive, time_s): (&Drive<'_>, f64),
        (y, dy): (&Vector, &Vector),
    ) -> Option<Direction> {
        let (Guard::Part(flank) | Guard::Release(flank)) = guard else {
            return None;
        };
        let at_rest = flank.sign() * y[EPSILON] == self.backlash_half_rad()
            && [EPSILON_DOT, BETA_DOT, CURRENT].map(|i| y[i]) == [0.0; 3];
        let first = match drive {
            _ if dy[EPSILON_DOT] != 0.0 => dy[EPSILON_DOT],
            Drive::Feedback(pid) if dy[CURRENT] == 0.0 => pid.first_direction(time_s),
            _ => dy[CURRENT],
        };
        (at_rest && flank.sign() * first < 0.0).then_some(flank)
    }

    /// The mode after `guard` has reached zero. Where the next mode starts on
    /// the same surface, the state is put exactly onto it.
    pub(crate) fn switch(&self, guard: Guard, mode: &Mode, y: &mut Vector) -> Mode {
        let mut next = *mode;
        match guard {
            Guard::Meet(flank) => {
                y[EPSILON] = flank.sign() * self.backlash_half_rad();
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
                if torque_nm.abs() <= self.holding_torque_nm {
                    next.guide = GuideMode::Stuck;
                } else if torque_nm < 0.0 {
                    next.guide = GuideMode::Slides(direction.turned());
                }
            }
            Guard::Break(d) => next.guide = GuideMode::Slides(d),
            Guard::Limit(d) => next.amplifier = AmplifierMode::AtLimit(d),
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
