//! The parts put together: the only place that knows them all (paper,
//! eq. 11, 14-15, 19, 32-37).
//!
//! ```text
//! J1·β̈ = k_m·I/z − Ψ        J1 = J_m/z²
//! J2·γ̈ = Ψ − p·F_r(γ̇)       J2 = J_v + M·p²
//! L·İ  = V − R·I − k_m·β̇/z
//! ```
//!
//! Loads on the carriage add to F_r. β is counted from where it stands at the start, so
//! that the encoder's zero is that of β; γ is `β + β(0) − ε`.

use crate::model::amplifier::{AmplifierMode, Stage, StageMode};
use crate::model::direction::Direction;
use crate::model::joint::{ElasticJoint, JointMode, Transmission};
use crate::model::motor::Motor;
use crate::model::pid::{ContinuousPid, Side};
use crate::model::resistance::{Carriage, GuideMode, Resistance};
use crate::model::state::{
    BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT, State, Vector, gamma, gamma_dot,
};
use crate::model::surroundings::Surroundings;

/// Motor, transmission and carriage: everything that moves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisParameters {
    /// The motor.
    pub motor: Motor,
    /// Gear, joint and screw.
    pub transmission: Transmission,
    /// Carriage and guide.
    pub carriage: Carriage,
}

impl AxisParameters {
    /// True if the plant is affine between events: no quadratic resistance.
    pub fn is_affine(&self) -> bool {
        self.carriage.resistance.quadratic_ns2_per_rad2 == 0.0
    }
}

/// Source of the amplifier's command: a voltage \[V\], or of a current drive a current
/// \[A\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive<'a> {
    /// Constant, already within the amplifier's limit: a sampled law.
    Held(f64),
    /// The continuous law, behind the amplifier's limit; its transmission is the axis'.
    Feedback(&'a ContinuousPid),
}

impl Drive<'_> {
    /// Rate of β̂, which is the continuous law's memory; a held command has none.
    #[inline]
    pub(crate) fn beta_integral_rate(&self, y: &Vector) -> f64 {
        match self {
            Self::Held(_) => 0.0,
            Self::Feedback(_) => y[BETA],
        }
    }
}

/// Everything that selects the equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Mode {
    pub(crate) joint: JointMode,
    pub(crate) guide: GuideMode,
    pub(crate) amplifier: AmplifierMode,
    pub(crate) stage: StageMode,
}

impl Mode {
    /// The same with a joint that has a gap in contact with the flank of this sign, or
    /// open at 0.
    pub(crate) fn with_contact(mut self, sign: f64) -> Self {
        if matches!(self.joint, JointMode::Open | JointMode::Loaded(_)) {
            self.joint = match sign {
                0.0 => JointMode::Open,
                _ => JointMode::Loaded(Direction::of(sign)),
            };
        }
        self
    }
}

/// The axis with what its equations need over and over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axis {
    pub(crate) motor: Motor,
    pub(crate) gear_ratio: f64,
    pub(crate) pitch_m_per_rad: f64,
    pub(crate) resistance: Resistance,
    /// `J1 = J_m/z²` \[kg m²\].
    pub(crate) gear_inertia: f64,
    /// `J2 = J_v + M·p²` \[kg m²\].
    pub(crate) screw_inertia: f64,
    /// `p/J`, with the inertia that the torque on the screw moves \[m/(kg m²)\].
    pub(crate) pitch_per_inertia: f64,
    /// `p·a0`, the torque that dry friction can hold at the screw \[N m\].
    pub(crate) holding_torque_nm: f64,
    pub(crate) joint: Option<ElasticJoint>,
    pub(crate) stage: Stage,
    /// Force of the loads that act now, besides the resistance \[N\].
    pub(crate) load_force_n: f64,
    /// `β(0)`, from which β is counted \[rad\].
    pub(crate) start_rad: f64,
    /// Angle below b to which a loaded flank must fall to have come away \[rad\].
    ///
    /// A torque that dies away (the axis cruises, or rests on dry friction)
    /// leaves ε at b to within rounding and the solver's error, and neither may
    /// make contacts: without a margin such runs reported hundreds of changes,
    /// or never ended. A real separation is shifted by this angle over its
    /// speed, far below what is asked of the time of an event.
    pub(crate) parting_noise_rad: f64,
    /// Error of the current, in units of what the induced voltage
    /// alone would drive.
    pub(crate) current_noise: f64,
}

