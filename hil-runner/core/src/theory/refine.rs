//! Frequencies at which a response is sampled: closer where it bends.

use nalgebra::Complex;

/// How far the response half way may be from what its neighbours suggest,
/// relative to them.
const BEND: f64 = 0.02;

/// Whether the response between two neighbours bends, seen from the middle: it
/// is neither a power of the frequency nor a straight line. At a resonance it is
/// neither, around a zero the latter.
pub(crate) fn bends(from: Complex<f64>, middle: Complex<f64>, to: Complex<f64>) -> bool {
    let product = from * to;
    let off_power = (middle * middle - product).norm_sqr();
    if off_power <= 4.0 * BEND * BEND * product.norm_sqr() {
        return false;
    }
    let off_line = (middle - (from + to) * 0.5).norm_sqr();
    off_line > BEND * BEND * from.norm_sqr().max(to.norm_sqr())
}

/// How far [`refined`] goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// Points at most.
    pub(crate) most: usize,
    /// Neighbours closer than this, relative, are not divided.
    pub(crate) closest: f64,
}

/// `base` and `seeds` in order, and between them as many frequencies as it takes
/// until no two neighbours are `rough`, or the limits are reached; with the
/// response at each. Seeds are where a needle may hide between two points of the base.
pub(crate) fn refined(
    mut base: Vec<f64>,
    seeds: &[f64],
    limits: Limits,
    response: impl Fn(f64) -> Complex<f64>,
    rough: impl Fn(Complex<f64>, Complex<f64>, Complex<f64>) -> bool,
) -> Vec<(f64, Complex<f64>)> {
    let (lowest, highest) = (base[0], base[base.len() - 1]);
    let within = |at: &&f64| **at > lowest && **at < highest;
    base.extend(seeds.iter().filter(within));
    base.sort_by(f64::total_cmp);
    base.dedup_by(|b, a| *b - *a <= 1e-12 * *a && *b < highest);
    let mut points: Vec<(f64, Complex<f64>)> =
        base.into_iter().map(|at| (at, response(at))).collect();
    // Every gap once a round, so that a full grid is full everywhere.
    loop {
        let mut room = limits.most.saturating_sub(points.len());
        let mut divided = Vec::with_capacity(2 * points.len());
        for pair in points.windows(2) {
            let ((a, at_a), (b, at_b)) = (pair[0], pair[1]);
            divided.push(pair[0]);
            if room == 0 || b - a <= limits.closest * a {
                continue;
            }
            let middle = (a * b).sqrt();
            let at_middle = response(middle);
            if rough(at_a, at_middle, at_b) {
                divided.push((middle, at_middle));
                room -= 1;
            }
        }
        divided.extend(points.last());
        let done = divided.len() == points.len();
        points = divided;
        if done {
            return points;
        }
    }
}
