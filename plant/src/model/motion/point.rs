//! The command at one instant, whatever makes it (Fig. 6 of the paper, or a profile),
//! with the integral that the continuous law needs (eq. 28-29).

/// The command at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionPoint {
    /// Acceleration \[m/s²\]; right-continuous where it jumps.
    pub acceleration_mps2: f64,
    /// Velocity \[m/s\].
    pub velocity_mps: f64,
    /// Displacement \[m\].
    pub displacement_m: f64,
    /// Integral of the displacement from 0 \[m s\] (the hat of eq. 29).
    pub displacement_integral_ms: f64,
}

impl MotionPoint {
    /// The command of a move that starts from this rest, `since_s` after its start.
    pub(super) fn and(&self, of_move: &Self, since_s: f64) -> Self {
        let x_m = self.displacement_m;
        Self {
            displacement_m: x_m + of_move.displacement_m,
            displacement_integral_ms: self.displacement_integral_ms
                + (x_m * since_s + of_move.displacement_integral_ms),
            ..*of_move
        }
    }
}