/// Share of the tolerance that the error of ε reaches at rest, and units in
/// the last place of b for its rounding: above what was seen.
const NOISE_PER_TOLERANCE: f64 = 0.001;
pub(crate) const NOISE_PER_BACKLASH: f64 = 16.0 * f64::EPSILON;

impl Axis {
    /// `tolerance` is the error of ε that the solver allows itself \[rad\].
    pub(crate) fn new(
        parameters: &AxisParameters,
        surroundings: &Surroundings,
        tolerance: f64,
    ) -> Self {
        let (t, c) = (&parameters.transmission, &parameters.carriage);
        let (z, p) = (t.gear_ratio, t.screw_pitch_m_per_rad);
        let joint = t.joint.elastic();
        let gear_inertia = parameters.motor.inertia_kg_m2 / (z * z);
        let screw_inertia = t.screw_inertia_kg_m2 + c.mass_kg * p * p;
        let mut axis = Self {
            motor: parameters.motor,
            gear_ratio: z,
            pitch_m_per_rad: p,
            resistance: c.resistance,
            gear_inertia,
            screw_inertia,
            pitch_per_inertia: 0.0,
            holding_torque_nm: p * c.resistance.constant_n,
            joint,
            stage: surroundings.amplifier.stage(),
            load_force_n: surroundings.force_at_n(0),
            start_rad: surroundings.start.beta_rad(t),
            parting_noise_rad: NOISE_PER_TOLERANCE * tolerance
                + NOISE_PER_BACKLASH * joint.map_or(0.0, |joint| joint.backlash_half_rad),
            // The margin of a solver with a tolerance is that.
            current_noise: 0.0,
        };
        axis.pitch_per_inertia = p / axis.moved_inertia();
        axis
    }

    /// The same axis with another b, on a flank of which it starts; a rigid one is as it was.
    pub(crate) fn with_backlash(
        mut self,
        backlash_half_rad: f64,
        flank: Option<Direction>,
    ) -> Self {
        if let Some(joint) = &mut self.joint {
            joint.backlash_half_rad = backlash_half_rad;
        }
        self.start_rad = flank.map_or(0.0, |flank| flank.sign() * backlash_half_rad);
        self.set_parting_noise(0.0, f64::INFINITY);
        self
    }

    /// b, 0 without a joint \[rad\].
    pub(crate) fn backlash_half_rad(&self) -> f64 {
        self.joint.map_or(0.0, |joint| joint.backlash_half_rad)
    }

    /// Sets the margins of steps of `length_s`: the rounding of b and `noise_rad`
    /// more; and that of the speed, which stops short of where it settles once
    /// its change in a step is less than rounding, `τ_m/T` roundings away.
    pub(crate) fn set_parting_noise(&mut self, noise_rad: f64, length_s: f64) {
        self.parting_noise_rad = noise_rad + NOISE_PER_BACKLASH * self.backlash_half_rad();
        let motor = &self.motor;
        let km = motor.torque_constant_nm_per_a / self.gear_ratio;
        // τ_m = J·R/k_m², the time that the motor takes to run up.
        let inertia = self.gear_inertia + self.moved_inertia();
        let run_up_s = inertia * motor.resistance_ohm / (km * km);
        let steps = run_up_s / length_s;
        self.current_noise = if steps.is_finite() {
            4.0 * f64::EPSILON * steps.max(1.0)
        } else {
            0.0
        };
    }

    /// The state as it is seen from outside.
    pub(crate) fn state(&self, y: &Vector) -> State {
        let mut state = State::from_vector(y);
        state.beta_rad += self.start_rad;
        state
    }

    /// True if a loaded flank lets go where it would pull.
    pub(crate) fn releases(&self) -> bool {
        self.joint.is_some_and(|joint| joint.releases())
    }

    /// At rest with the joint centred in its gap.
    pub(crate) fn mode_at_rest(&self) -> Mode {
        let joint = self.joint.map(|joint| joint.mode_of_state(0.0, 0.0));
        Mode {
            joint: joint.unwrap_or(JointMode::Rigid),
            guide: self.resistance.mode_at_rest(),
            amplifier: AmplifierMode::Linear,
            stage: StageMode::Follows,
        }
    }

