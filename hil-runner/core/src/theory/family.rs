//! The loops of one axis and one timing, and the margins of a case.
//!
//! L is linear in the three gains: each part is kept on a grid of frequencies, and
//! a loop costs three products a point. The derivative's filter is a factor of its
//! part, so that it is open as the gains are.

use core::f64::consts::PI;

use nalgebra::Complex;
use plant::{One, Width, widest, with_four};

use super::characteristic::{Characteristic, LoopGains};
use super::curve::{Curve, Finds, Limits, Margin, Parts, RATIO, bends, refined, rising, signed};
use super::held::on_circle;
use super::linear_axis::{JointState, LinearAxis, Shaft};
use super::search::{Response, by_lane, gathered};
use crate::case::Case;
use crate::number::seconds;

/// An axis of the paper's kind needs about a hundred points.
const LIMITS: Limits = Limits {
    most: 512,
    closest: 1e-8,
};
/// Most points below the grid.
const MOST_BELOW: usize = 320;
/// Largest distance of neighbouring frequencies before anything is refined \[rad\], for a
/// delay of a sample or two.
const DISTANCE: f64 = 0.12;

/// All loops of one axis, kind of drive, encoders of position, sample time, delay and
/// state of the joint: gains, the derivative's filter, encoder steps, converter and the
/// amplifier's gain are open.
///
/// ```
/// use hil_core::runfile;
/// use hil_core::theory::{JointState, LoopFamily, LoopGains};
///
/// let case = runfile::builtin("paper-2", &[])?;
/// let family = LoopFamily::of(&case, JointState::Contact).ok_or("no loop")?;
/// let gains = LoopGains::of(&case);
/// assert!(family.margin(&gains).stable);
/// assert!(!family.margin(&gains.times(200.0)).stable);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct LoopFamily {
    pub(super) axis: LinearAxis,
    pub(super) period_s: f64,
    pub(super) delay_s: f64,
    characteristic: Characteristic,
    /// Angles θ = ωΔt up to π.
    pub(super) theta: Vec<f64>,
    /// The parts of `L(e^{jθ})` for K_p, K_i and K_d.
    pub(super) parts: [Parts; 3],
    /// `w = e^{jθ} − 1`.
    w: Parts,
}

/// Everything that a family depends on: equal for two families exactly if they are the
/// same. b, dry and quadratic resistance, motion and everything that is open have no part
/// in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FamilyKey {
    axis: LinearAxis,
    timing_ns: [u64; 2],
}

impl FamilyKey {
    /// The key of a case's family; none where it has no fixed sample time above 0 with a
    /// delay no longer than it, or no such loop.
    pub fn of(case: &Case, joint: JointState) -> Option<Self> {
        let period_ns = case.controller.sample_time_ns.filter(|&ns| ns > 0)?;
        let delay_ns = case.controller.computation_delay.fixed_ns()?;
        let axis = LinearAxis::of(case, joint)?;
        (delay_ns <= period_ns).then_some(Self {
            axis,
            timing_ns: [period_ns, delay_ns],
        })
    }

    /// The family.
    pub(super) fn family(&self) -> LoopFamily {
        let [period_s, delay_s] = self.timing_ns.map(seconds);
        LoopFamily::of_axis(&self.axis, period_s, delay_s)
    }
}

impl LoopFamily {
    /// Works out the responses on a grid of frequencies and the characteristic
    /// polynomial: some ten microseconds to a millisecond.
    pub(crate) fn of_axis(axis: &LinearAxis, period_s: f64, delay_s: f64) -> Self {
        let characteristic = Characteristic::new(axis, period_s, delay_s);
        let mut family = Self {
            axis: *axis,
            period_s,
            delay_s,
            theta: angles(&characteristic, axis, period_s),
            characteristic,
            parts: Default::default(),
            w: Parts::default(),
        };
        for &theta in &family.theta {
            // In the middle of the spectrum every response is real.
            let real = |value: Complex<f64>| match theta == PI {
                true => Complex::from(value.re),
                false => value,
            };
            for (of, part) in family.parts.iter_mut().zip(characteristic.parts(theta)) {
                of.push(real(part));
            }
            family.w.push(real(on_circle(theta)));
        }
        family
    }

