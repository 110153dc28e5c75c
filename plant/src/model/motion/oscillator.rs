//! The motion command as solver `exact` needs it: the state of a linear
//! system, and a power series.

use core::f64::consts::FRAC_PI_2;

use super::segment::Shape;
use super::{Motion, MotionPoint};

/// The command as a linear oscillator: within one interval of Fig. 6 its
/// acceleration obeys `ȧ = ω·w`, `ẇ = −ω·a` (with ω = 0 it is constant).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Oscillator {
    pub(crate) point: MotionPoint,
    /// `w` \[m/s²\].
    pub(crate) quadrature_mps2: f64,
    /// `ω` \[rad/s\].
    pub(crate) omega_radps: f64,
}

impl Motion {
    /// The command at `time_s` as an oscillator, right-continuous.
    pub(crate) fn oscillator(&self, time_s: f64) -> Oscillator {
        let still = |point: MotionPoint| Oscillator {
            point,
            quadrature_mps2: 0.0,
            omega_radps: 0.0,
        };
        match self.segment_at(time_s) {
            None => still(self.at(time_s)),
            Some(segment) => {
                let tau_s = (time_s - segment.start_s).max(0.0);
                let point = segment.at(tau_s);
                let w = FRAC_PI_2 / segment.duration_s;
                let a = segment.amplitude_mps2;
                match segment.shape {
                    Shape::Constant => still(point),
                    Shape::Rise => Oscillator {
                        point,
                        quadrature_mps2: a * libm::cos(w * tau_s),
                        omega_radps: w,
                    },
                    Shape::Fall => Oscillator {
                        point,
                        quadrature_mps2: -a * libm::sin(w * tau_s),
                        omega_radps: w,
                    },
                }
            }
        }
    }

    /// Coefficients of x_ref as a power series in θ = t/length from `time_s`
    /// on, valid until the interval of the command ends.
    pub(crate) fn series(&self, time_s: f64, length_s: f64, coefficients: &mut [f64]) {
        let Oscillator {
            point,
            quadrature_mps2,
            omega_radps,
        } = self.oscillator(time_s);
        let phase = omega_radps * length_s;
        // x, v·h and then a·h²/2!, ω·w·h³/3!, −ω²·a·h⁴/4!, …
        let mut scale = length_s * length_s / 2.0;
        let derivatives = [
            point.acceleration_mps2,
            quadrature_mps2,
            -point.acceleration_mps2,
            -quadrature_mps2,
        ];
        for (n, c) in (0_u16..).zip(coefficients.iter_mut()) {
            *c = match n {
                0 => point.displacement_m,
                1 => point.velocity_mps * length_s,
                _ => {
                    let term = derivatives[usize::from(n - 2) % 4] * scale;
                    scale *= phase / f64::from(n + 1);
                    term
                }
            };
        }
    }
}
