//! One step of the Dormand-Prince method of order 5(4) with its dense output.
//!
//! J. R. Dormand, P. J. Prince, "A family of embedded Runge-Kutta formulae",
//! J. Comput. Appl. Math. 6 (1980) 19-26; dense output of order 4 from
//! E. Hairer, S. P. Nørsett, G. Wanner, "Solving Ordinary Differential
//! Equations I", section II.6.

use crate::state::Vector;

/// Result of one trial step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    pub(crate) h: f64,
    pub(crate) y0: Vector,
    /// Derivative at the start.
    pub(crate) f0: Vector,
    pub(crate) y1: Vector,
    /// Derivative at the end, also the first stage of the next step.
    pub(crate) f1: Vector,
    /// Difference of the two embedded solutions.
    pub(crate) error: Vector,
    /// State in the middle of the step, by the dense output.
    pub(crate) middle: Vector,
    /// Highest coefficient of the dense output.
    dense: Vector,
}

/// Takes one step of `dy/dt = f(t, y)` from `(t, y0)` with `f0 = f(t, y0)`.
pub(crate) fn step(
    f: impl Fn(f64, &Vector) -> Vector,
    t: f64,
    y0: &Vector,
    f0: &Vector,
    h: f64,
) -> Step {
    let k1 = *f0;
    let k2 = f(t + h * 0.2, &(y0 + k1 * (h * 0.2)));
    let k3 = f(
        t + h * 0.3,
        &(y0 + (k1 * (3.0 / 40.0) + k2 * (9.0 / 40.0)) * h),
    );
    let k4 = f(
        t + h * 0.8,
        &(y0 + (k1 * (44.0 / 45.0) - k2 * (56.0 / 15.0) + k3 * (32.0 / 9.0)) * h),
    );
    let k5 = f(
        t + h * (8.0 / 9.0),
        &(y0 + (k1 * (19372.0 / 6561.0) - k2 * (25360.0 / 2187.0) + k3 * (64448.0 / 6561.0)
            - k4 * (212.0 / 729.0))
            * h),
    );
    let k6 = f(
        t + h,
        &(y0 + (k1 * (9017.0 / 3168.0) - k2 * (355.0 / 33.0)
            + k3 * (46732.0 / 5247.0)
            + k4 * (49.0 / 176.0)
            - k5 * (5103.0 / 18656.0))
            * h),
    );
    let y1 = y0
        + (k1 * (35.0 / 384.0) + k3 * (500.0 / 1113.0) + k4 * (125.0 / 192.0)
            - k5 * (2187.0 / 6784.0)
            + k6 * (11.0 / 84.0))
            * h;
    let k7 = f(t + h, &y1);
    let error = (k1 * (71.0 / 57600.0) - k3 * (71.0 / 16695.0) + k4 * (71.0 / 1920.0)
        - k5 * (17253.0 / 339_200.0)
        + k6 * (22.0 / 525.0)
        - k7 * (1.0 / 40.0))
        * h;
    let dense = (k1 * (-12_715_105_075.0 / 11_282_082_432.0)
        + k3 * (87_487_479_700.0 / 32_700_410_799.0)
        - k4 * (10_690_763_975.0 / 1_880_347_072.0)
        + k5 * (701_980_252_875.0 / 199_316_789_632.0)
        - k6 * (1_453_857_185.0 / 822_651_844.0)
        + k7 * (69_997_945.0 / 29_380_423.0))
        * h;
    let mut step = Step {
        h,
        y0: *y0,
        f0: k1,
        y1,
        f1: k7,
        error,
        middle: y1,
        dense,
    };
    step.middle = step.at(0.5);
    step
}

impl Step {
    /// State at `t + θ·h`, 0 ≤ θ ≤ 1, to fourth order.
    pub(crate) fn at(&self, theta: f64) -> Vector {
        let rest = 1.0 - theta;
        let difference = self.y1 - self.y0;
        let bend = self.f0 * self.h - difference;
        let twist = difference - self.f1 * self.h - bend;
        self.y0 + (difference + (bend + (twist + self.dense * rest) * theta) * rest) * theta
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Global error on `ẏ = y·cos t`, `y = exp(sin t)`, at t = 2 in `n` equal
    /// steps, and the largest error of the dense output within the steps.
    fn errors(n: u32) -> (f64, f64) {
        let f = |t: f64, y: &Vector| y * libm::cos(t);
        let exact = |t: f64| libm::exp(libm::sin(t));
        let h = 2.0 / f64::from(n);
        let (mut y, mut worst) = (Vector::repeat(1.0), 0.0_f64);
        for i in 0..n {
            let t = f64::from(i) * h;
            let step = step(f, t, &y, &f(t, &y), h);
            for theta in [0.3, 0.5, 0.8] {
                worst = worst.max((step.at(theta)[0] - exact(t + theta * h)).abs());
            }
            y = step.y1;
        }
        ((y[0] - exact(2.0)).abs(), worst)
    }

    #[test]
    fn converges_with_order_five_and_dense_output_four() {
        let ((coarse, coarse_dense), (fine, fine_dense)) = (errors(8), errors(16));
        let (order, dense_order) = ((coarse / fine).log2(), (coarse_dense / fine_dense).log2());
        assert!((4.7..=6.2).contains(&order), "order {order}");
        assert!(
            (3.7..=5.5).contains(&dense_order),
            "dense order {dense_order}"
        );
    }
}