    /// The family of a case; none where it has no [`FamilyKey`].
    pub fn of(case: &Case, joint: JointState) -> Option<Self> {
        Some(FamilyKey::of(case, joint)?.family())
    }

    /// The margins of the closed loop: a microsecond or two.
    pub fn margin(&self, gains: &LoopGains) -> Margin {
        self.margins(&mut Room::default(), &[*gains])[0]
    }

    /// Those of several, each as by itself: side by side they take less.
    pub(super) fn margins(&self, room: &mut Room, gains: &[LoopGains]) -> Vec<Margin> {
        self.search(room, gains, |finds, curve, gains| {
            finds.add(curve, self.is_stable(gains));
        });
        let mut margins = room.finds.margins();
        for margin in &mut margins {
            margin.weakest_radps /= self.period_s;
            for frequency in [&mut margin.crossover_radps, &mut margin.bandwidth_radps] {
                *frequency = frequency.map(|theta| theta / self.period_s);
            }
        }
        margins
    }

    /// [`Margin::signed`] alone, without a look at phase and gain.
    pub fn signed_modulus(&self, gains: &LoopGains) -> f64 {
        self.signed_modulus_in(&mut Room::default(), gains)
    }

    /// The same in room that is there already.
    pub(super) fn signed_modulus_in(&self, room: &mut Room, gains: &LoopGains) -> f64 {
        self.search(room, &[*gains], |finds, curve, _| finds.add_modulus(curve));
        let distance = room.finds.moduli()[0];
        signed(self.is_stable(gains), distance)
    }

    /// True if the closed loop is stable: a twentieth of the time of
    /// [`Self::margin`].
    pub fn is_stable(&self, gains: &LoopGains) -> bool {
        self.characteristic.is_stable(gains)
    }

    /// `L(e^{jθ})`.
    pub(crate) fn at(&self, gains: &LoopGains, theta: f64) -> Complex<f64> {
        self.characteristic.at(gains, theta)
    }

    /// The same from `w = e^{jθ} − 1`.
    pub(super) fn at_circle(&self, gains: &LoopGains, w: Complex<f64>) -> Complex<f64> {
        self.characteristic.at_each(One, gains.in_order(), w)
    }

    /// Searches the curves of loops with `gains` for what `add` looks for on each.
    fn search(
        &self,
        room: &mut Room,
        gains: &[LoopGains],
        add: impl Fn(&mut Finds, &Curve<'_>, &LoopGains),
    ) {
        room.finds.clear();
        for of_loop in gains {
            let l = &mut room.l;
            self.combine(&self.parts, of_loop, l);
            let with_lower;
            let mut theta = &self.theta;
            if l.point(0).norm_sqr() <= 4.0 {
                with_lower = self.carried_on(&self.below(of_loop, 2.0), l);
                theta = &with_lower;
            }
            let curve = Curve {
                frequency: theta,
                l,
                ends_real: true,
            };
            add(&mut room.finds, &curve, of_loop);
        }
        let loops = SideBySide {
            characteristic: &self.characteristic,
            gains,
        };
        room.finds.search(&loops);
    }

    /// Rising angles below the grid, from one at which |L| is above `loud`, and L there: a
    /// loop with very small gains crosses over below the axis' own frequencies.
    pub(super) fn below(&self, gains: &LoopGains, loud: f64) -> Vec<(f64, Complex<f64>)> {
        let mut below = Vec::new();
        let mut theta = self.theta[0];
        for _ in 0..MOST_BELOW {
            theta /= RATIO;
            let value = self.at(gains, theta);
            below.push((theta, value));
            if value.norm_sqr() > loud * loud {
                break;
            }
        }
        below.reverse();
        below
    }

    /// Carries a curve on the grid on to what is below; all of its angles.
    pub(super) fn carried_on(&self, below: &[(f64, Complex<f64>)], curve: &mut Parts) -> Vec<f64> {
        let (re, im) = (&mut curve.re, &mut curve.im);
        re.splice(0..0, below.iter().map(|(_, value)| value.re));
        im.splice(0..0, below.iter().map(|(_, value)| value.im));
        let angles = below.iter().map(|(theta, _)| *theta);
        angles.chain(self.theta.iter().copied()).collect()
    }

    /// `kp·P + ki·I + kd·F·D` on the grid, with the filter `F = a·z/(w + a)` of the
    /// derivative.
    pub(super) fn combine(&self, parts: &[Parts; 3], gains: &LoopGains, sum: &mut Parts) {
        let [p, i, d] = parts;
        let filtered = (gains.smoothing != 1.0).then(|| filtered(d, &self.w, gains.smoothing));
        let d = filtered.as_ref().unwrap_or(d);
        with_four(
            widest(),
            #[inline(always)]
            || {
                combine([&p.re, &i.re, &d.re], gains, &mut sum.re);
                combine([&p.im, &i.im, &d.im], gains, &mut sum.im);
            },
        );
    }
}

/// Loops of a family with gains of their own.
struct SideBySide<'a> {
    characteristic: &'a Characteristic,
    gains: &'a [LoopGains],
}

