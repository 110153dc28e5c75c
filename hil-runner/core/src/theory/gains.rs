//! The gains of a loop in volts at the motor per radian of its shaft.

use nalgebra::Complex;
use plant::PidGains;

use super::polynomial::on_circle;
use crate::case::{Case, Law};
use crate::options::{Feedback, RestIntegrator};

/// `K_p`, `K_i` and `K_d` times `K_0 = K_enc·K_dac·K_a`, eq. 27: encoder,
/// converter and amplifier act on the linear loop as this product alone.
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
    case.encoder.counts_per_rad * case.dac.step_v * case.amplifier.gain
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
