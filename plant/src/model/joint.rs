//! Gear, joint and screw; the visco-elastic joint with backlash (paper, eq. 3 and
//! 8-10, Fig. 2-3).
//!
//! ```text
//!        Ψ │            /            ε = β − γ   relative rotation [rad]
//!          │           / slope k     b           half the backlash [rad]
//!  ──┬─────┼─────┬────/──── ε        Ψ           torque from gear to screw [N m]
//!   −b     │     b
//! ```
//!
//! The viscous part `c·ε̇` starts and ends with the contact, so the torque
//! jumps there. That is the paper's model; it also lets a separating flank
//! pull for a moment. With `no_pull` the torque is cut off at 0 instead.

use super::direction::Direction;

/// Gear, joint and screw (paper, section 2, Fig. 2).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Transmission {
    /// `z = β̇/α̇`, gear ratio, eq. 3 \[1\]: gear output speed over motor speed.
    pub gear_ratio: f64,
    /// Coupling of the gear output to the screw.
    pub joint: Joint,
    /// `J_v`, screw inertia, eq. 2 \[kg m²\].
    pub screw_inertia_kg_m2: f64,
    /// `p = ẋ/γ̇`, screw pitch, eq. 3 \[m/rad\]: 5 mm per turn is 5e-3/2π.
    pub screw_pitch_m_per_rad: f64,
}

/// Coupling of the gear output (β) to the screw (γ).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Joint {
    /// β = γ (paper, section 2.2).
    #[default]
    Rigid,
    /// Visco-elastic contact with backlash (paper, section 2.1).
    Elastic(ElasticJoint),
}

impl Joint {
    /// The springs and the gap; `None` for a rigid joint.
    pub fn elastic(self) -> Option<ElasticJoint> {
        match self {
            Self::Rigid => None,
            Self::Elastic(joint) => Some(joint),
        }
    }

    /// Half the gap \[rad\], 0 for a rigid joint.
    pub fn backlash_half_rad(self) -> f64 {
        self.elastic().map_or(0.0, |joint| joint.backlash_half_rad)
    }
}

/// Visco-elastic joint with backlash (paper, eq. 8-10).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ElasticJoint {
    /// `k`, contact stiffness \[N m/rad\], greater than 0.
    pub stiffness_nm_per_rad: f64,
    /// `c`, contact damping \[N m s/rad\], at least 0.
    pub damping_nms_per_rad: f64,
    /// `b`, half the backlash \[rad\], at least 0; 0 is a joint without gap.
    pub backlash_half_rad: f64,
    /// True if the flanks can only push: the torque is cut off at 0 where
    /// damping would make a separating flank pull. No effect where b = 0.
    pub no_pull: bool,
}

/// Flank of the joint that carries torque, as traces and events report it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// `−1`: the coast flank, ε ≤ −b.
    Coast,
    /// `0`: no torque; also throughout on a rigid joint.
    Open,
    /// `+1`: the drive flank, ε ≥ b; also throughout where b = 0.
    Drive,
}

impl Contact {
    /// −1, 0 or +1.
    pub fn sign(self) -> i8 {
        match self {
            Self::Coast => -1,
            Self::Open => 0,
            Self::Drive => 1,
        }
    }
}

/// Mode of the joint; the equations are smooth within each mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum JointMode {
    /// β = γ, no joint at all.
    Rigid,
    /// b = 0: always in contact, no events.
    Gapless,
    /// |ε| ≤ b: no torque.
    Open,
    /// The flank carries torque.
    Loaded(Direction),
    /// `no_pull` only: |ε| > b, but the flank would have to pull.
    Released(Direction),
}

impl JointMode {
    pub(crate) fn contact(self) -> Contact {
        match self {
            Self::Gapless | Self::Loaded(Direction::Positive) => Contact::Drive,
            Self::Loaded(Direction::Negative) => Contact::Coast,
            Self::Rigid | Self::Open | Self::Released(_) => Contact::Open,
        }
    }

    /// True if the joint carries torque.
    pub(crate) fn carries(self) -> bool {
        matches!(self, Self::Gapless | Self::Loaded(_))
    }
}

impl ElasticJoint {
    /// ε at which a joint in this mode carries nothing but damping \[rad\]; none where it
    /// carries no torque at all.
    pub(crate) fn rest_rad(&self, mode: JointMode) -> Option<f64> {
        match mode {
            JointMode::Gapless => Some(0.0),
            JointMode::Loaded(flank) => Some(flank.sign() * self.backlash_half_rad),
            JointMode::Rigid | JointMode::Open | JointMode::Released(_) => None,
        }
    }

    /// `Ψ_e + Ψ_v = k·(ε ∓ b) + c·ε̇` on a flank, eq. 8-10 \[N m\], whether or
    /// not the flank can pull.
    pub(crate) fn flank_torque_nm(&self, flank: Direction, epsilon: f64, epsilon_dot: f64) -> f64 {
        self.torque_nm(JointMode::Loaded(flank), epsilon, epsilon_dot)
    }

    /// `Ψ`, torque from the gear output to the screw in a given mode \[N m\].
    pub(crate) fn torque_nm(&self, mode: JointMode, epsilon: f64, epsilon_dot: f64) -> f64 {
        self.rest_rad(mode).map_or(0.0, |rest_rad| {
            self.stiffness_nm_per_rad * (epsilon - rest_rad)
                + self.damping_nms_per_rad * epsilon_dot
        })
    }

    /// `Ψ̇ = k·ε̇ + c·ε̈` of a flank \[N m/s\].
    pub(crate) fn flank_torque_rate(&self, epsilon_dot: f64, epsilon_ddot: f64) -> f64 {
        self.stiffness_nm_per_rad * epsilon_dot + self.damping_nms_per_rad * epsilon_ddot
    }

    /// The mode that the state alone suggests: what a solver that locates
    /// nothing uses.
    pub(crate) fn mode_of_state(&self, epsilon: f64, epsilon_dot: f64) -> JointMode {
        if self.backlash_half_rad == 0.0 {
            return JointMode::Gapless;
        }
        if epsilon.abs() <= self.backlash_half_rad {
            return JointMode::Open;
        }
        let flank = Direction::of(epsilon);
        let pulls = flank.sign() * self.flank_torque_nm(flank, epsilon, epsilon_dot) < 0.0;
        if self.releases() && pulls {
            JointMode::Released(flank)
        } else {
            JointMode::Loaded(flank)
        }
    }

    /// True if a flank can let go before |ε| = b: without damping both
    /// happen at once and `no_pull` changes nothing.
    pub(crate) fn releases(&self) -> bool {
        self.no_pull && self.damping_nms_per_rad > 0.0
    }

    /// `U = ½·k·(|ε| − b)²` outside the gap, energy stored in the contact:
    /// eq. 5 less the gap \[J\].
    pub fn stored_energy_j(&self, epsilon_rad: f64) -> f64 {
        let squeeze = (epsilon_rad.abs() - self.backlash_half_rad).max(0.0);
        0.5 * self.stiffness_nm_per_rad * squeeze * squeeze
    }
}
