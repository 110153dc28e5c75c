//! How far a quantity over one step may be from the cubic through its ends,
//! from how far the states may be ([`crate::stepped::dop853::Step::stray`]): the
//! quantities are sums of states, and so are these bounds. They decide whether
//! a step need be looked into at all ([`crate::numerics::septic::Ends::hull`]).

use crate::hybrid::mode::{Guard, Mode};
use crate::model::axis::{Axis, Drive};
use crate::model::joint::JointMode;
use crate::model::motion::Motion;
use crate::model::parameters::ElasticJoint;
use crate::model::resistance::GuideMode;
use crate::model::state::{
    BETA, BETA_DOT, BETA_INTEGRAL, CURRENT, EPSILON, EPSILON_DOT, Vector, gamma_dot,
};
use crate::stepped::dop853::Stray;

/// A step: its length, how far its states may be from the cubics through their
/// ends, and γ̇ as the one state that enters the equations squared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    length_s: f64,
    stray: Stray,
    /// Largest |γ̇|, and how much γ̇ moves \[rad/s\].
    speed: f64,
    swing: f64,
}

impl Reach {
    /// From the states and their derivatives at both ends.
    ///
    /// The cubic `y0 + Δ·θ + (u·(1 − θ) − v·θ)·θ·(1 − θ)` with `u = h·f0 − Δ`
    /// and `v = h·f1 − Δ` moves by at most |Δ| + (|u| + |v|)/4.
    pub(crate) fn new(
        stray: Stray,
        length_s: f64,
        (y0, y1): (&Vector, &Vector),
        (f0, f1): (&Vector, &Vector),
    ) -> Self {
        let start = gamma_dot(y0);
        let chord = gamma_dot(y1) - start;
        let bend = (gamma_dot(f0) * length_s - chord).abs();
        let twist = (gamma_dot(f1) * length_s - chord).abs();
        let swing = chord.abs() + 0.25 * (bend + twist) + stray.gamma_dot;
        Self {
            length_s,
            stray,
            speed: start.abs() + swing,
            swing,
        }
    }

    /// Of the armature current \[A\].
    pub(crate) fn current(&self) -> f64 {
        self.stray.states[CURRENT]
    }

    /// Of β for the motor, or of γ \[rad\].
    pub(crate) fn angle(&self, of_motor: bool) -> f64 {
        if of_motor {
            self.stray.states[BETA]
        } else {
            self.stray.gamma
        }
    }

    /// Of a command whose fourth derivative is at most this: the error of the
    /// cubic through two values and slopes is `|q⁗|·h⁴/384`.
    fn command(&self, fourth_derivative: f64) -> f64 {
        let square = self.length_s * self.length_s;
        fourth_derivative * square * square / 384.0
    }

    /// Of x_ref \[m\].
    pub(crate) fn displacement(&self, motion: &Motion) -> f64 {
        self.command(motion.fourth_derivatives().displacement_m)
    }

    /// `k·ε + c·ε̇` of a flank \[N m\].
    fn flank_torque(&self, joint: &ElasticJoint) -> f64 {
        joint.stiffness_nm_per_rad * self.stray.states[EPSILON]
            + joint.damping_nms_per_rad * self.stray.states[EPSILON_DOT]
    }
}

impl Axis {
    /// Of the value of a guard.
    pub(crate) fn guard_reach(&self, guard: Guard, drive: &Drive<'_>, reach: &Reach) -> f64 {
        match guard {
            Guard::Meet(_) | Guard::Part(_) => reach.stray.states[EPSILON],
            Guard::Release(_) | Guard::Reload(_) => {
                self.joint.map_or(0.0, |joint| reach.flank_torque(&joint))
            }
            // The margin of this guard is rounding, and so is how far it strays.
            Guard::Stop(_) => reach.stray.gamma_dot,
            Guard::Break(_) => self.torque_reach(reach, true),
            Guard::Limit(_) | Guard::Unlimit(_) => Self::demand_reach(drive, reach),
        }
    }

    /// Of `ẍ = p·γ̈` \[m/s²\]. With `γ̇ = γ̇0 + w` the square γ̇² differs from the
    /// cubic through its ends by what 2·γ̇0·w does, and by w² and its own cubic:
    /// at most `max w² + w1² + 8/27·|w1·ẇ1·h|`, which 8 swings² exceed.
    pub(crate) fn acceleration_reach(&self, mode: &Mode, reach: &Reach) -> f64 {
        if mode.guide == GuideMode::Stuck {
            return 0.0;
        }
        let loaded = !matches!(mode.joint, JointMode::Open | JointMode::Released(_));
        let [_, a1, a2] = self.resistance().polynomial(mode.guide);
        let speed = reach.stray.gamma_dot;
        let square = 2.0 * reach.speed * speed + 8.0 * reach.swing * reach.swing;
        let p = self.pitch_m_per_rad();
        let force = a1.abs() * speed + a2.abs() * square;
        p * (self.torque_reach(reach, loaded) + p * force) / self.moved_inertia()
    }

    /// Of what turns the screw, Ψ or `k_m·I/z` \[N m\].
    fn torque_reach(&self, reach: &Reach, loaded: bool) -> f64 {
        match self.joint {
            Some(joint) if loaded => reach.flank_torque(&joint),
            Some(_) => 0.0,
            None => (self.motor().torque_nm(reach.current()) / self.gear_ratio()).abs(),
        }
    }

    /// Of the continuous law's demand, eq. 27-28 \[V\].
    pub(crate) fn demand_reach(drive: &Drive<'_>, reach: &Reach) -> f64 {
        match drive {
            Drive::Held(_) => 0.0,
            Drive::Feedback(pid) => {
                let command = pid.motion().fourth_derivatives();
                pid.demand_reach(
                    reach.stray.states[BETA_INTEGRAL],
                    reach.stray.states[BETA],
                    reach.stray.states[BETA_DOT],
                    [
                        reach.command(command.displacement_integral_ms),
                        reach.command(command.displacement_m),
                        reach.command(command.velocity_mps),
                    ],
                )
            }
        }
    }
}