    /// The mode that the state alone suggests.
    pub(crate) fn mode_of_state(&self, drive: &Drive<'_>, time_s: f64, y: &Vector) -> Mode {
        let mut mode = self.mode_at_rest();
        if let Some(joint) = self.joint {
            mode.joint = joint.mode_of_state(y[EPSILON], y[EPSILON_DOT]);
        }
        mode.guide = self.resistance.mode_of_state(
            gamma_dot(y),
            self.driving_torque_nm(&mode, y),
            self.holding_torque_nm,
        );
        if let Drive::Feedback(pid) = drive {
            let demand = pid.demand(time_s, y);
            if demand.abs() >= pid.limit() {
                mode.amplifier = AmplifierMode::AtLimit(Direction::of(demand));
            }
        }
        if !self.stage.is_papers() {
            mode.stage = self.stage_of_state(self.command(&mode, drive, time_s, y), y);
        }
        mode
    }

    /// The amplifier's command \[V, or A with a current drive\].
    pub(crate) fn command(&self, mode: &Mode, drive: &Drive<'_>, time_s: f64, y: &Vector) -> f64 {
        match (drive, mode.amplifier) {
            (Drive::Held(command), _) => *command,
            (Drive::Feedback(pid), AmplifierMode::Linear) => pid.demand(time_s, y),
            (Drive::Feedback(pid), AmplifierMode::AtLimit(d)) => d.sign() * pid.limit(),
        }
    }

    /// Its rate.
    pub(crate) fn command_rate(
        &self,
        mode: &Mode,
        drive: &Drive<'_>,
        (time_s, side): (f64, Side),
        beta: f64,
        [beta_dot, beta_ddot]: [f64; 2],
    ) -> f64 {
        match (drive, mode.amplifier) {
            (Drive::Feedback(pid), AmplifierMode::Linear) => {
                pid.demand_rate(time_s, side, beta, beta_dot, beta_ddot)
            }
            _ => 0.0,
        }
    }

    /// Motor voltage `V_m` \[V\].
    pub(crate) fn voltage_v(&self, mode: &Mode, drive: &Drive<'_>, time_s: f64, y: &Vector) -> f64 {
        let command = self.command(mode, drive, time_s, y);
        self.stage_voltage_v(mode.stage, command, y)
    }

    /// `dy/dt`, eq. 34 and 37 in the state of [`crate::State`].
    pub(crate) fn derivative(
        &self,
        mode: &Mode,
        drive: &Drive<'_>,
        now: (f64, Side),
        y: &Vector,
    ) -> Vector {
        let (beta_dot, gamma_ddot) = (y[BETA_DOT], self.screw_acceleration(mode, y));
        let beta_ddot = match self.joint {
            None => gamma_ddot,
            // β̈ = (k_m·I/z − Ψ)/J1, eq. 11 and 15.
            Some(joint) => {
                let psi = joint.torque_nm(mode.joint, y[EPSILON], y[EPSILON_DOT]);
                let motor_nm = self.motor.torque_nm(y[CURRENT]) / self.gear_ratio;
                (motor_nm - psi) / self.gear_inertia
            }
        };
        let command = self.command(mode, drive, now.0, y);
        let command_rate = || self.command_rate(mode, drive, now, y[BETA], [beta_dot, beta_ddot]);
        let [current_rate, current_integral_rate] =
            self.stage_rates(mode.stage, command, command_rate, y);
        Vector::from([
            beta_dot,
            beta_ddot,
            y[EPSILON_DOT],
            beta_ddot - gamma_ddot,
            current_rate,
            drive.beta_integral_rate(y),
            current_integral_rate,
        ])
    }

    /// `γ̈` \[rad/s²\]: eq. 15 with a joint, eq. 19 without, 0 while stuck.
    pub(crate) fn screw_acceleration(&self, mode: &Mode, y: &Vector) -> f64 {
        self.accelerating_torque_nm(mode, y) / self.moved_inertia()
    }

