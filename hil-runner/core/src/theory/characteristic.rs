//! The sampled loop: its gains in volts at the motor per radian of its shaft, its
//! polynomials, and whether it is stable.
//!
//! The law `y = K_p·e + K_i·S + K_d·v/T`, with S including the present error and
//! `v = v_prev + a·(e − e_prev − v_prev)`, is
//!
//! ```text
//! C(z) = K_p + K_i·T·z/(z − 1) + K_d/T·a·(z − 1)/(z − 1 + a)      a = T/(T_f + T)
//! ```
//!
//! The filter of the derivative, the backward difference of `1/(T_f·s + 1)`
//! (`firmware/src/law/filter.rs`), moves its pole from z = 0, a = 1, to 1 − a. The
//! derivative of the measurement is the same in the loop.
//!
//! With the axis `β/V = N(w)/(z·w·P(w))`, `w = z − 1`, and `α = β/z_gear`, and with
//! `f = w + a`, which without a filter is z:
//!
//! ```text
//!        K_p·f·w + K_i·T·z·f + a·K_d/T·w²   N(w)/z_gear         B(w)
//! L(z) = ──────────────────────────────── · ─────────── =  ─────────────
//!                     f·w                    z·w·P(w)       z·f·w²·P(w)
//! ```
//!
//! and the poles of the closed loop are the roots of `z·f·w²·P(w) + B(w)`, which
//! is linear in the gains. Where the position comes from the load's encoder, K_p and
//! K_i have the screw's N(w), `γ/V`, and K_d keeps the motor's: their gains are per
//! motor count, one load count being `K_enc/(z_gear·K_load)` of them, so that
//! they see γ/z_gear. The loop is broken at the code.

use core::ops::{Add, Mul, Sub};

use nalgebra::Complex;
use plant::{One, PidGains, Width};

use super::held::{DEGREE, Polynomial, PulseResponse, all_roots_within_circle, on_circle};
use super::linear_axis::{LinearAxis, Shaft};
use crate::case::{Case, Law};
use crate::number::seconds;
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
    /// `a` of the derivative's filter, above 0; 1 without one.
    pub smoothing: f64,
}

impl LoopGains {
    /// Gains per count times `K_0` \[V/rad per code/count\], without a filter.
    pub fn new(gains: &PidGains, k0: f64) -> Self {
        Self {
            kp_v_per_rad: k0 * gains.kp,
            ki_v_per_rads: k0 * gains.ki_per_s,
            kd_vs_per_rad: k0 * gains.kd_s,
            smoothing: 1.0,
        }
    }

    /// Those of a case at its start, as its run file has them.
    pub fn of(case: &Case) -> Self {
        Self::with(&case.controller.gains, case)
    }

    /// Those from the gain change on; none where there is no change, and on rungs
    /// below `firmware`, which know none.
    pub fn after_change(case: &Case) -> Option<Self> {
        let change = case.options.gain_change?;
        let start = case.controller.gains;
        let gains = PidGains {
            kp: change.kp.unwrap_or(start.kp),
            ki_per_s: change.ki_per_s.unwrap_or(start.ki_per_s),
            kd_s: change.kd_s.unwrap_or(start.kd_s),
        };
        (case.controller.law == Law::Firmware).then(|| Self::with(&gains, case))
    }

    fn with(gains: &PidGains, case: &Case) -> Self {
        let filter_s = case.options.law.derivative_filter_s;
        let smoothing = match case.controller.sample_time_ns {
            Some(period_ns) if case.controller.law == Law::Firmware && filter_s > 0.0 => {
                let period_s = seconds(period_ns);
                period_s / (filter_s + period_s)
            }
            _ => 1.0,
        };
        Self {
            smoothing,
            ..Self::new(gains, case.output_per_rad())
        }
    }

