//! Incremental encoder as a physical part (paper, eq. 21-22).

use core::f64::consts::PI;

/// Incremental encoder on the motor shaft as a physical part (eq. 21).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoder {
    /// `K_enc = 4N/2π`, counts per radian of the motor shaft, greater than 0.
    pub counts_per_rad: f64,
}

impl Encoder {
    /// Two-channel quadrature encoder with `lines` lines per turn:
    /// `K_enc = 4·N/2π`, eq. 21 \[counts/rad\].
    pub fn with_lines(lines: f64) -> Self {
        Self {
            counts_per_rad: 4.0 * lines / (2.0 * PI),
        }
    }

    /// Position in counts as a real number, `K_enc·α`.
    pub fn position_counts(&self, alpha_rad: f64) -> f64 {
        self.counts_per_rad * alpha_rad
    }

    /// Reading of the counter: `floor(K_enc·α)`, a whole number of counts.
    pub fn count(&self, alpha_rad: f64) -> f64 {
        self.position_counts(alpha_rad).floor()
    }

    /// The setpoint in counts: `floor(K_enc·α_ref + ½)`, a whole number.
    pub fn setpoint_count(&self, alpha_ref_rad: f64) -> f64 {
        (self.position_counts(alpha_ref_rad) + 0.5).floor()
    }
}
