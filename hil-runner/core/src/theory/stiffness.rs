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

use core::ops::Range;

use nalgebra::Complex;
use plant::{widest, with_four};

use super::characteristic::LoopGains;
use super::curve::{Curve, NEAR, Parts};
use super::family::{LoopFamily, Room};
use super::held::on_circle;
use super::linear_axis::Shaft;
use super::search::LaneByLane;

/// `x/F` of all loops of a family, on its grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Compliance {
    /// `G_xF` \[m/N\].
    free: Parts,
    /// `G_xu·H·C·G_αF` of each gain alone, without a filter.
    parts: [Parts; 3],
}

/// Frequencies below the grid begin where |L| is above this: the stiffness without K_i is
/// there its static one but for 1e-8.
const LOUD: f64 = 1e4;

impl Compliance {
    pub(crate) fn new(family: &LoopFamily) -> Self {
        let mut compliance = Self {
            free: Parts::default(),
            parts: Default::default(),
        };
        for &theta in &family.theta {
            let (free, parts) = Self::parts_at(family, theta, on_circle(theta));
            compliance.free.push(free);
            for (of, part) in compliance.parts.iter_mut().zip(parts) {
                of.push(part);
            }
        }
        compliance
    }

    /// `x/F` at an angle \[m/N\].
    pub(crate) fn at(family: &LoopFamily, gains: &LoopGains, theta: f64) -> Complex<f64> {
        let w = on_circle(theta);
        let (free, [p, i, d]) = Self::parts_at(family, theta, w);
        let a = gains.smoothing;
        let filter = (w + 1.0) * a / (w + a);
        let fed_back =
            p * gains.kp_v_per_rad + i * gains.ki_v_per_rads + d * filter * gains.kd_vs_per_rad;
        free - fed_back / (family.at_circle(gains, w) + 1.0)
    }

    /// `G_xF`, and `G_xu·H·C·G_αF` of each gain alone, at an angle and its `w = e^{jθ} − 1`.
    fn parts_at(
        family: &LoopFamily,
        theta: f64,
        w: Complex<f64>,
    ) -> (Complex<f64>, [Complex<f64>; 3]) {
        let (axis, t) = (&family.axis, family.period_s);
        let s = Complex::new(0.0, theta / t);
        let [[_, gear_per_force], [screw_per_command, screw_per_force]] = axis.answers(s);
        let [per_command, free] =
            [screw_per_command, screw_per_force].map(|screw| screw * axis.pitch_m_per_rad);
        let motor = gear_per_force / axis.gear_ratio;
        let position = match axis.position_of {
            Shaft::Motor => motor,
            Shaft::Screw => screw_per_force / axis.gear_ratio,
        };
        let z = w + 1.0;
        let (sin, cos) = libm::sincos(theta * (family.delay_s / t));
        // 1 − e^{−jθ} = −w*
        let hold = -w.conj() / Complex::new(0.0, theta) * Complex::new(cos, -sin);
        let acts = per_command * hold;
        let held = acts * position;
        (free, [held, held * (z / w * t), acts * motor * (w / z / t)])
    }

    /// The least stiffness up to the middle of the sampled spectrum \[N/µm\] of each of
    /// some loops that are stable.
    pub(crate) fn least_n_per_um(
        &self,
        family: &LoopFamily,
        room: &mut Room,
        gains: &[LoopGains],
    ) -> Vec<f64> {
        room.finds.clear();
        let look = |gains: &LoopGains| self.look_over(family, room, gains);
        let units: Vec<f64> = gains.iter().map(look).collect();
        room.finds.search(&LaneByLane(|run: usize, theta| {
            in_units(Self::at(family, &gains[run], theta), units[run])
        }));
        let stiffness = |(modulus, unit): (f64, &f64)| 1e-6 * modulus / unit;
        let moduli = room.finds.moduli().into_iter();
        moduli.zip(&units).map(stiffness).collect()
    }

    /// Looks over the curve of `F/x − 1`, in units of the least |F/x|: the largest |x/F| of a
    /// point.
    fn look_over(&self, family: &LoopFamily, room: &mut Room, gains: &LoopGains) -> f64 {
        let Room {
            l,
            compliance,
            stiffness,
            finds,
        } = room;
        family.combine(&family.parts, gains, l);
        family.combine(&self.parts, gains, compliance);
        with_four(
            widest(),
            #[inline(always)]
            || closed(&self.free, l, compliance),
        );
        let (place, mut size) = largest(compliance);
        let mut theta = &family.theta;
        let with_lower;
        if place == 0 {
            let mut lower = family.below(gains, LOUD);
            for (theta, value) in &mut lower {
                *value = Self::at(family, gains, *theta);
            }
            with_lower = family.carried_on(&lower, compliance);
            theta = &with_lower;
            (_, size) = largest(compliance);
        }
        let (unit, near) = (size.sqrt(), near(compliance, size));
        stiffness.clear();
        for i in near.clone() {
            stiffness.push(in_units(compliance.point(i), unit));
        }
        finds.add_modulus(&Curve {
            frequency: &theta[near],
            l: stiffness,
            ends_real: false,
        });
        unit
    }
}

/// `F/x − 1` in units of the least, from x/F: |F/x| is its distance from −1.
fn in_units(compliance: Complex<f64>, unit: f64) -> Complex<f64> {
    compliance.inv() * unit - 1.0
}

/// `G_xF − C/(1 + L)` in the place of C, point by point.
#[inline(always)]
fn closed(free: &Parts, l: &Parts, compliance: &mut Parts) {
    let free = free.re.iter().zip(&free.im);
    let l = l.re.iter().zip(&l.im);
    let points = compliance.re.iter_mut().zip(&mut compliance.im);
    for (((re, im), (free_re, free_im)), (l_re, l_im)) in points.zip(free).zip(l) {
        let distance = Complex::new(1.0 + l_re, *l_im);
        let fed_back = Complex::new(*re, *im) / distance;
        (*re, *im) = (free_re - fed_back.re, free_im - fed_back.im);
    }
}

/// Place and squared size of the largest.
fn largest(points: &Parts) -> (usize, f64) {
    let sizes = points
        .re
        .iter()
        .zip(&points.im)
        .map(|(re, im)| re * re + im * im);
    let larger = |most: (usize, f64), next: (usize, f64)| if next.1 > most.1 { next } else { most };
    sizes.enumerate().fold((0, 0.0), larger)
}

/// The points within which the least stiffness is, and two more to each side: those at
/// which it may be half as large again as that of the largest `x/F`.
fn near(compliance: &Parts, largest_squared: f64) -> Range<usize> {
    let Parts { re, im } = compliance;
    let is_near = |&i: &usize| {
        let size = |i: usize| NEAR * (re[i] * re[i] + im[i] * im[i]);
        size(i) >= largest_squared
            || size(i + 1) >= largest_squared
            || re[i] * re[i + 1] + im[i] * im[i + 1] < 0.0
    };
    let chords = 0..re.len() - 1;
    let first = chords.clone().find(is_near).unwrap_or(0);
    let last = chords.clone().rfind(is_near).unwrap_or(chords.end);
    first.saturating_sub(2)..(last + 4).min(re.len())
}
