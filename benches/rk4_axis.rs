//! The paper's own way: classical Runge-Kutta of order 4 with a fixed step
//! that locates nothing. Plain arrays, the mode from the state at each stage.

use std::convert::Infallible;

use crate::elastic_axis::{ElasticAxis, State, beta_rad};
use crate::lockstep::{Axis, count, seconds};

/// The axis with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct Rk4Axis {
    axis: ElasticAxis,
    /// The state now.
    pub y: State,
    time_ns: u64,
    step_ns: u64,
}

impl Rk4Axis {
    /// At rest; an interval is cut into equal steps no longer than `step_ns`.
    pub fn new(axis: ElasticAxis, step_ns: u64) -> Self {
        Self {
            axis,
            y: State::default(),
            time_ns: 0,
            step_ns,
        }
    }

    fn step(&self, voltage_v: f64, h: f64) -> State {
        let f = |y: &State| {
            self.axis
                .derivative(self.axis.flank_of_state(y), voltage_v, y)
        };
        let moved = |k: &State, h: f64| -> State {
            let mut y = self.y;
            for (y, k) in y.iter_mut().zip(k) {
                *y += h * k;
            }
            y
        };
        let k1 = f(&self.y);
        let k2 = f(&moved(&k1, 0.5 * h));
        let k3 = f(&moved(&k2, 0.5 * h));
        let k4 = f(&moved(&k3, h));
        let mut y = self.y;
        for i in 0..y.len() {
            y[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
        y
    }
}

impl Axis for Rk4Axis {
    type Error = Infallible;

    fn beta_rad(&self) -> f64 {
        beta_rad(&self.y)
    }

    fn hold(&mut self, voltage_v: f64, until_ns: u64) -> Result<(), Infallible> {
        let length_ns = until_ns - self.time_ns;
        let steps = length_ns.div_ceil(self.step_ns);
        let h = seconds(length_ns) / count(steps);
        for _ in 0..steps {
            self.y = self.step(voltage_v, h);
        }
        self.time_ns = until_ns;
        Ok(())
    }
}
