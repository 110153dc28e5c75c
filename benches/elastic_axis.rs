//! The paper's elastic axis (eq. 8-11, 14-15, 25) as a program outside the
//! `plant` crate would write it: five plain numbers and reciprocals made once.

use hil_core::case::Case;
use plant::Joint;

/// γ \[rad\], γ̇ \[rad/s\], ε = β − γ \[rad\], ε̇ \[rad/s\], I \[A\].
pub type State = [f64; 5];

/// Index of ε in [`State`].
pub const EPSILON: usize = 2;
/// Index of I in [`State`].
pub const CURRENT: usize = 4;

/// `β = γ + ε` \[rad\].
pub fn beta_rad(y: &[f64]) -> f64 {
    y[0] + y[EPSILON]
}

/// The joint's torque law within one mode of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flank {
    /// −1, 0 or 1.
    pub sign: f64,
    stiffness_nm_per_rad: f64,
    damping_nms_per_rad: f64,
    /// Place of the flank, `sign·b` \[rad\].
    pub surface_rad: f64,
}

/// Coefficients of the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticAxis {
    /// Coast flank, gap, drive flank.
    flanks: [Flank; 3],
    /// `b` \[rad\].
    pub backlash_half_rad: f64,
    /// `z` \[1\].
    pub gear_ratio: f64,
    /// `k_m/(z·J1)`.
    current_to_beta_ddot: f64,
    /// `1/J1 + 1/J2` and `1/J2`.
    per_both: f64,
    per_screw: f64,
    /// `1/L`, `R/L`, `k_m/(z·L)`.
    per_inductance: f64,
    resistance_rate: f64,
    emf_rate: f64,
}

impl ElasticAxis {
    /// The axis of a case; `None` if its joint is rigid. Resistance of the
    /// guide is left out: simulation 2 has none.
    pub fn new(case: &Case) -> Option<Self> {
        let (motor, transmission) = (&case.axis.motor, &case.axis.transmission);
        let Joint::Elastic(joint) = transmission.joint else {
            return None;
        };
        let (z, p) = (transmission.gear_ratio, transmission.screw_pitch_m_per_rad);
        let (km, l) = (motor.torque_constant_nm_per_a, motor.inductance_h);
        let j1 = motor.inertia_kg_m2 / (z * z);
        let j2 = transmission.screw_inertia_kg_m2 + case.axis.carriage.mass_kg * p * p;
        let flanks = [-1.0, 0.0, 1.0].map(|sign: f64| Flank {
            sign,
            stiffness_nm_per_rad: joint.stiffness_nm_per_rad * sign.abs(),
            damping_nms_per_rad: joint.damping_nms_per_rad * sign.abs(),
            surface_rad: sign * joint.backlash_half_rad,
        });
        Some(Self {
            flanks,
            backlash_half_rad: joint.backlash_half_rad,
            gear_ratio: z,
            current_to_beta_ddot: km / (z * j1),
            per_both: 1.0 / j1 + 1.0 / j2,
            per_screw: 1.0 / j2,
            per_inductance: 1.0 / l,
            resistance_rate: motor.resistance_ohm / l,
            emf_rate: km / (z * l),
        })
    }

    /// The gap, where no torque passes.
    pub fn open(&self) -> Flank {
        self.flanks[1]
    }

    /// The coast flank for `false`, the drive flank for `true`.
    pub fn flank(&self, drive: bool) -> Flank {
        self.flanks[if drive { 2 } else { 0 }]
    }

    /// The mode that the state alone suggests.
    #[inline]
    pub fn flank_of_state(&self, y: &State) -> &Flank {
        let (e, b) = (y[EPSILON], self.backlash_half_rad);
        &self.flanks[1 + usize::from(e > b) - usize::from(e < -b)]
    }

    /// `dy/dt` in one mode under `voltage_v`.
    #[inline]
    pub fn derivative(&self, flank: &Flank, voltage_v: f64, y: &State) -> State {
        let [_, gamma_dot, epsilon, epsilon_dot, current] = *y;
        let psi = flank.stiffness_nm_per_rad * (epsilon - flank.surface_rad)
            + flank.damping_nms_per_rad * epsilon_dot;
        [
            gamma_dot,
            self.per_screw * psi,
            epsilon_dot,
            self.current_to_beta_ddot * current - self.per_both * psi,
            self.per_inductance * voltage_v
                - self.resistance_rate * current
                - self.emf_rate * (gamma_dot + epsilon_dot),
        ]
    }
}
