//! The equations of the axis in one mode with their constants worked out: what
//! a solver that evaluates them a hundred thousand times a second of simulated
//! time calls, [`Axis::derivative`] without its case distinctions and
//! divisions.

use crate::model::amplifier::Stage;
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::pid::Side;
use crate::model::resistance::GuideMode;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT, Vector, gamma_dot};

/// `dy/dt` in one mode and under one drive.
///
/// ```text
/// Ψ  = k·(ε − ε_0) + c·ε̇                              eq. 8-10
/// γ̈ = (Ψ + m·I)/J2 − (f0 + f1·γ̇ + f2·γ̇²)             eq. 13, 15; m only when rigid: eq. 19
/// β̈ = (k_m/z·I − Ψ)/J1, without a joint γ̈             eq. 11, 15
/// İ  = V/L − R/L·I − k_m/(z·L)·β̇
/// ```
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rates<'a> {
    axis: &'a Axis,
    drive: &'a Drive<'a>,
    mode: Mode,
    start_s: f64,
    stiffness: f64,
    damping: f64,
    rest_rad: f64,
    screw_per_torque: f64,
    screw_per_current: f64,
    resistance: [f64; 3],
    gear_per_torque: f64,
    gear_per_current: f64,
    /// 1 without a joint, where β̈ is γ̈; 0 with one.
    rigid: f64,
    current_per_voltage: f64,
    current_per_current: f64,
    current_per_speed: f64,
}

impl<'a> Rates<'a> {
    /// For a step that starts at `start_s`.
    pub(crate) fn new(axis: &'a Axis, mode: &Mode, drive: &'a Drive<'a>, start_s: f64) -> Self {
        let (z, motor) = (axis.gear_ratio, &axis.motor);
        let (km, l) = (motor.torque_constant_nm_per_a, motor.inductance_h);
        let joint = axis.joint.unwrap_or_default();
        let carried = |number: f64| if mode.joint.carries() { number } else { 0.0 };
        let stuck = mode.guide == GuideMode::Stuck;
        let moves = if stuck { 0.0 } else { 1.0 };
        let screw_per_torque = moves / axis.moved_inertia();
        let [a0, a1, a2] = axis.resistance.polynomial(mode.guide);
        let resistance =
            [a0 + axis.load_force_n, a1, a2].map(|a| screw_per_torque * axis.pitch_m_per_rad * a);
        let rigid = if axis.joint.is_none() { 1.0 } else { 0.0 };
        let joined = 1.0 - rigid;
        Self {
            axis,
            drive,
            mode: *mode,
            start_s,
            stiffness: carried(joint.stiffness_nm_per_rad),
            damping: carried(joint.damping_nms_per_rad),
            rest_rad: joint.rest_rad(mode.joint).unwrap_or(0.0),
            screw_per_torque,
            screw_per_current: rigid * screw_per_torque * km / z,
            resistance,
            gear_per_torque: joined / axis.gear_inertia,
            gear_per_current: joined * km / (z * axis.gear_inertia),
            rigid,
            current_per_voltage: 1.0 / l,
            current_per_current: motor.resistance_ohm / l,
            current_per_speed: km / (z * l),
        }
    }

    /// Noise that the rounding of ε makes of β̈ and ε̈: a stiff joint turns the last
    /// bit of an angle into a torque.
    #[inline(always)]
    pub(crate) fn noise(&self, y: &Vector) -> Vector {
        let torque_nm = f64::EPSILON * self.stiffness * y[EPSILON].abs();
        let mut noise = Vector::zeros();
        noise[BETA_DOT] = self.gear_per_torque * torque_nm;
        noise[EPSILON_DOT] = (self.gear_per_torque + self.screw_per_torque) * torque_nm;
        noise
    }

