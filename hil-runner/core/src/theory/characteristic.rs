//! The sampled loop as polynomials, and whether it is stable.
//!
//! The law `y = K_p·e + K_i·S + K_d·(e − e_prev)/T`, with S including the
//! present error, is
//!
//! ```text
//! C(z) = K_p + K_i·T·z/(z − 1) + K_d/T·(z − 1)/z
//! ```
//!
//! With the axis `β/V = N(w)/(z·w·P(w))`, `w = z − 1`, and `α = β/z_gear`:
//!
//! ```text
//!        K_p·z·w + K_i·T·z² + K_d/T·w²   N(w)/z_gear        B(w)
//! L(z) = ───────────────────────────── · ─────────── =  ────────────
//!                    z·w                  z·w·P(w)       z²·w²·P(w)
//! ```
//!
//! and the poles of the closed loop are the roots of `z²·w²·P(w) + B(w)`, which
//! is linear in the gains.

use nalgebra::Complex;

use super::gains::LoopGains;
use super::held::PulseResponse;
use super::linear_axis::LinearAxis;
use super::polynomial::{DEGREE, Polynomial, all_roots_within_circle, on_circle};

/// The part of the loop that does not depend on the gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Characteristic {
    /// `N(w)/z_gear`, of degree 5 or 3.
    zeros: Polynomial,
    /// `P(w)`, of degree 4 or 2.
    poles: Polynomial,
    period_s: f64,
    /// `z²·w²·P(w)`, the poles of the open loop.
    open: Polynomial,
    /// Its degree, 8 or 6.
    degree: usize,
    /// `B(w)` for 1 V/rad of K_p, 1 V/(rad s) of K_i, 1 V s/rad of K_d.
    per_gain: [Polynomial; 3],
}

impl Characteristic {
    pub(crate) fn new(axis: &LinearAxis, period_s: f64, delay_s: f64) -> Self {
        let pulse = PulseResponse::new(axis, period_s, delay_s);
        let z = Polynomial::new(&[1.0, 1.0]);
        let w = Polynomial::new(&[0.0, 1.0]);
        let (zw, zz, ww) = (z.times(&w), z.times(&z), w.times(&w));
        // N(w) = present·z + past, and the gear between β and α.
        let zeros = pulse.present.times(&z).plus(&pulse.past);
        let zeros = zeros.scaled(1.0 / axis.gear_ratio);
        Self {
            zeros,
            poles: pulse.poles,
            period_s,
            open: zz.times(&ww).times(&pulse.poles),
            degree: pulse.degree + 4,
            per_gain: [
                zw.times(&zeros),
                zz.times(&zeros).scaled(period_s),
                ww.times(&zeros).scaled(1.0 / period_s),
            ],
        }
    }

    /// `L(e^{jθ})` of the loop with `gains`.
    #[inline]
    pub(crate) fn at(&self, gains: &LoopGains, theta: f64) -> Complex<f64> {
        let w = on_circle(theta);
        let z = w + 1.0;
        let (zw, zz, ww) = (z * w, z * z, w * w);
        let (i, d) = (
            gains.ki_v_per_rads * self.period_s,
            gains.kd_vs_per_rad / self.period_s,
        );
        let law = zw * gains.kp_v_per_rad + zz * i + ww * d;
        let axis = self.zeros.at::<5>(w);
        law * axis / (zz * ww * self.poles.at::<4>(w))
    }

    /// `L(e^{jθ})` of each gain alone.
    pub(crate) fn parts(&self, theta: f64) -> [Complex<f64>; 3] {
        let w = on_circle(theta);
        let z = w + 1.0;
        let axis = self.zeros.at::<5>(w) / (z * w * self.poles.at::<4>(w));
        [
            axis,
            axis * (z / w * self.period_s),
            axis * (w / z / self.period_s),
        ]
    }

    /// True if the closed loop comes to rest by itself. Without K_i the
    /// integrator drives nothing and is left out; without K_p and K_i nothing
    /// holds the axis in place, and the loop is not stable.
    pub(crate) fn is_stable(&self, gains: &LoopGains) -> bool {
        let [p, i, d] = &self.per_gain;
        let (kp, ki, kd) = (gains.kp_v_per_rad, gains.ki_v_per_rads, gains.kd_vs_per_rad);
        let closed: [f64; DEGREE + 1] =
            core::array::from_fn(|k| self.open.0[k] + (kp * p.0[k] + ki * i.0[k] + kd * d.0[k]));
        let first = usize::from(ki == 0.0);
        all_roots_within_circle(&closed[first..=self.degree])
    }
}