    /// `C(e^{jθ}) = K_p + K_i·T·z/(z − 1) + K_d/T·a·(z − 1)/(z − 1 + a)`, the law's
    /// response to the error at the motor \[V/rad\].
    pub(crate) fn law(&self, theta: f64, period_s: f64) -> Complex<f64> {
        let w = on_circle(theta);
        let z = w + 1.0;
        z / w * (self.ki_v_per_rads * period_s)
            + w / (w + self.smoothing) * (self.kd_vs_per_rad * self.smoothing / period_s)
            + self.kp_v_per_rad
    }

    /// K_p, K_i, K_d and the filter's a.
    #[inline]
    pub(crate) fn in_order(&self) -> [f64; 4] {
        [
            self.kp_v_per_rad,
            self.ki_v_per_rads,
            self.kd_vs_per_rad,
            self.smoothing,
        ]
    }

    /// All three gains times `factor`.
    pub fn times(&self, factor: f64) -> Self {
        Self {
            kp_v_per_rad: factor * self.kp_v_per_rad,
            ki_v_per_rads: factor * self.ki_v_per_rads,
            kd_vs_per_rad: factor * self.kd_vs_per_rad,
            smoothing: self.smoothing,
        }
    }
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

/// The sum of two complex numbers a lane.
#[inline(always)]
fn sum<V: Add<Output = V>>(a: Complex<V>, b: Complex<V>) -> Complex<V> {
    Complex::new(a.re + b.re, a.im + b.im)
}

/// Their product.
#[inline(always)]
fn product<V>(a: Complex<V>, b: Complex<V>) -> Complex<V>
where
    V: Copy + Add<Output = V> + Sub<Output = V> + Mul<Output = V>,
{
    Complex::new(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re)
}

/// The part of the loop that does not depend on the gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Characteristic {
    /// `N(w)/z_gear` of the motor, of degree 6 at most.
    zeros: Polynomial,
    /// The screw's, where the position comes from there.
    screw_zeros: Option<Polynomial>,
    /// `P(w)`, of degree 5 at most.
    poles: Polynomial,
    period_s: f64,
    /// Degree of the closed loop's polynomial, 9 at most.
    degree: usize,
    /// That polynomial without a filter.
    unfiltered: ClosedPolynomial,
}

/// `z·f·w²·P(w) + B(w)`, linear in the gains.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ClosedPolynomial {
    /// `z·f·w²·P(w)`, the poles of the open loop.
    open: Polynomial,
    /// `B(w)` for 1 V/rad of K_p, 1 V/(rad s) of K_i, 1 V s/rad of K_d.
    per_gain: [Polynomial; 3],
}

impl Characteristic {
    pub(crate) fn new(axis: &LinearAxis, period_s: f64, delay_s: f64) -> Self {
        let z = Polynomial::new(&[1.0, 1.0]);
        // N(w) = present·z + past, and the gear between β and α.
        let response = |shaft: Shaft| {
            let pulse = PulseResponse::new(axis, shaft, period_s, delay_s);
            let zeros = pulse.present.times(&z).plus(&pulse.past);
            (pulse, zeros.scaled(1.0 / axis.gear_ratio))
        };
        let (PulseResponse { poles, .. }, motor) = response(Shaft::Motor);
        let screw = (axis.position_of == Shaft::Screw).then(|| response(Shaft::Screw).1);
        let zeros = [&screw.unwrap_or(motor), &motor];
        Self {
            zeros: motor,
            screw_zeros: screw,
            poles,
            period_s,
            degree: axis.states() + 3,
            unfiltered: ClosedPolynomial::new(zeros, &poles, period_s, 1.0),
        }
    }

    /// `L(e^{jθ})` of the loop with `gains`.
    #[inline]
    pub(crate) fn at(&self, gains: &LoopGains, theta: f64) -> Complex<f64> {
        self.at_each(One, gains.in_order(), on_circle(theta))
    }

