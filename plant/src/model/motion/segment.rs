//! One smooth stretch of the command in closed form.

use core::f64::consts::FRAC_PI_2;

use super::oscillator::{Coupling, Oscillator, versine};
use super::point::MotionPoint;

/// Shape of the acceleration within one segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// `sin ωτ`, from 0 to the amplitude.
    Rise,
    /// The amplitude throughout.
    Constant,
    /// `cos ωτ`, from the amplitude to 0.
    Fall,
    /// From the amplitude on with a constant jerk \[m/s³\].
    Ramp(f64),
}

/// One segment with the command at its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub(super) start_s: f64,
    pub(super) duration_s: f64,
    pub(super) shape: Shape,
    pub(super) amplitude_mps2: f64,
    pub(super) start: MotionPoint,
}

impl Segment {
    /// `ω` of a quarter sine or cosine \[rad/s\].
    fn omega_radps(&self) -> f64 {
        FRAC_PI_2 / self.duration_s
    }

    /// The command `tau_s` after the start of the segment.
    pub(super) fn at(&self, tau_s: f64) -> MotionPoint {
        let (a, t, s) = (self.amplitude_mps2, tau_s, &self.start);
        let (v, x, q) = (s.velocity_mps, s.displacement_m, s.displacement_integral_ms);
        // The three integrals of the shape, each 0 at τ = 0.
        let (shape, once, twice, thrice) = match self.shape {
            Shape::Constant => (1.0, t, t * t / 2.0, t * t * t / 6.0),
            Shape::Ramp(j) => {
                return MotionPoint {
                    acceleration_mps2: a + j * t,
                    velocity_mps: v + t * (a + j * t / 2.0),
                    displacement_m: x + t * (v + t * (a / 2.0 + j * t / 6.0)),
                    displacement_integral_ms: q + t
                        * (x + t * (v / 2.0 + t * (a / 6.0 + j * t / 24.0))),
                };
            }
            Shape::Rise => {
                let w = self.omega_radps();
                let sin = libm::sin(w * t);
                let versine = versine(w * t);
                (
                    sin,
                    versine / w,
                    (t - sin / w) / w,
                    (t * t / 2.0 - versine / (w * w)) / w,
                )
            }
            Shape::Fall => {
                let w = self.omega_radps();
                let (sin, cos) = (libm::sin(w * t), libm::cos(w * t));
                let versine = versine(w * t);
                (cos, sin / w, versine / (w * w), (t - sin / w) / (w * w))
            }
        };
        MotionPoint {
            acceleration_mps2: a * shape,
            velocity_mps: v + a * once,
            displacement_m: x + (v * t + a * twice),
            displacement_integral_ms: q + (x * t + (v * t * t / 2.0 + a * thrice)),
        }
    }

    /// The command `tau_s` after the start as a linear system; none where the
    /// acceleration is constant, which any system serves.
    pub(super) fn oscillator(&self, tau_s: f64) -> Option<Oscillator> {
        let a = self.amplitude_mps2;
        let quadrature_mps2 = match self.shape {
            Shape::Constant => return None,
            Shape::Rise => a * libm::cos(self.omega_radps() * tau_s),
            Shape::Fall => -a * libm::sin(self.omega_radps() * tau_s),
            Shape::Ramp(jerk_mps3) => jerk_mps3,
        };
        Some(Oscillator {
            point: self.at(tau_s),
            quadrature_mps2,
            coupling: self.coupling()?,
        })
    }

    pub(super) fn coupling(&self) -> Option<Coupling> {
        let (up_per_s, down_per_s) = match self.shape {
            Shape::Constant => return None,
            Shape::Rise | Shape::Fall => (self.omega_radps(), self.omega_radps()),
            Shape::Ramp(_) => (1.0, 0.0),
        };
        Some(Coupling {
            up_per_s,
            down_per_s,
        })
    }

    /// Largest magnitude of the acceleration up to `tau_s` \[m/s²\].
    pub(super) fn peak_acceleration_mps2(&self, tau_s: f64) -> f64 {
        let at_end = || self.at(tau_s.min(self.duration_s)).acceleration_mps2.abs();
        match self.shape {
            // A rise is largest at its end, which may not be reached.
            Shape::Rise => at_end(),
            Shape::Constant | Shape::Fall => self.amplitude_mps2.abs(),
            Shape::Ramp(_) => self.amplitude_mps2.abs().max(at_end()),
        }
    }

    /// Largest magnitude of the velocity \[m/s\]: at an end, or on a ramp where the
    /// acceleration changes its sign.
    pub(super) fn peak_velocity_mps(&self) -> f64 {
        let turn_s = match self.shape {
            Shape::Ramp(jerk_mps3) => (-self.amplitude_mps2 / jerk_mps3).max(0.0),
            Shape::Rise | Shape::Constant | Shape::Fall => 0.0,
        };
        let times_s = [0.0, turn_s.min(self.duration_s), self.duration_s];
        let speeds = times_s.map(|tau_s| self.at(tau_s).velocity_mps.abs());
        speeds.into_iter().fold(0.0, f64::max)
    }

    /// Smallest and largest displacement before the end \[m\]: at the start, or on a ramp
    /// where it turns.
    pub(super) fn displacements_m(&self) -> (f64, f64) {
        let turns_s = match self.shape {
            Shape::Ramp(jerk_mps3) => {
                roots(self.start.velocity_mps, self.amplitude_mps2, jerk_mps3)
            }
            Shape::Rise | Shape::Constant | Shape::Fall => [f64::NAN; 2],
        };
        let inside = |tau_s: &f64| *tau_s > 0.0 && *tau_s < self.duration_s;
        let times_s = turns_s.into_iter().filter(inside).chain([0.0]);
        times_s.fold((f64::INFINITY, f64::NEG_INFINITY), |range, tau_s| {
            let x_m = self.at(tau_s).displacement_m;
            (range.0.min(x_m), range.1.max(x_m))
        })
    }

    /// `d⁴/dt⁴` of v, x and its integral are a⁗ less one to three integrations:
    /// `A·ω³`, `A·ω²` and `A·ω` with the segment's own ω, 0 where a is constant; on a
    /// ramp only the integral has one, the jerk.
    pub(super) fn fourth_derivatives(&self) -> MotionPoint {
        let (a, w) = (self.amplitude_mps2.abs(), self.omega_radps());
        match self.shape {
            Shape::Constant => MotionPoint::default(),
            Shape::Ramp(jerk_mps3) => MotionPoint {
                displacement_integral_ms: jerk_mps3.abs(),
                ..MotionPoint::default()
            },
            Shape::Rise | Shape::Fall => MotionPoint {
                acceleration_mps2: 0.0,
                velocity_mps: a * w * w * w,
                displacement_m: a * w * w,
                displacement_integral_ms: a * w,
            },
        }
    }
}

/// Roots of `v + a·τ + j·τ²/2`, without cancellation; not a number where there is none.
fn roots(v: f64, a: f64, j: f64) -> [f64; 2] {
    let sum = -(a + (a * a - 2.0 * j * v).sqrt().copysign(a));
    [sum / j, 2.0 * v / sum]
}
