//! The parameters of the axis, as the paper's Table 1 lists them, in SI units
//! (eq. 2-3): those of each part stand with it.
//!
//! Plain data without checks: whoever fills these in from a run file has
//! checked sign and range (`hil-runner`). Values outside the ranges given here
//! make the equations meaningless, and [`crate::Plant`] does not notice.

use crate::model::joint::Joint;
use crate::model::motor::Motor;
use crate::model::resistance::Resistance;

/// Gear, joint and screw (paper, section 2, Fig. 2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transmission {
    /// `z = β̇/α̇`, gear ratio, eq. 3 \[1\]: gear output speed over motor speed.
    pub gear_ratio: f64,
    /// What couples the gear output to the screw.
    pub joint: Joint,
    /// `J_v`, screw inertia, eq. 2 \[kg m²\].
    pub screw_inertia_kg_m2: f64,
    /// `p = ẋ/γ̇`, screw pitch, eq. 3 \[m/rad\]: 5 mm per turn is 5e-3/2π.
    pub screw_pitch_m_per_rad: f64,
}

/// Carriage on its guide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carriage {
    /// `M`, carriage mass, eq. 2 \[kg\].
    pub mass_kg: f64,
    /// Resistance of the guide against motion.
    pub resistance: Resistance,
}

/// Motor, transmission and carriage: everything that moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisParameters {
    /// The motor.
    pub motor: Motor,
    /// Gear, joint and screw.
    pub transmission: Transmission,
    /// Carriage and guide.
    pub carriage: Carriage,
}

impl AxisParameters {
    /// Whether the plant is affine between events: no quadratic resistance.
    pub fn is_affine(&self) -> bool {
        self.carriage.resistance.quadratic_ns2_per_rad2 == 0.0
    }
}
