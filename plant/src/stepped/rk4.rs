//! Classical Runge-Kutta of order 4 with a fixed step: the paper's own way.
//!
//! It locates nothing: every stage takes the mode of the axis from the state
//! it is evaluated at, so a step that crosses a contact smears it.

use super::dop853::Stray;
use super::piece::SteppedPiece;
use crate::hybrid::{Automaton, PlantError};
use crate::model::axis::Drive;
use crate::model::joint::JointMode;
use crate::model::pid::Side;
use crate::model::state::{EPSILON_DOT, Vector};
use crate::numerics::{count, seconds};
use crate::observe::{ContactChange, Span, Watch};

/// One step of `dy/dt = f(t, y)` from `(t, y)` with `k1 = f(t, y)`.
fn step(f: impl Fn(f64, &Vector) -> Vector, t: f64, y: &Vector, k1: Vector, h: f64) -> Vector {
    let k2 = f(t + h / 2.0, &(y + k1 * (h / 2.0)));
    let k3 = f(t + h / 2.0, &(y + k2 * (h / 2.0)));
    let k4 = f(t + h, &(y + k3 * h));
    y + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)
}

impl Automaton {
    /// Solver `rk4`: equal steps, the mode from the state at every stage.
    pub(crate) fn advance_fixed(
        &mut self,
        drive: &Drive<'_>,
        length_ns: u64,
        step_ns: u64,
        watch: &mut impl Watch,
    ) -> Result<(), PlantError> {
        let axis = self.axis;
        let f = |t: f64, y: &Vector| {
            let mode = axis.mode_of_state(drive, t, y);
            axis.derivative(&mode, drive, (t, Side::After), y)
        };
        let start_s = seconds(self.time_ns);
        let steps = length_ns.div_ceil(step_ns.max(1));
        let h = seconds(length_ns) / count(steps);
        let stray = Stray {
            length_s: h,
            ..Stray::default()
        };
        self.take_up(drive);
        let mut dy0 = f(start_s, &self.y);
        self.mode = axis.mode_of_state(drive, start_s, &self.y);
        for i in 0..steps {
            let time_s = start_s + count(i) * h;
            let y0 = self.y;
            // Under a held voltage time does not enter, and the derivative at
            // the end of the last step is that at the start of this one.
            let k1 = match drive {
                Drive::Held(_) => dy0,
                Drive::Feedback(_) => f(time_s, &y0),
            };
            let y1 = step(f, time_s, &y0, k1, h);
            if !y1.iter().all(|v| v.is_finite()) {
                return Err(PlantError::NonFinite { time_s });
            }
            let (before, end_s) = (self.mode, time_s + h);
            self.y = y1;
            self.mode = axis.mode_of_state(drive, end_s, &y1);
            let dy1 = axis.derivative(&self.mode, drive, (end_s, Side::After), &y1);
            let piece = SteppedPiece {
                dense: None,
                rates: (&dy0, &dy1),
                stray,
            };
            watch.span(&Span {
                axis: &axis,
                drive,
                modes: (before, self.mode),
                start_s: time_s,
                length_s: h,
                y: (&y0, &y1),
                interior: &piece,
            });
            let (from, to) = (before.joint.contact(), self.contact());
            if from != to {
                watch.contact_change(&ContactChange {
                    time_s: end_s,
                    from,
                    to,
                    impact: before.joint == JointMode::Open,
                    epsilon_dot_radps: y1[EPSILON_DOT],
                    acceleration_before_mps2: axis.carriage_acceleration_mps2(&before, &y0),
                    acceleration_after_mps2: self.acceleration_mps2(),
                });
            }
            dy0 = dy1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(n: u32) -> f64 {
        let f = |_: f64, y: &Vector| Vector::from([y[1], -y[0], 0.0, 0.0, 0.0, 0.0, 0.0]);
        let h = 1.0 / f64::from(n);
        let mut y = Vector::from([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        for i in 0..n {
            let t = f64::from(i) * h;
            y = step(f, t, &y, f(t, &y), h);
        }
        (y[0] - libm::sin(1.0)).abs()
    }

    #[test]
    fn converges_with_order_four() {
        let order = (error(8) / error(16)).log2();
        assert!((3.8..=4.2).contains(&order), "order {order}");
    }
}
