//! The sampled loop: its gains in volts at the motor per radian of its shaft, its
//! polynomials, and whether it is stable.
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
use plant::PidGains;

use super::held::{DEGREE, Polynomial, PulseResponse, all_roots_within_circle, on_circle};
use super::linear_axis::LinearAxis;
use crate::case::{Case, Law};
use crate::options::{Feedback, RestIntegrator};

/// `K_p`, `K_i` and `K_d` times `K_0 = K_enc·K_dac·K_a`, eq. 27: encoder,
/// converter and amplifier act on the linear loop as this product alone. With a current
/// drive the volts are amperes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopGains {
    /// `K_0·K_p` \[V/rad\].
    pub kp_v_per_rad: f64,
    /// `K_0·K_i` \[V/(rad s)\].
    pub ki_v_per_rads: f64,
    /// `K_0·K_d` \[V s/rad\].
    pub kd_vs_per_rad: f64,
}

impl LoopGains {
    /// Gains per count times `K_0` \[V/rad per code/count\].
    pub fn new(gains: &PidGains, k0: f64) -> Self {
        Self {
            kp_v_per_rad: k0 * gains.kp,
            ki_v_per_rads: k0 * gains.ki_per_s,
            kd_vs_per_rad: k0 * gains.kd_s,
        }
    }

    /// Those of a case.
    pub fn of(case: &Case) -> Self {
        Self::new(&case.controller.gains, loop_gain(case))
    }

    /// `C(e^{jθ}) = K_p + K_i·T·z/(z − 1) + K_d/T·(z − 1)/z`, the law's response
    /// to the error at the motor \[V/rad\].
    pub(crate) fn law(&self, theta: f64, period_s: f64) -> Complex<f64> {
        let w = on_circle(theta);
        let z = w + 1.0;
        z / w * (self.ki_v_per_rads * period_s)
            + w / z * (self.kd_vs_per_rad / period_s)
            + self.kp_v_per_rad
    }

    /// All three times `factor`.
    pub fn times(&self, factor: f64) -> Self {
        Self {
            kp_v_per_rad: factor * self.kp_v_per_rad,
            ki_v_per_rads: factor * self.ki_v_per_rads,
            kd_vs_per_rad: factor * self.kd_vs_per_rad,
        }
    }
}

/// `K_0 = K_enc·K_dac·K_a` of a case \[V/rad per code/count\], eq. 27.
pub fn loop_gain(case: &Case) -> f64 {
    case.output_per_rad()
}

/// True if the linear loop of a case is that of the paper's law.
///
/// On rung `firmware` a filter of the derivative, a second encoder, a slew
/// limit, other gains during the run and a rest that changes the law make it
/// another loop. What stays outside the loop does not: feed-forward,
/// compensation in the reference, supervision, anti-windup (it acts at the
/// limits only), and the derivative of the measurement instead of the error.
pub fn is_papers_loop(case: &Case) -> bool {
    let (law, options) = (&case.options.law, &case.options);
    case.controller.law != Law::Firmware
        || law.derivative_filter_s == 0.0
            && law.feedback == Feedback::Motor
            && law.slew_limit_codes_per_s.is_none()
            && law.rest_dead_band_counts == 0
            && law.rest_integrator == RestIntegrator::Run
            && options.gain_change.is_none()
}

/// The part of the loop that does not depend on the gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Characteristic {
    /// `N(w)/z_gear`, of degree 6 at most.
    zeros: Polynomial,
    /// `P(w)`, of degree 5 at most.
    poles: Polynomial,
    period_s: f64,
    /// `z²·w²·P(w)`, the poles of the open loop.
    open: Polynomial,
    /// Its degree, 9 at most.
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
        let i = gains.ki_v_per_rads * self.period_s;
        let d = gains.kd_vs_per_rad / self.period_s;
        let law = zw * gains.kp_v_per_rad + zz * i + ww * d;
        let axis = self.zeros.at::<6>(w);
        law * axis / (zz * ww * self.poles.at::<5>(w))
    }

    /// `L(e^{jθ})` of each gain alone.
    pub(crate) fn parts(&self, theta: f64) -> [Complex<f64>; 3] {
        let w = on_circle(theta);
        let z = w + 1.0;
        let axis = self.zeros.at::<6>(w) / (z * w * self.poles.at::<5>(w));
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