    /// Torque that turns the screw less what resistance and loads take of it \[N m\].
    fn accelerating_torque_nm(&self, mode: &Mode, y: &Vector) -> f64 {
        if mode.guide == GuideMode::Stuck {
            return 0.0;
        }
        let force_n = self.resistance.force_n(mode.guide, gamma_dot(y)) + self.load_force_n;
        self.moving_torque_nm(mode, y) - self.pitch_m_per_rad * force_n
    }

    /// `d³γ/dt³` \[rad/s³\] from the state and its derivative.
    pub(crate) fn screw_jerk(&self, mode: &Mode, y: &Vector, dy: &Vector) -> f64 {
        if mode.guide == GuideMode::Stuck {
            return 0.0;
        }
        let [_, a1, a2] = self.resistance.polynomial(mode.guide);
        let force_rate = (2.0 * a2 * gamma_dot(y) + a1) * gamma_dot(dy);
        (self.moving_torque_rate(mode, dy) - self.pitch_m_per_rad * force_rate)
            / self.moved_inertia()
    }

    /// Torque that turns the screw: Ψ, or `k_m·I/z` without a joint \[N m\].
    pub(crate) fn moving_torque_nm(&self, mode: &Mode, y: &Vector) -> f64 {
        match self.joint {
            None => self.motor.torque_nm(y[CURRENT]) / self.gear_ratio,
            Some(joint) => joint.torque_nm(mode.joint, y[EPSILON], y[EPSILON_DOT]),
        }
    }

    /// The same less that of the loads: what dry friction opposes \[N m\].
    pub(crate) fn driving_torque_nm(&self, mode: &Mode, y: &Vector) -> f64 {
        self.moving_torque_nm(mode, y) - self.load_torque_nm()
    }

    /// `p·F_load` \[N m\].
    pub(crate) fn load_torque_nm(&self) -> f64 {
        self.pitch_m_per_rad * self.load_force_n
    }

    /// Screw angle γ \[rad\].
    pub(crate) fn screw_angle_rad(&self, y: &Vector) -> f64 {
        gamma(y) + self.start_rad
    }

    pub(crate) fn moving_torque_rate(&self, mode: &Mode, dy: &Vector) -> f64 {
        match self.joint {
            None => self.motor.torque_nm(dy[CURRENT]) / self.gear_ratio,
            Some(joint) if mode.joint.carries() => {
                joint.flank_torque_rate(dy[EPSILON], dy[EPSILON_DOT])
            }
            Some(_) => 0.0,
        }
    }

    /// J2, or `J_eq = J_v + J_m/z² + M·p²` without a joint (eq. 19).
    pub(crate) fn moved_inertia(&self) -> f64 {
        match self.joint {
            None => self.screw_inertia + self.gear_inertia,
            Some(_) => self.screw_inertia,
        }
    }

    /// `ẍ = p·γ̈` \[m/s²\].
    pub(crate) fn carriage_acceleration_mps2(&self, mode: &Mode, y: &Vector) -> f64 {
        self.accelerating_torque_nm(mode, y) * self.pitch_per_inertia
    }

    /// Kinetic energy and the energy stored in the joint, eq. 4-5 \[J\].
    pub(crate) fn mechanical_energy_j(&self, state: &State) -> f64 {
        let (w1, w2) = (state.beta_dot_radps, state.gamma_dot_radps());
        0.5 * self.gear_inertia * w1 * w1
            + 0.5 * self.screw_inertia * w2 * w2
            + self
                .joint
                .map_or(0.0, |j| j.stored_energy_j(state.epsilon_rad))
    }

    /// Energy that a state holds within a mode \[J\], that of the armature's field included:
    /// a joint that was let go has lost its own, and an ideal current loop knows no
    /// inductance.
    pub(crate) fn stored_energy_j(&self, mode: &Mode, y: &Vector) -> f64 {
        let (w1, w2, current) = (y[BETA_DOT], gamma_dot(y), y[CURRENT]);
        let joint = self.joint.filter(|_| mode.joint.carries());
        let field_h = match self.stage {
            Stage::IdealCurrent => 0.0,
            _ => self.motor.inductance_h,
        };
        (0.5 * self.gear_inertia * w1 * w1 + 0.5 * self.screw_inertia * w2 * w2)
            + (joint.map_or(0.0, |j| j.stored_energy_j(y[EPSILON]))
                + 0.5 * field_h * current * current)
    }
}
