//! Dynamic stiffness of the controlled axis against a force on the carriage.
//!
//! A force `F·e^{jωt}` moves the axis alone by `G_xF(jω)·F`, and what the controller
//! sees of it, `G_αF(jω)·F`, it sees at the samples, as a sequence of θ = ωT. The codes
//! answer with the same θ, and around the sampled loop `L = C·P(e^{jθ})`
//!
//! ```text
//! α = G_αF·F + P·u,   u = −C·α      ⇒      u = −C·G_αF·F/(1 + L)
//! ```
//!
//! Held, and late by τ, they act with the fundamental `H·u` and its images at
//! ω + 2πk/T, which are left out:
//!
//! ```text
//! x/F = G_xF − G_xu·H·C·G_αF/(1 + L)      H = (1 − e^{−jθ})/(jθ)·e^{−jωτ}
//! ```
//!
//! (Åström and Wittenmark, "Computer-Controlled Systems", 7.3, response of a sampled
//! system to a sine; Franklin, Powell and Workman, "Digital Control of Dynamic
//! Systems", 5.3, the hold's spectrum.) The stiffness is |F/x|. With K_i it grows without
//! bound at low frequencies, as the carriage's inertia makes it at high ones; without, it
//! is finite at ω = 0. Where the position comes from the load's encoder, K_p and K_i see
//! γ/z instead of α.

use nalgebra::Complex;

use super::characteristic::LoopGains;
use super::curve::Curve;
use super::family::{FamilyKey, LoopFamily, Parts};
use super::held::on_circle;
use super::linear_axis::{LinearAxis, Shaft};

/// `x/F` of all loops of a family, on its grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Compliance {
    axis: LinearAxis,
    period_s: f64,
    delay_s: f64,
    /// `G_xF` \[m/N\].
    free: Parts,
    /// `G_xu·H·C·G_αF` of each gain alone, without a filter.
    parts: [Parts; 3],
}

/// Ratio of frequencies below the grid, and their largest number.
const RATIO: f64 = 1.2;
const MOST_BELOW: usize = 320;
/// They end where |L| is above this: the stiffness without K_i is there its static one
/// but for 1e-8.
const LOUD: f64 = 1e4;

impl Compliance {
    pub(crate) fn new(key: &FamilyKey, family: &LoopFamily) -> Self {
        Self::of_axis(&key.axis, key.timing_s(), family)
    }

    /// The same of a family that has no case.
    pub(crate) fn of_axis(
        axis: &LinearAxis,
        [period_s, delay_s]: [f64; 2],
        family: &LoopFamily,
    ) -> Self {
        let mut compliance = Self {
            axis: *axis,
            period_s,
            delay_s,
            free: Parts::default(),
            parts: Default::default(),
        };
        for &theta in &family.theta {
            let (free, parts) = compliance.parts_at(theta);
            compliance.free.push(free);
            for (of, part) in compliance.parts.iter_mut().zip(parts) {
                of.push(part);
            }
        }
        compliance
    }

    /// `G_xF`, and `G_xu·H·C·G_αF` of each gain alone.
    fn parts_at(&self, theta: f64) -> (Complex<f64>, [Complex<f64>; 3]) {
        let (axis, t) = (&self.axis, self.period_s);
        let s = Complex::new(0.0, theta / t);
        let [gear, screw] = axis.answers(s);
        let [screw_per_command, screw_per_force] = screw;
        let (per_command, free) = (
            screw_per_command * axis.pitch_m_per_rad,
            screw_per_force * axis.pitch_m_per_rad,
        );
        let motor = gear[1] / axis.gear_ratio;
        let position = match axis.position_of {
            Shaft::Motor => motor,
            Shaft::Screw => screw_per_force / axis.gear_ratio,
        };
        let w = on_circle(theta);
        let z = w + 1.0;
        let (sin, cos) = libm::sincos(theta * (self.delay_s / t));
        // 1 − e^{−jθ} = −w*
        let hold = -w.conj() / Complex::new(0.0, theta) * Complex::new(cos, -sin);
        let acts = per_command * hold;
        let held = acts * position;
        (free, [held, held * (z / w * t), acts * motor * (w / z / t)])
    }

    /// `x/F` at an angle \[m/N\].
    pub(crate) fn at(&self, family: &LoopFamily, gains: &LoopGains, theta: f64) -> Complex<f64> {
        let (free, [p, i, d]) = self.parts_at(theta);
        let w = on_circle(theta);
        let a = gains.smoothing;
        let filter = (w + 1.0) * a / (w + a);
        let fed_back =
            p * gains.kp_v_per_rad + i * gains.ki_v_per_rads + d * filter * gains.kd_vs_per_rad;
        free - fed_back / (family.at(gains, theta) + 1.0)
    }

    /// The least stiffness up to the middle of the sampled spectrum \[N/µm\], of a loop
    /// that is stable.
    pub(crate) fn least_n_per_um(&self, family: &LoopFamily, gains: &LoopGains) -> f64 {
        let (fed_back, l) = (
            family.combine(&self.parts, gains),
            family.combine(&family.parts, gains),
        );
        let points = 0..family.theta.len();
        let on_grid: Vec<Complex<f64>> = points
            .map(|k| {
                let fed_back = Complex::new(fed_back.re[k], fed_back.im[k]);
                let free = Complex::new(self.free.re[k], self.free.im[k]);
                free - fed_back / Complex::new(1.0 + l.re[k], l.im[k])
            })
            .collect();
        let largest = |points: &[Complex<f64>]| {
            let sizes = points.iter().map(Complex::norm_sqr).enumerate();
            sizes.fold(
                (0, 0.0),
                |most, here| if here.1 > most.1 { here } else { most },
            )
        };
        let (place, size) = largest(&on_grid);
        if place > 0 {
            return self.least_on(family, gains, &family.theta, &on_grid, size);
        }
        let (mut theta, mut lower) = (family.theta[0], Vec::new());
        for _ in 0..MOST_BELOW {
            theta /= RATIO;
            lower.push((theta, self.at(family, gains, theta)));
            if family.at(gains, theta).norm_sqr() > LOUD * LOUD {
                break;
            }
        }
        let lower = || lower.iter().rev();
        let theta: Vec<f64> = lower()
            .map(|at| at.0)
            .chain(family.theta.iter().copied())
            .collect();
        let points: Vec<Complex<f64>> = lower().map(|at| at.1).chain(on_grid).collect();
        let (_, size) = largest(&points);
        self.least_on(family, gains, &theta, &points, size)
    }

    /// The same from `x/F` at rising angles, the largest squared size of which is known:
    /// `|F/x|` in units of the least is the distance of `F/x − 1` from −1.
    fn least_on(
        &self,
        family: &LoopFamily,
        gains: &LoopGains,
        theta: &[f64],
        compliance: &[Complex<f64>],
        largest_squared: f64,
    ) -> f64 {
        let unit = largest_squared.sqrt();
        let stiffness = |compliance: Complex<f64>| compliance.inv() * unit - 1.0;
        let at = |theta: f64| stiffness(self.at(family, gains, theta));
        let points: Vec<Complex<f64>> = compliance.iter().map(|&x| stiffness(x)).collect();
        let re: Vec<f64> = points.iter().map(|point| point.re).collect();
        let im: Vec<f64> = points.iter().map(|point| point.im).collect();
        let curve = Curve {
            frequency: theta,
            re: &re,
            im: &im,
            at: &at,
            ends_real: false,
        };
        1e-6 * curve.modulus() / unit
    }
}
