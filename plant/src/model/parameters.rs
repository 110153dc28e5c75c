//! The parameters of the axis, as the paper's Table 1 lists them, in SI units.
//!
//! Plain data without checks: whoever fills these in from a run file has
//! checked sign and range (`hil-runner`). Values outside the ranges given here
//! make the equations meaningless, and [`crate::Plant`] does not notice.

/// Permanent-magnet DC motor (paper, section 3, Fig. 5).
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// What couples the gear output (β) to the screw (γ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Joint {
    /// β = γ (paper, section 2.2).
    Rigid,
    /// Visco-elastic contact with backlash (paper, section 2.1).
    Elastic(ElasticJoint),
}

/// Visco-elastic joint with backlash (paper, eq. 8-10).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticJoint {
    /// `k`, contact stiffness \[N m/rad\], greater than 0.
    pub stiffness_nm_per_rad: f64,
    /// `c`, contact damping \[N m s/rad\], at least 0.
    pub damping_nms_per_rad: f64,
    /// `b`, half the backlash \[rad\], at least 0; 0 is a joint without gap.
    pub backlash_half_rad: f64,
    /// Whether the flanks can only push: the torque is cut off at 0 where
    /// damping would make a separating flank pull. No effect where b = 0.
    pub no_pull: bool,
}

/// Carriage on its guide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carriage {
    /// `M`, carriage mass, eq. 2 \[kg\].
    pub mass_kg: f64,
    /// Resistance of the guide against motion.
    pub resistance: Resistance,
}

/// Resistant force on the carriage as a function of screw speed (eq. 13).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Resistance {
    /// `a_0` \[N\].
    pub constant_n: f64,
    /// `a_1` \[N s/rad\].
    pub linear_ns_per_rad: f64,
    /// `a_2` \[N s²/rad²\].
    pub quadratic_ns2_per_rad2: f64,
    /// `false`: eq. 13 to the letter, without regard to direction. `true`: the
    /// constant and quadratic parts oppose the motion, and the screw can stick.
    pub opposes_motion: bool,
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

/// Power amplifier (paper, Fig. 4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplifier {
    /// `K_a`, volts at the motor per volt at the input \[1\], greater than 0.
    pub gain: f64,
    /// `V_max`, limit of the output in both directions \[V\], greater than 0.
    pub voltage_limit_v: f64,
}

/// D/A converter as a physical part (eq. 24).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dac {
    /// `n`, number of bits; codes run from −2^(n−1) to 2^(n−1)−1.
    pub bits: u32,
    /// `K_dac = ΔV/2^n`, volts per code \[V\], greater than 0.
    pub step_v: f64,
}

/// Incremental encoder on the motor shaft as a physical part (eq. 21).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoder {
    /// `K_enc = 4N/2π`, counts per radian of the motor shaft, greater than 0.
    pub counts_per_rad: f64,
}

/// Gains of the PID law (eq. 23), per encoder count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PidGains {
    /// `K_p` \[DAC codes per count\].
    pub kp: f64,
    /// `K_i` \[codes per count and second\].
    pub ki_per_s: f64,
    /// `K_d` \[codes per (count per second)\].
    pub kd_s: f64,
}
