//! Carriage and the resistance of its guide (paper, eq. 2 and 13), and the
//! variant that opposes the motion and can hold the screw.

use super::direction::Direction;

/// Carriage on its guide.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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

/// Mode of the guide; the force is smooth within each mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GuideMode {
    /// Eq. 13 as it stands, without regard to direction.
    AsWritten,
    /// Sliding that way, or about to: γ̇ may be 0.
    Slides(Direction),
    /// Held at γ̇ = 0 by dry friction.
    Stuck,
}

impl GuideMode {
    /// Sign of the motion: of γ̇, or of what γ̇ is about to become.
    pub(crate) fn direction(self) -> f64 {
        match self {
            Self::AsWritten => 1.0,
            Self::Slides(direction) => direction.sign(),
            Self::Stuck => 0.0,
        }
    }
}

impl Resistance {
    /// `F_r(γ̇)` \[N\]: eq. 13, or with `opposes_motion`
    /// `sign(γ̇)·(a0 + a2·γ̇²) + a1·γ̇`. Not meaningful while stuck.
    pub(crate) fn force_n(&self, mode: GuideMode, gamma_dot: f64) -> f64 {
        let [a0, a1, a2] = self.polynomial(mode);
        a0 + a2 * gamma_dot * gamma_dot + a1 * gamma_dot
    }

    /// `F_r` as a polynomial in γ̇: its coefficients from degree 0 to 2.
    pub(crate) fn polynomial(&self, mode: GuideMode) -> [f64; 3] {
        let s = mode.direction();
        [
            s * self.constant_n,
            self.linear_ns_per_rad,
            s * self.quadratic_ns2_per_rad2,
        ]
    }

    /// True if direction matters: with `a1` alone both readings agree.
    pub(crate) fn has_stiction(&self) -> bool {
        self.opposes_motion && (self.constant_n != 0.0 || self.quadratic_ns2_per_rad2 != 0.0)
    }

    /// The mode of an axis at rest.
    pub(crate) fn mode_at_rest(&self) -> GuideMode {
        if self.has_stiction() {
            GuideMode::Stuck
        } else {
            GuideMode::AsWritten
        }
    }

    /// The mode that the state alone suggests, `torque_nm` being what would
    /// move the screw and `hold_nm` what friction can hold.
    pub(crate) fn mode_of_state(&self, gamma_dot: f64, torque_nm: f64, hold_nm: f64) -> GuideMode {
        match gamma_dot {
            _ if !self.has_stiction() => GuideMode::AsWritten,
            v if v != 0.0 => GuideMode::Slides(Direction::of(v)),
            _ if torque_nm > hold_nm => GuideMode::Slides(Direction::Positive),
            _ if torque_nm < -hold_nm => GuideMode::Slides(Direction::Negative),
            _ => GuideMode::Stuck,
        }
    }
}
