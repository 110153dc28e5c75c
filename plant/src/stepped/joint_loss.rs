//! What the joint's damper turns into heat, `∫ c·ε̇² dt`, over a step of a
//! Runge-Kutta solver. The exact solution has a closed form of its own
//! ([`crate::exact`]).

use crate::model::state::{EPSILON, EPSILON_DOT};
use crate::numerics::quadrature::GAUSS_4;
use crate::stepped::piece::Stepped;

impl Stepped<'_> {
    /// What the joint's damper takes over the span \[J\]: by the method's own sum
    /// where there is one, so to the order of the solution; by Gauss's rule on
    /// the cubic of solver `rk4`, whose step may be in contact in a part only.
    pub(crate) fn joint_loss_j(&self) -> f64 {
        let Some(joint) = self.span.axis.joint else {
            return 0.0;
        };
        let (start, end) = (self.span.modes.0.joint, self.span.modes.1.joint);
        let c = joint.damping_nms_per_rad;
        match self.piece.dense {
            _ if c == 0.0 || !(start.carries() || end.carries()) => 0.0,
            // The rate of ε is ε̇.
            Some((step, 0.0, 1.0)) => c * step.squared_rate(EPSILON),
            _ => {
                let mut sum = 0.0;
                for (theta, weight) in GAUSS_4 {
                    let y = self.span.vector_at(theta);
                    let (epsilon, epsilon_dot) = (y[EPSILON], y[EPSILON_DOT]);
                    let closed =
                        start == end || joint.mode_of_state(epsilon, epsilon_dot).carries();
                    if closed {
                        sum += weight * (epsilon_dot * epsilon_dot);
                    }
                }
                c * sum * self.span.length_s
            }
        }
    }
}
