//! One step of the Dormand-Prince method of order 8(5,3), DOP853, with its
//! dense output of order 7.
//!
//! J. R. Dormand, P. J. Prince, "A family of embedded Runge-Kutta formulae",
//! J. Comput. Appl. Math. 6 (1980) 19-26; the pair of order 8 with the error
//! estimates of order 5 and 3 and its dense output from E. Hairer,
//! S. P. Nørsett, G. Wanner, "Solving Ordinary Differential Equations I", 2nd
//! ed., sections II.5, II.6 and II.10.
//!
//! The dense output takes three more derivatives than the step, and most steps
//! are never looked into: it is made when first asked for. Whether it need be
//! asked for is seen from [`Step::stray`].

use core::cell::OnceCell;

use super::table::*;
use crate::model::state::{Vector, gamma, gamma_dot};

/// Result of one trial step.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    pub(crate) start_s: f64,
    pub(crate) h: f64,
    pub(crate) y0: Vector,
    pub(crate) y1: Vector,
    /// Derivative at the end, also the first stage of the next step.
    pub(crate) f1: Vector,
    /// Derivatives of the twelve stages, the first at the start.
    stages: [Vector; 12],
    /// What the dense output needs besides the ends.
    dense: OnceCell<[Vector; 4]>,
}

/// How far a solution may be from the cubic through the ends of its step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Stray {
    pub(crate) states: Vector,
    /// Of γ = β − ε and γ̇, where what β and ε share drops out.
    pub(crate) gamma: f64,
    pub(crate) gamma_dot: f64,
}

/// `Σ weight·stage`.
#[inline(always)]
fn sum<const N: usize>(row: &Row<N>, stages: &[Vector]) -> Vector {
    let mut sum = Vector::zeros();
    for &(stage, weight) in row {
        sum += stages[stage] * weight;
    }
    sum
}

/// Takes one step of `dy/dt = f(t, y)` from `(t, y0)` with `f0 = f(t, y0)`.
#[inline(always)]
pub(crate) fn step(
    f: impl Fn(f64, &Vector) -> Vector,
    t: f64,
    y0: &Vector,
    f0: &Vector,
    h: f64,
) -> Step {
    let mut k = [*f0; 12];
    macro_rules! stage {
        ($i:literal, $row:ident) => {
            k[$i] = f(t + h * C[$i], &(y0 + sum(&$row, &k) * h));
        };
    }
    stage!(1, A1);
    stage!(2, A2);
    stage!(3, A3);
    stage!(4, A4);
    stage!(5, A5);
    stage!(6, A6);
    stage!(7, A7);
    stage!(8, A8);
    stage!(9, A9);
    stage!(10, A10);
    stage!(11, A11);
    let y1 = y0 + sum(&B, &k) * h;
    Step {
        start_s: t,
        h,
        y0: *y0,
        y1,
        f1: f(t + h, &y1),
        stages: k,
        dense: OnceCell::new(),
    }
}

impl Step {
    /// Derivative at the start.
    pub(crate) fn f0(&self) -> &Vector {
        &self.stages[0]
    }

    /// Differences to the embedded solutions of order 5 and 3.
    #[inline(always)]
    pub(crate) fn errors(&self) -> (Vector, Vector) {
        let (k, h) = (&self.stages, self.h);
        (sum(&E5, k) * h, sum(&E3, k) * h)
    }

    /// `∫ ẏ_i² dt` over the step, by the method itself: what the step would make
    /// of a further state with that rate.
    pub(crate) fn squared_rate(&self, state: usize) -> f64 {
        let mut sum = 0.0;
        for (stage, weight) in B {
            let rate = self.stages[stage][state];
            sum += weight * (rate * rate);
        }
        sum * self.h
    }

    /// How far the solution may be from the cubic through the ends of the
    /// step: less than this, by a factor of about two.
    ///
    /// The distance is zero at both ends, so half its steepest slope bounds it.
    /// That slope is taken at the five stages well inside the step that have
    /// more than a low order: times 1/4, 4/13, 0.6, 0.65 and 6/7.
    pub(crate) fn stray(&self) -> Stray {
        let h = self.h;
        let chord = self.y1 - self.y0;
        let (u, v) = (self.f0() * h - chord, self.f1 * h - chord);
        let mut stray = Stray::default();
        for stage in [6, 7, 8, 9, 10] {
            let c = C[stage];
            // Slope of `Δ·θ + (u·(1 − θ) − v·θ)·θ·(1 − θ)`.
            let slope = chord + u * ((1.0 - c) * (1.0 - 3.0 * c)) + v * (c * (3.0 * c - 2.0));
            let off = self.stages[stage] * h - slope;
            stray.states = stray.states.zip_map(&off, |r, o: f64| r.max(o.abs()));
            stray.gamma = stray.gamma.max(gamma(&off).abs());
            stray.gamma_dot = stray.gamma_dot.max(gamma_dot(&off).abs());
        }
        stray
    }

