//! How far a quantity is behind the command: the command as the slopes of a
//! sketch, and where the difference turns.

use super::grid::{Local, LocalCoefficients, derivative};
use super::sketch::SLOPES;
use super::taylor::value_and_slope;
use crate::model::motion::Motion;

/// `ELEVATE·b` writes a polynomial of degree 2 with degree 10: row i has
/// `C(2,j)·C(8,i−j)/C(10,i)`.
const ELEVATE: [[f64; 3]; SLOPES] = elevate();

const fn elevate() -> [[f64; 3]; SLOPES] {
    let mut rows = [[0.0; 3]; SLOPES];
    let mut i = 0;
    while i < SLOPES {
        // Of ten, i are chosen; two of the ten are marked.
        let (n, k) = (i as f64, (SLOPES - 1 - i) as f64);
        rows[i] = [
            k * (k - 1.0) / 90.0,
            2.0 * k * n / 90.0,
            n * (n - 1.0) / 90.0,
        ];
        i += 1;
    }
    rows
}

/// `h⁴·sup|x⁗|` times this bounds how far `h·ẋ` is from that of the cubic with
/// the same values and slopes at both ends: √3/216 (Hermite's remainder).
const HERMITE_SLOPE: f64 = 0.008_02;

/// The command over a stretch without a break as slopes of a sketch, with the
/// bound of their error.
pub(crate) fn command_slopes(
    motion: &Motion,
    start_s: f64,
    length_s: f64,
) -> (f64, [f64; SLOPES], f64) {
    let (from, to) = (motion.at(start_s), motion.at(start_s + length_s));
    let (v0, v1) = (from.velocity_mps * length_s, to.velocity_mps * length_s);
    let change = to.displacement_m - from.displacement_m;
    let middle = 3.0 * change - (v0 + v1);
    let slopes = ELEVATE.map(|[a, b, c]| (a * v0 + b * middle) + c * v1);
    let size = from.displacement_m.abs() + to.displacement_m.abs() + v0.abs() + v1.abs();
    let rough = motion.fourth_derivatives().displacement_m * length_s * length_s;
    let stray = HERMITE_SLOPE * rough * length_s * length_s + 16.0 * f64::EPSILON * size;
    (from.displacement_m, slopes, stray)
}

/// Newton steps at most towards a turn of |command − quantity|, and the step,
/// in half cells, that ends them: the value there is known to its square.
const MOST_NEWTON: usize = 8;
const CLOSE: f64 = 1e-9;

/// The magnitude of |command − quantity| at its turn near σ.
pub(super) fn peak_behind<const D: usize>(
    local: &Local<D>,
    q: &LocalCoefficients,
    (motion, start_s): (&Motion, f64),
    mut sigma: f64,
) -> Option<f64> {
    let h = local.half_s();
    let slopes = derivative(q);
    for _ in 0..MOST_NEWTON {
        let command = motion.at(start_s + local.time_s(sigma));
        let (speed, bend) = value_and_slope(&slopes, sigma);
        let step =
            (command.velocity_mps * h - speed) / (command.acceleration_mps2 * (h * h) - bend);
        sigma -= step;
        let inside = sigma.abs() <= 1.25;
        if !inside {
            return None;
        }
        if step.abs() <= CLOSE {
            let x_m = motion.at(start_s + local.time_s(sigma)).displacement_m;
            return Some((x_m - value_and_slope(q, sigma).0).abs());
        }
    }
    None
}
