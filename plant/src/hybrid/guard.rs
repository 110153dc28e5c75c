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
//! amplifier  Linear ◄──|V| = V_max──► AtLimit            (continuous law only)
//! ```

use crate::model::amplifier::AmplifierMode;
use crate::model::axis::{Axis, Drive, Mode, demand_v};
use crate::model::joint::{ElasticJoint, Flank, JointMode};
use crate::model::pid::Side;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, EPSILON, EPSILON_DOT, Vector, gamma_dot};

/// Direction of motion, torque or voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Positive,
    Negative,
}

impl Direction {
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
}

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
    /// `p·a0 − s·τ`: dry friction gives way.
    Break(Direction),
    /// `V_max − s·V`: the demand reaches the limit.
    Limit(Direction),
    /// `s·V − V_max`: the demand comes back from the limit.
    Unlimit(Direction),
}

/// The guards of a mode: at most two each for joint, guide and amplifier.
pub(crate) type Guards = [Option<Guard>; 6];

impl Mode {
    /// The guards of this mode. `releases` says whether a loaded flank lets
    /// go where it would pull, `feedback` whether the voltage follows the
    /// continuous law.
    pub(crate) fn guards(&self, releases: bool, feedback: bool) -> Guards {
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
        [a, b, c, d, e, f]
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
                    pid.voltage_limit_v() - s * demand_v(pid, time_s, y),
                    -s * pid.demand_rate(time_s, side, beta, beta_dot, beta_ddot),
                )
            }
        };
        let negated = |(value, rate): (f64, f64)| (-value, -rate);
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
                    self.holding_torque_nm - s * self.moving_torque_nm(mode, y),
                    -s * self.moving_torque_rate(mode, dy),
                )
            }
            (Guard::Limit(direction), _) => limit(direction),
            (Guard::Unlimit(direction), _) => negated(limit(direction)),
            // A rigid axis has no joint guards.
            (_, None) => (1.0, 0.0),
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
                let torque_nm = direction.sign() * self.moving_torque_nm(mode, y);
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
        }
        next
    }
}