impl Response for SideBySide<'_> {
    #[inline(always)]
    fn at<W: Width>(&self, w: W, runs: &[usize], theta: W::Vector) -> Complex<W::Vector> {
        let gain = |k: usize| gathered(w, runs, |&run| self.gains[run].in_order()[k]);
        let gains = [0, 1, 2, 3].map(gain);
        let on_circle = by_lane(w, runs.len(), theta, |_, theta| on_circle(theta));
        self.characteristic.at_each(w, gains, on_circle)
    }
}

/// Room for the curves of one loop, kept for the next.
#[derive(Debug, Default)]
pub(super) struct Room {
    /// L on the grid.
    pub(super) l: Parts,
    /// What the stiffness has on the grid.
    pub(super) compliance: Parts,
    pub(super) stiffness: Parts,
    pub(super) finds: Finds,
}

/// `kp·P + ki·I + kd·D`, point by point.
#[inline(always)]
fn combine([p, i, d]: [&[f64]; 3], gains: &LoopGains, sum: &mut Vec<f64>) {
    let (kp, ki, kd) = (gains.kp_v_per_rad, gains.ki_v_per_rads, gains.kd_vs_per_rad);
    sum.resize(p.len(), 0.0);
    for (((sum, p), i), d) in sum.iter_mut().zip(p).zip(i).zip(d) {
        *sum = kp * p + ki * i + kd * d;
    }
}

/// `a·z/(w + a)·D`, point by point:
/// `a·((1 + w)·(w* + a))/|w + a|² = a·((1 + u)·(u + a) + v² − j·v·(1 − a))/|w + a|²`
/// with w = u + jv.
fn filtered(d: &Parts, w: &Parts, a: f64) -> Parts {
    let mut filtered = Parts::default();
    for i in 0..d.re.len() {
        let Complex { re: u, im: v } = w.point(i);
        let scale = a / ((u + a) * (u + a) + v * v);
        let filter = Complex::new(
            scale * ((1.0 + u) * (u + a) + v * v),
            scale * (v * (a - 1.0)),
        );
        filtered.push(filter * d.point(i));
    }
    filtered
}

/// Angles from far below the lowest corner to π, closer where the response
/// bends.
fn angles(characteristic: &Characteristic, axis: &LinearAxis, period_s: f64) -> Vec<f64> {
    let corners_radps = axis.corners_radps();
    let slowest = corners_radps.iter().copied().fold(f64::INFINITY, f64::min);
    let first = (slowest * period_s / 30.0).clamp(1e-12, 0.01);
    let base = rising(first, DISTANCE).take_while(|&theta| theta < PI);
    // A frequency beyond the middle of the spectrum appears folded.
    let folded = corners_radps.map(|corner| {
        let turns = corner * period_s / (2.0 * PI);
        (turns - (turns + 0.5).floor()).abs() * 2.0 * PI
    });
    // The axis with K_p alone: K_i and K_d add a slope that is as smooth.
    let of_part = |base: Vec<f64>, part: usize| -> Vec<f64> {
        let response = |theta: f64| characteristic.parts(theta)[part];
        let points = refined(base, &folded, LIMITS, response, bends);
        points.iter().map(|&(theta, _)| theta).collect()
    };
    let theta = of_part(base.chain([PI]).collect(), 0);
    match axis.position_of {
        Shaft::Motor => theta,
        // What K_d sees bends elsewhere.
        Shaft::Screw => of_part(theta, 2),
    }
}