    /// State at `t + θ·h`, 0 ≤ θ ≤ 1, to seventh order; `f` as for the step.
    pub(crate) fn at(&self, f: impl Fn(f64, &Vector) -> Vector, theta: f64) -> Vector {
        let [d3, d4, d5, d6] = self.dense.get_or_init(|| self.dense(f));
        let (h, rest) = (self.h, 1.0 - theta);
        let chord = self.y1 - self.y0;
        let bend = self.f0() * h - chord;
        let twist = chord - self.f1 * h - bend;
        let inner = d3 + (d4 + (d5 + d6 * theta) * rest) * theta;
        self.y0 + (chord + (bend + (twist + inner * rest) * theta) * rest) * theta
    }

    #[cold]
    fn dense(&self, f: impl Fn(f64, &Vector) -> Vector) -> [Vector; 4] {
        let (t, y0, h) = (self.start_s, &self.y0, self.h);
        let mut k = [self.f1; 16];
        k[..12].copy_from_slice(&self.stages);
        k[13] = f(t + h * C[13], &(y0 + sum(&A13, &k) * h));
        k[14] = f(t + h * C[14], &(y0 + sum(&A14, &k) * h));
        k[15] = f(t + h * C[15], &(y0 + sum(&A15, &k) * h));
        [
            sum(&D3, &k) * h,
            sum(&D4, &k) * h,
            sum(&D5, &k) * h,
            sum(&D6, &k) * h,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `ẏ = y·cos t`, `y = exp(sin t)`.
    fn f(t: f64, y: &Vector) -> Vector {
        y * libm::cos(t)
    }

    fn exact(t: f64) -> f64 {
        libm::exp(libm::sin(t))
    }

    /// Global error at t = 2 in `n` equal steps, and the largest error of the
    /// dense output within the steps.
    fn errors(n: u32) -> (f64, f64) {
        let h = 2.0 / f64::from(n);
        let (mut y, mut worst) = (Vector::repeat(1.0), 0.0_f64);
        for i in 0..n {
            let t = f64::from(i) * h;
            let step = step(f, t, &y, &f(t, &y), h);
            for theta in [0.3, 0.5, 0.85] {
                worst = worst.max((step.at(f, theta)[0] - exact(t + theta * h)).abs());
            }
            y = step.y1;
        }
        ((y[0] - exact(2.0)).abs(), worst)
    }

    #[test]
    fn converges_with_order_eight_and_dense_output_seven() {
        let ((coarse, coarse_dense), (fine, fine_dense)) = (errors(4), errors(8));
        let (order, dense_order) = ((coarse / fine).log2(), (coarse_dense / fine_dense).log2());
        assert!((7.5..=9.5).contains(&order), "order {order}");
        assert!(
            (6.6..=8.8).contains(&dense_order),
            "dense order {dense_order}"
        );
    }

    /// The estimates go with h⁶ and h⁴ in one step, whatever the instant.
    #[test]
    fn estimates_have_their_orders() {
        let of = |h: f64| {
            (0..20).fold((0.0, 0.0), |(fifth, third), i| {
                let t = 0.1 * f64::from(i);
                let y0 = Vector::repeat(exact(t));
                let (e5, e3) = step(f, t, &y0, &f(t, &y0), h).errors();
                (fifth + e5[0].abs(), third + e3[0].abs())
            })
        };
        let (coarse, fine) = (of(0.2), of(0.1));
        let (fifth, third) = ((coarse.0 / fine.0).log2(), (coarse.1 / fine.1).log2());
        assert!((5.5..=6.5).contains(&fifth), "order {fifth}");
        assert!((3.5..=4.5).contains(&third), "order {third}");
    }

    /// The distance from the cubic is within reach, and the reach not wide.
    #[test]
    fn reach_bounds_the_distance_from_the_cubic() {
        for (t, h) in [(0.0, 0.5), (0.7, 0.2), (1.5, 1.0), (2.2, 0.05), (3.0, 2.0)] {
            let y0 = Vector::repeat(exact(t));
            let step = step(f, t, &y0, &f(t, &y0), h);
            let chord = step.y1[0] - step.y0[0];
            let (u, v) = (step.f0()[0] * h - chord, step.f1[0] * h - chord);
            let mut distance = 0.0_f64;
            for i in 1..100 {
                let theta = f64::from(i) / 100.0;
                let rest = 1.0 - theta;
                let cubic = step.y0[0] + chord * theta + (u * rest - v * theta) * (theta * rest);
                distance = distance.max((exact(t + theta * h) - cubic).abs());
            }
            let reach = step.stray().states[0];
            assert!(
                distance < reach && reach < 8.0 * distance,
                "{distance} {reach}"
            );
        }
    }
}