    /// The same of loops side by side, each with gains and a `w = e^{jθ} − 1` of its own.
    #[inline(always)]
    pub(crate) fn at_each<W: Width>(
        &self,
        width: W,
        [kp, ki, kd, smoothing]: [W::Vector; 4],
        w: Complex<W::Vector>,
    ) -> Complex<W::Vector> {
        let period_s = width.splat(self.period_s);
        let scaled = |a: Complex<W::Vector>, by| Complex::new(a.re * by, a.im * by);
        let (z, f) = (
            Complex::new(w.re + width.splat(1.0), w.im),
            Complex::new(w.re + smoothing, w.im),
        );
        let (fw, zf, ww) = (product(f, w), product(z, f), product(w, w));
        let (i, d) = (ki * period_s, kd * smoothing / period_s);
        let held = sum(scaled(fw, kp), scaled(zf, i));
        let motor = self.zeros.at::<6, W>(width, w);
        let b = match &self.screw_zeros {
            None => product(sum(held, scaled(ww, d)), motor),
            Some(screw) => sum(
                product(held, screw.at::<6, W>(width, w)),
                product(scaled(ww, d), motor),
            ),
        };
        let a = product(product(zf, ww), self.poles.at::<5, W>(width, w));
        let size = a.re * a.re + a.im * a.im;
        Complex::new(
            (b.re * a.re + b.im * a.im) / size,
            (b.im * a.re - b.re * a.im) / size,
        )
    }

    /// `L(e^{jθ})` of each gain alone, without a filter.
    pub(crate) fn parts(&self, theta: f64) -> [Complex<f64>; 3] {
        let w = on_circle(theta);
        let z = w + 1.0;
        let poles = z * w * self.poles.at::<5, One>(One, w);
        let motor = self.zeros.at::<6, One>(One, w) / poles;
        let held = match &self.screw_zeros {
            None => motor,
            Some(screw) => screw.at::<6, One>(One, w) / poles,
        };
        [
            held,
            held * (z / w * self.period_s),
            motor * (w / z / self.period_s),
        ]
    }

    /// True if the closed loop comes to rest by itself. Without K_i the
    /// integrator drives nothing and is left out; without K_p and K_i nothing
    /// holds the axis in place, and the loop is not stable.
    pub(crate) fn is_stable(&self, gains: &LoopGains) -> bool {
        let filtered = (gains.smoothing != 1.0).then(|| {
            let held = self.screw_zeros.unwrap_or(self.zeros);
            let (zeros, poles) = ([&held, &self.zeros], &self.poles);
            ClosedPolynomial::new(zeros, poles, self.period_s, gains.smoothing)
        });
        let ClosedPolynomial { open, per_gain } = filtered.as_ref().unwrap_or(&self.unfiltered);
        let [p, i, d] = per_gain;
        let (kp, ki, kd) = (gains.kp_v_per_rad, gains.ki_v_per_rads, gains.kd_vs_per_rad);
        let closed: [f64; DEGREE + 1] =
            core::array::from_fn(|k| open.0[k] + (kp * p.0[k] + ki * i.0[k] + kd * d.0[k]));
        let first = usize::from(ki == 0.0);
        all_roots_within_circle(&closed[first..=self.degree])
    }
}

impl ClosedPolynomial {
    /// From `N(w)/z_gear` of what K_p and K_i see and of the motor, and from P(w).
    fn new(
        [held, motor]: [&Polynomial; 2],
        poles: &Polynomial,
        period_s: f64,
        smoothing: f64,
    ) -> Self {
        let z = Polynomial::new(&[1.0, 1.0]);
        let w = Polynomial::new(&[0.0, 1.0]);
        let f = Polynomial::new(&[smoothing, 1.0]);
        let (fw, zf, ww) = (f.times(&w), z.times(&f), w.times(&w));
        Self {
            open: zf.times(&ww).times(poles),
            per_gain: [
                fw.times(held),
                zf.times(held).scaled(period_s),
                ww.times(motor).scaled(smoothing / period_s),
            ],
        }
    }
}
