//! Classical Runge-Kutta of order 4 with a fixed step: the paper's own way.
//!
//! It locates nothing: every stage takes the mode of the axis from the state
//! it is evaluated at, so a step that crosses a contact smears it.

use crate::state::Vector;

/// One step of `dy/dt = f(t, y)` from `(t, y)`.
pub(crate) fn step(f: impl Fn(f64, &Vector) -> Vector, t: f64, y: &Vector, h: f64) -> Vector {
    let k1 = f(t, y);
    let k2 = f(t + h / 2.0, &(y + k1 * (h / 2.0)));
    let k3 = f(t + h / 2.0, &(y + k2 * (h / 2.0)));
    let k4 = f(t + h, &(y + k3 * h));
    y + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(n: u32) -> f64 {
        let f = |_: f64, y: &Vector| Vector::new(y[1], -y[0], 0.0, 0.0, 0.0, 0.0);
        let h = 1.0 / f64::from(n);
        let mut y = Vector::new(0.0, 1.0, 0.0, 0.0, 0.0, 0.0);
        for i in 0..n {
            y = step(f, f64::from(i) * h, &y, h);
        }
        (y[0] - libm::sin(1.0)).abs()
    }

    #[test]
    fn converges_with_order_four() {
        let order = (error(8) / error(16)).log2();
        assert!((3.8..=4.2).contains(&order), "order {order}");
    }
}
