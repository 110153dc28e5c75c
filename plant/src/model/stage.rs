//! The amplifier behind its command, on the motor of the axis: the voltage in each of its
//! modes, and what becomes of the current ([`super::amplifier`] has the equations).

use super::amplifier::{Stage, StageMode};
use super::axis::Axis;
use super::direction::Direction;
use super::state::{BETA_DOT, CURRENT, CURRENT_INTEGRAL, Vector};

impl Axis {
    /// `R·I + k_m·β̇/z`: the voltage at which the current stays, or its rate from that of
    /// the state \[V\].
    pub(crate) fn holding_voltage_v(&self, y: &Vector) -> f64 {
        let motor = &self.motor;
        let induced = motor.torque_constant_nm_per_a * (y[BETA_DOT] / self.gear_ratio);
        motor.resistance_ohm * y[CURRENT] + induced
    }

    /// u of a current loop with this bandwidth, or its rate from those of command and
    /// state \[V\].
    pub(crate) fn loop_voltage_v(&self, omega_radps: f64, command: f64, y: &Vector) -> f64 {
        let motor = &self.motor;
        let proportional = motor.inductance_h * (command - y[CURRENT]);
        omega_radps * (proportional + motor.resistance_ohm * y[CURRENT_INTEGRAL])
    }

    /// Voltage at the motor \[V\].
    pub(crate) fn stage_voltage_v(&self, mode: StageMode, command: f64, y: &Vector) -> f64 {
        match (self.stage, mode) {
            (Stage::Voltage, _) | (Stage::LimitedVoltage { .. }, StageMode::Follows) => command,
            (Stage::LimitedVoltage { limit_v, .. }, StageMode::Overrun(d)) => -d.sign() * limit_v,
            (Stage::LimitedVoltage { .. } | Stage::IdealCurrent, _) => self.holding_voltage_v(y),
            (Stage::CurrentLoop { limit_v, .. }, StageMode::Saturated(d)) => d.sign() * limit_v,
            (Stage::CurrentLoop { omega_radps, .. }, _) => {
                self.loop_voltage_v(omega_radps, command, y)
            }
        }
    }

    /// İ \[A/s\] and q̇ \[A\] from the command and its rate, which few stages ask for.
    #[inline]
    pub(crate) fn stage_rates(
        &self,
        mode: StageMode,
        command: f64,
        command_rate: impl FnOnce() -> f64,
        y: &Vector,
    ) -> [f64; 2] {
        let (motor, current) = (&self.motor, y[CURRENT]);
        let voltage_v = self.stage_voltage_v(mode, command, y);
        let free = motor.current_rate(voltage_v, current, y[BETA_DOT] / self.gear_ratio);
        match (self.stage, mode) {
            (Stage::IdealCurrent, _) => [command_rate(), 0.0],
            (Stage::LimitedVoltage { .. }, StageMode::Holding(_)) => [0.0, 0.0],
            (Stage::CurrentLoop { omega_radps, .. }, StageMode::Saturated(_)) => {
                let (l, r) = (motor.inductance_h, motor.resistance_ohm);
                let excess_v = voltage_v - omega_radps * r * y[CURRENT_INTEGRAL];
                [free, excess_v / (omega_radps * l)]
            }
            (Stage::CurrentLoop { .. }, _) => [free, command - current],
            _ => [free, 0.0],
        }
    }

    /// The mode that the state alone suggests.
    pub(crate) fn stage_of_state(&self, command: f64, y: &Vector) -> StageMode {
        match self.stage {
            Stage::CurrentLoop {
                limit_v,
                omega_radps,
            } => match self.loop_voltage_v(omega_radps, command, y) {
                u if u.abs() > limit_v => StageMode::Saturated(Direction::of(u)),
                _ => StageMode::Follows,
            },
            Stage::LimitedVoltage { limit_v, limit_a } if y[CURRENT].abs() >= limit_a => {
                let direction = Direction::of(y[CURRENT]);
                let (s, holding_v) = (direction.sign(), self.holding_voltage_v(y));
                match s * (command - holding_v) {
                    out_v if out_v <= 0.0 => StageMode::Follows,
                    _ if s * holding_v < -limit_v => StageMode::Overrun(direction),
                    _ => StageMode::Holding(direction),
                }
            }
            _ => StageMode::Follows,
        }
    }
}
