//! Armature circuit of the DC motor (paper, eq. 12, 25-26, Fig. 5).

/// Permanent-magnet DC motor (paper, section 3, Fig. 5).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motor {
    /// `J_m`, rotor inertia, eq. 2 \[kg m²\], greater than 0.
    pub inertia_kg_m2: f64,
    /// `k_m`, torque and back-e.m.f. constant, eq. 12 and 25
    /// \[N m/A = V s/rad\].
    pub torque_constant_nm_per_a: f64,
    /// `R`, armature resistance, eq. 25 \[Ω\], greater than 0.
    pub resistance_ohm: f64,
    /// `L`, armature inductance, eq. 25 \[H\], greater than 0.
    pub inductance_h: f64,
}

impl Motor {
    /// `τ_m = k_m·I`, eq. 12 \[N m\].
    pub fn torque_nm(&self, current_a: f64) -> f64 {
        self.torque_constant_nm_per_a * current_a
    }

    /// `İ = (V_m − R·I − k_m·α̇)/L`, eq. 25-26 \[A/s\].
    ///
    /// ```
    /// let motor = plant::Motor {
    ///     inertia_kg_m2: 2e-4,
    ///     torque_constant_nm_per_a: 0.25,
    ///     resistance_ohm: 1.5,
    ///     inductance_h: 0.0065,
    /// };
    /// // At 1.5 V and standstill the current settles at 1 A.
    /// assert_eq!(motor.current_rate(1.5, 1.0, 0.0), 0.0);
    /// ```
    pub fn current_rate(&self, voltage_v: f64, current_a: f64, alpha_dot_radps: f64) -> f64 {
        let induced_v = self.torque_constant_nm_per_a * alpha_dot_radps;
        (voltage_v - self.resistance_ohm * current_a - induced_v) / self.inductance_h
    }
}
