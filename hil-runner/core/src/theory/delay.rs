//! Hold and delay to first order: the continuous loop with a pure delay.
//!
//! A zero-order hold delays by half a sample, the computation by τ. The
//! backward difference is the derivative of half a sample ago, and the sum that
//! includes the present error runs half a sample ahead of the integral
//! (`T·z/(z − 1) = 1/s + T/2 + …`):
//!
//! ```text
//! L(s) ≈ e^{−s(T/2+τ)}·(K_p + K_i/s·e^{sT/2} + K_d·s·e^{−sT/2})·K_0·α(s)/V(s)
//! ```
//!
//! (Franklin, Powell and Workman, "Digital Control of Dynamic Systems", 6.1;
//! Åström and Wittenmark, 8.2.) What is left out is of second order in T: the
//! error falls to a quarter when T is halved. Without T and τ it is the loop of
//! rung `continuous`.
//!
//! Stability of a loop with a delay follows from Nyquist's criterion: the
//! curve 1 + L is followed from low to high frequency, and its turns around 0
//! are counted.

use core::f64::consts::PI;

use nalgebra::Complex;

use super::characteristic::{LoopGains, is_papers_loop};
use super::curve::{Curve, Finds, Limits, Margin, Parts, bends, refined, rising};
use super::linear_axis::{JointState, LinearAxis};
use super::search::LaneByLane;
use crate::case::{Case, Law};
use crate::number::seconds;

/// The margins of a case as hold and delay change them to first order, with the
/// axis in contact; on rung `continuous` those of the paper's own loop. `None`
/// where the loop is not the paper's ([`is_papers_loop`]), or its delay or
/// sample time is not known.
pub fn margin_by_delay(case: &Case) -> Option<Margin> {
    let delayed = DelayedLoop::of(case, JointState::Contact)?;
    is_papers_loop(case).then(|| delayed.margin())
}

/// The continuous loop with a pure delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DelayedLoop {
    pub(crate) axis: LinearAxis,
    pub(crate) gains: LoopGains,
    /// `T`; 0 for the continuous law.
    pub(crate) period_s: f64,
    /// `τ`.
    pub(crate) delay_s: f64,
}

/// Largest lag between neighbouring frequencies \[rad\].
const LAG: f64 = 0.1;
/// The curve ends where |L| has fallen below this, beyond every corner.
const QUIET: f64 = 1e-3;
/// And begins where |L| is above this, below every corner.
const LOUD: f64 = 1e3;
/// Neighbours are divided until 1 + L turns by less than this between them
/// \[rad\], which no turn around 0 can hide in.
const TURN: f64 = 0.5;
/// Relative distance that a needle of an undamped joint may need.
const CLOSEST: f64 = 1e-10;
/// Points after which the curve is taken as it is.
const MOST_POINTS: usize = 10_000;

impl DelayedLoop {
    /// The loop of a case; on rung `continuous` the paper's own. None without such
    /// a joint, or where delay or sample time is not known.
    pub(crate) fn of(case: &Case, joint: JointState) -> Option<Self> {
        let (period_s, delay_s) = match case.controller.law {
            Law::Continuous => (0.0, 0.0),
            _ => (
                seconds(case.controller.sample_time_ns.filter(|&ns| ns > 0)?),
                seconds(case.controller.computation_delay.fixed_ns()?),
            ),
        };
        Some(Self {
            axis: LinearAxis::new(&case.axis, &case.amplifier, joint)?,
            gains: LoopGains::of(case),
            period_s,
            delay_s,
        })
    }

    /// `L(jω)`.
    pub(crate) fn at(&self, radps: f64) -> Complex<f64> {
        let s = Complex::new(0.0, radps);
        self.law(radps) * self.axis.response(s) / self.axis.gear_ratio
    }

    /// Volts per radian of error at the motor, hold and delay included.
    pub(crate) fn law(&self, radps: f64) -> Complex<f64> {
        let LoopGains {
            kp_v_per_rad: kp,
            ki_v_per_rads: ki,
            kd_vs_per_rad: kd,
            ..
        } = self.gains;
        let s = Complex::new(0.0, radps);
        let half = turn(-0.5 * radps * self.period_s);
        let lag = half * turn(-radps * self.delay_s);
        (half.conj() * ki / s + half * s * kd + kp) * lag
    }

    /// The margins.
    pub(crate) fn margin(&self) -> Margin {
        let points = self.points();
        let frequency: Vec<f64> = points.iter().map(|(radps, _)| *radps).collect();
        let (mut l, mut finds) = (Parts::default(), Finds::default());
        points.iter().for_each(|(_, value)| l.push(*value));
        let curve = Curve {
            frequency: &frequency,
            l: &l,
            ends_real: false,
        };
        finds.add(&curve, self.is_stable(&points));
        finds.search(&LaneByLane(|_, radps| self.at(radps)));
        finds.margins()[0]
    }

    /// L at rising frequencies, close enough that 1 + L hides no turn.
    fn points(&self) -> Vec<(f64, Complex<f64>)> {
        let corners = self.axis.corners_radps();
        let slowest = corners.iter().copied().fold(f64::INFINITY, f64::min);
        let fastest = corners.iter().copied().fold(0.0, f64::max);
        let mut radps = slowest / 30.0;
        for _ in 0..MOST_POINTS {
            if self.at(radps).norm_sqr() > LOUD * LOUD {
                break;
            }
            radps /= 2.0;
        }
        let step = LAG / (self.period_s + self.delay_s);
        let mut base = Vec::new();
        for radps in rising(radps, step).take(MOST_POINTS) {
            base.push(radps);
            if radps > 3.0 * fastest && self.at(radps).norm_sqr() < QUIET * QUIET {
                break;
            }
        }
        let rough = |from: Complex<f64>, middle, to: Complex<f64>| {
            bends(from, middle, to) || argument((to + 1.0) * (from + 1.0).conj()).abs() > TURN
        };
        let limits = Limits {
            most: 2 * MOST_POINTS,
            closest: CLOSEST,
        };
        refined(base, &corners, limits, |radps| self.at(radps), rough)
    }

    /// Nyquist's criterion for a loop whose only poles that do not decay are
    /// the integrators at s = 0: 1 + L comes from there, at −π/2 for each, and
    /// must have turned to 0 when L has died away. What is missing are two
    /// unstable poles for every 2π. On the way to the first point L is large
    /// and turns by less than half a turn.
    fn is_stable(&self, points: &[(f64, Complex<f64>)]) -> bool {
        let held = self.gains.kp_v_per_rad != 0.0 || self.gains.ki_v_per_rads != 0.0;
        let first = argument(points[0].1 + 1.0);
        let mut turned = first;
        // One is the law's, one or two are the axis': at −π/2, ±π or −3π/2.
        if first > PI / 4.0 {
            turned -= 2.0 * PI;
        }
        for pair in points.windows(2) {
            turned += argument((pair[1].1 + 1.0) * (pair[0].1 + 1.0).conj());
        }
        held && turned > -PI / 2.0
    }
}

/// `e^{jφ}`.
fn turn(phi: f64) -> Complex<f64> {
    let (sin, cos) = libm::sincos(phi);
    Complex::new(cos, sin)
}

fn argument(value: Complex<f64>) -> f64 {
    libm::atan2(value.im, value.re)
}
