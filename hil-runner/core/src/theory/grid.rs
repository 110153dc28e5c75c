//! The response of a family of loops on a grid of frequencies: L is linear in
//! the three gains, so each part is kept and a run costs three products a
//! point.

use core::f64::consts::PI;

use nalgebra::Complex;

use super::characteristic::Characteristic;
use super::curve::Curve;
use super::gains::LoopGains;
use super::margin::{Margin, modulus};
use super::refine::{Limits, bends, refined};

/// An axis of the paper's kind needs about a hundred points.
const LIMITS: Limits = Limits {
    most: 512,
    closest: 1e-8,
};
/// Most points below the grid.
const MOST_BELOW: usize = 320;
/// Ratio of neighbouring frequencies before anything is refined, and their
/// largest distance \[rad\], for a delay of a sample or two.
const RATIO: f64 = 1.2;
const DISTANCE: f64 = 0.12;
/// The parts of `L(e^{jθ})` for K_p, K_i and K_d at angles θ = ωΔt up to π.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grid {
    theta: Vec<f64>,
    re: [Vec<f64>; 3],
    im: [Vec<f64>; 3],
}

impl Grid {
    pub(crate) fn new(
        characteristic: &Characteristic,
        corners_radps: &[f64; 4],
        period_s: f64,
    ) -> Self {
        let theta = angles(characteristic, corners_radps, period_s);
        let mut grid = Self {
            theta: Vec::new(),
            re: Default::default(),
            im: Default::default(),
        };
        for theta in theta {
            grid.push(characteristic, theta);
        }
        grid
    }

    fn push(&mut self, characteristic: &Characteristic, theta: f64) {
        self.theta.push(theta);
        for (k, part) in characteristic.parts(theta).iter().enumerate() {
            self.re[k].push(part.re);
            // In the middle of the spectrum every response is real.
            self.im[k].push(if theta == PI { 0.0 } else { part.im });
        }
    }

    /// The margins of the loop with `gains`; `at` is L between the points.
    pub(crate) fn margin(
        &self,
        gains: &LoopGains,
        at: &impl Fn(f64) -> Complex<f64>,
        stable: bool,
        period_s: f64,
    ) -> Margin {
        let mut margin = self.with_curve(gains, at, |curve| Margin::of(curve, stable));
        margin.weakest_radps /= period_s;
        margin.crossover_radps = margin.crossover_radps.map(|theta| theta / period_s);
        margin
    }

    /// `min |1 + L|` of the loop with `gains`.
    pub(crate) fn modulus(&self, gains: &LoopGains, at: &impl Fn(f64) -> Complex<f64>) -> f64 {
        self.with_curve(gains, at, |curve| modulus(curve))
    }

    /// L on the grid, carried on below it until |L| is above 2: a loop with
    /// very small gains crosses over below the axis' own frequencies.
    fn with_curve<F: Fn(f64) -> Complex<f64>, T>(
        &self,
        gains: &LoopGains,
        at: &F,
        use_curve: impl FnOnce(&Curve<'_, F>) -> T,
    ) -> T {
        let (re, im) = (combine(&self.re, gains), combine(&self.im, gains));
        if re[0] * re[0] + im[0] * im[0] > 4.0 {
            return use_curve(&Curve {
                frequency: &self.theta,
                re: &re,
                im: &im,
                at,
                ends_real: true,
            });
        }
        let mut below = Vec::new();
        let mut theta = self.theta[0];
        for _ in 0..MOST_BELOW {
            theta /= RATIO;
            let value = at(theta);
            below.push((theta, value));
            if value.norm_sqr() > 4.0 {
                break;
            }
        }
        below.reverse();
        let chain = |of: fn(&(f64, Complex<f64>)) -> f64, rest: &[f64]| -> Vec<f64> {
            below.iter().map(of).chain(rest.iter().copied()).collect()
        };
        use_curve(&Curve {
            frequency: &chain(|(theta, _)| *theta, &self.theta),
            re: &chain(|(_, value)| value.re, &re),
            im: &chain(|(_, value)| value.im, &im),
            at,
            ends_real: true,
        })
    }
}

/// `kp·P + ki·I + kd·D`, point by point.
fn combine(parts: &[Vec<f64>; 3], gains: &LoopGains) -> Vec<f64> {
    let (kp, ki, kd) = (gains.kp_v_per_rad, gains.ki_v_per_rads, gains.kd_vs_per_rad);
    let [p, i, d] = parts;
    let points = p.iter().zip(i).zip(d);
    points.map(|((p, i), d)| kp * p + ki * i + kd * d).collect()
}

/// Angles from far below the lowest corner to π, closer where the response
/// bends.
fn angles(characteristic: &Characteristic, corners_radps: &[f64; 4], period_s: f64) -> Vec<f64> {
    let slowest = corners_radps.iter().copied().fold(f64::INFINITY, f64::min);
    let mut theta = (slowest * period_s / 30.0).clamp(1e-12, 0.01);
    let mut base = Vec::new();
    while theta < PI {
        base.push(theta);
        theta = (theta * RATIO).min(theta + DISTANCE);
    }
    base.push(PI);
    // A frequency beyond the middle of the spectrum appears folded.
    let folded = corners_radps.map(|corner| {
        let turns = corner * period_s / (2.0 * PI);
        (turns - (turns + 0.5).floor()).abs() * 2.0 * PI
    });
    // The axis with K_p alone: K_i and K_d add a slope that is as smooth.
    let response = |theta: f64| characteristic.parts(theta)[0];
    let points = refined(base, &folded, LIMITS, response, bends);
    points.iter().map(|&(theta, _)| theta).collect()
}

#[cfg(test)]
impl Grid {
    pub(crate) fn points(&self) -> usize {
        self.theta.len()
    }
}