    /// `dy/dt` at one instant.
    #[inline(always)]
    pub(crate) fn at(&self, time_s: f64, y: &Vector) -> Vector {
        let (beta_dot, epsilon_dot, current) = (y[BETA_DOT], y[EPSILON_DOT], y[CURRENT]);
        let gamma_dot = gamma_dot(y);
        let psi = self.stiffness * (y[EPSILON] - self.rest_rad) + self.damping * epsilon_dot;
        let [f0, f1, f2] = self.resistance;
        let gamma_ddot = (self.screw_per_torque * psi + self.screw_per_current * current)
            - (f0 + (f1 + f2 * gamma_dot) * gamma_dot);
        let beta_ddot = (self.gear_per_current * current - self.gear_per_torque * psi)
            + self.rigid * gamma_ddot;
        let command = self.axis.command(&self.mode, self.drive, time_s, y);
        let [current_rate, current_integral_rate] = match self.axis.stage {
            Stage::Voltage => {
                let current_rate = (self.current_per_voltage * command
                    - self.current_per_current * current)
                    - self.current_per_speed * beta_dot;
                [current_rate, 0.0]
            }
            _ => self.behind_stage(time_s, command, y, beta_ddot),
        };
        Vector::from([
            beta_dot,
            beta_ddot,
            epsilon_dot,
            beta_ddot - gamma_ddot,
            current_rate,
            self.drive.beta_integral_rate(y),
            current_integral_rate,
        ])
    }

    /// İ and q̇ of any but the paper's amplifier. Where the command's acceleration jumps, a
    /// step ends or starts.
    fn behind_stage(&self, time_s: f64, command: f64, y: &Vector, beta_ddot: f64) -> [f64; 2] {
        let side = match time_s > self.start_s {
            true => Side::Before,
            false => Side::After,
        };
        let (axis, drive, mode) = (self.axis, self.drive, &self.mode);
        let (now, rates) = ((time_s, side), [y[BETA_DOT], beta_ddot]);
        let command_rate = || axis.command_rate(mode, drive, now, y[BETA], rates);
        axis.stage_rates(mode.stage, command, command_rate, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::tests::of_the_paper;
    use crate::model::direction::Direction;
    use crate::model::joint::JointMode;
    use crate::model::surroundings::Surroundings;
    use crate::{ElasticJoint, Joint, Resistance};

    fn axis(joint: Joint) -> Axis {
        let mut axis = of_the_paper(joint);
        axis.transmission.screw_pitch_m_per_rad = 8e-4;
        axis.carriage.resistance = Resistance {
            constant_n: 20.0,
            linear_ns_per_rad: 0.3,
            quadratic_ns2_per_rad2: 0.01,
            opposes_motion: true,
        };
        let mut axis = Axis::new(&axis, &Surroundings::default(), 1e-11);
        axis.load_force_n = 7.0;
        axis
    }

    /// In every mode the same numbers as the equations of [`Axis`].
    #[test]
    fn agrees_with_the_equations_in_every_mode() {
        let elastic = Joint::Elastic(ElasticJoint {
            stiffness_nm_per_rad: 350.0,
            damping_nms_per_rad: 0.2,
            backlash_half_rad: 0.05,
            no_pull: true,
        });
        let joints = [
            (Joint::Rigid, JointMode::Rigid),
            (elastic, JointMode::Gapless),
            (elastic, JointMode::Open),
            (elastic, JointMode::Loaded(Direction::Positive)),
            (elastic, JointMode::Loaded(Direction::Negative)),
            (elastic, JointMode::Released(Direction::Positive)),
        ];
        let [forward, backward] = Direction::BOTH.map(GuideMode::Slides);
        let guides = [GuideMode::AsWritten, forward, backward, GuideMode::Stuck];
        let y = Vector::from([3.0, 20.0, 0.06, -1.5, 4.0, 2.0, 0.5]);
        let drive = Drive::Held(12.0);
        for (joint, joint_mode) in joints {
            let axis = axis(joint);
            for guide in guides {
                let mode = Mode {
                    joint: joint_mode,
                    guide,
                    ..axis.mode_at_rest()
                };
                let expected = axis.derivative(&mode, &drive, (0.1, Side::After), &y);
                let rates = Rates::new(&axis, &mode, &drive, 0.1).at(0.1, &y);
                for (rate, expected) in rates.iter().zip(expected.iter()) {
                    let off = (rate - expected).abs();
                    assert!(off <= 1e-13 * expected.abs(), "{mode:?} {rate} {expected}");
                }
            }
        }
    }
}
