//! Describing functions: what a nonlinearity makes of a sine (Gelb and Vander
//! Velde, "Multiple-Input Describing Functions and Nonlinear System Design",
//! 1968, 2.3 and appendix B; Slotine and Li, "Applied Nonlinear Control", 5).

use core::f64::consts::PI;

/// Share of a joint's stiffness and damping that acts on the fundamental of
/// `ε = A·sin φ` with a gap of ±b, `ratio = r = b/A`:
///
/// ```text
/// ν = 1 − 2/π·(asin r + r·√(1 − r²)),   0 for r ≥ 1
/// ```
///
/// It is the dead zone's. The damper acts while the flanks touch, so that the
/// torque of eq. 8-10 is `Ψ = (k + c·d/dt) dz(ε)` with the flanks' deflection
/// `dz(ε) = max(|ε| − b, 0)·sign ε`: one share serves both.
pub fn joint_share(ratio: f64) -> f64 {
    if ratio >= 1.0 {
        return 0.0;
    }
    let cosine = (1.0 - ratio * ratio).sqrt();
    1.0 - 2.0 / PI * (libm::asin(ratio) + ratio * cosine)
}

/// Third harmonic of `dz(A·sin φ)` over A: `4/(3π)·r·(1 − r²)^(3/2)`.
pub(crate) fn deflection_third(ratio: f64) -> f64 {
    let inside = (1.0 - ratio * ratio).max(0.0);
    4.0 / (3.0 * PI) * ratio * inside * inside.sqrt()
}

/// Mean of `floor(B + A·sin φ + ½)`, steps of 1, and its gain for the
/// fundamental: its amplitude over A. The gain is 4/π at most around a whole B;
/// between two it grows without bound as A falls, as that of a relay.
///
/// A threshold t is passed for the share `½ − asin(h)/π` of the period,
/// `h = (t − B)/A`, and adds `2/π·√(1 − h²)` to the fundamental.
pub fn quantiser(amplitude: f64, bias: f64) -> (f64, f64) {
    let mut mean = (bias - amplitude + 0.5).floor();
    let mut fundamental = 0.0;
    each_threshold(amplitude, bias, |height, phase| {
        mean += 0.5 - phase / PI;
        fundamental += 2.0 / PI * (1.0 - height * height).sqrt();
    });
    if fundamental == 0.0 {
        return (mean, 0.0);
    }
    (mean, fundamental / amplitude)
}

/// Amplitudes of the second and third harmonic of `floor(B + A·sin φ + ½)`.
pub(crate) fn quantiser_harmonics(amplitude: f64, bias: f64) -> [f64; 2] {
    let (mut second, mut third) = (0.0, 0.0);
    each_threshold(amplitude, bias, |_, phase| {
        second += libm::sin(2.0 * phase) / PI;
        third += 2.0 / (3.0 * PI) * libm::cos(3.0 * phase);
    });
    [second.abs(), third.abs()]
}

/// Every threshold in reach: `h` and the phase `asin h` at which it is passed.
fn each_threshold(amplitude: f64, bias: f64, mut found: impl FnMut(f64, f64)) {
    let mut threshold = (bias - amplitude + 0.5).floor() + 0.5;
    while threshold < bias + amplitude {
        let height = ((threshold - bias) / amplitude).clamp(-1.0, 1.0);
        found(height, libm::asin(height));
        threshold += 1.0;
    }
}

/// The bias B at which the mean of the quantiser is `mean`, for an amplitude
/// above 0: the mean rises with B without a jump, and is B where 2·B is whole.
pub fn quantiser_bias(amplitude: f64, mean: f64) -> f64 {
    if 2.0 * mean == (2.0 * mean).floor() {
        return mean;
    }
    let (mut low, mut high) = (mean - 1.0, mean + 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if quantiser(amplitude, middle).0 < mean {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
