//! Describing functions against the integrals that they are.

use super::super::cycles::{deflection_third, quantiser_harmonics};
use super::super::{joint_share, quantiser, quantiser_bias};

/// The describing functions against the Fourier integral of what they describe.
#[test]
fn describing_functions_are_fourier_coefficients() {
    const N: usize = 200_000;
    // Mean, gain of the fundamental, second and third harmonic over A.
    let fourier = |f: &dyn Fn(f64) -> f64, a: f64| -> [f64; 4] {
        let mut sums = [0.0; 7];
        for k in 0..N {
            let phi = std::f64::consts::TAU * (k as f64 + 0.5) / N as f64;
            let value = f(a * phi.sin());
            sums[0] += value;
            for n in 1..=3 {
                sums[2 * n - 1] += value * (n as f64 * phi).sin();
                sums[2 * n] += value * (n as f64 * phi).cos();
            }
        }
        let s = sums.map(|sum| 2.0 * sum / N as f64);
        [
            0.5 * s[0],
            s[1] / a,
            s[3].hypot(s[4]) / a,
            s[5].hypot(s[6]) / a,
        ]
    };
    for ratio in [0.05, 0.3, 0.7, 0.95] {
        let zone = |e: f64| (e.abs() - ratio).max(0.0) * e.signum();
        let [_, first, _, third] = fourier(&zone, 1.0);
        assert!((first - joint_share(ratio)).abs() < 1e-6);
        assert!((third - deflection_third(ratio)).abs() < 1e-6);
    }
    assert_eq!(joint_share(1.0), 0.0);
    for amplitude in [0.3, 0.71, 1.4, 7.7] {
        for bias in [0.0, 0.2, 0.5, -3.4] {
            let [mean, first, second, third] = fourier(&|e| (bias + e + 0.5).floor(), amplitude);
            let (expected_mean, expected) = quantiser(amplitude, bias);
            assert!((mean - expected_mean).abs() < 1e-4, "{amplitude} {bias}");
            assert!((first - expected).abs() < 1e-4, "{amplitude} {bias}");
            let harmonics = quantiser_harmonics(amplitude, bias).map(|h| h / amplitude);
            assert!((second - harmonics[0]).abs() < 1e-4, "{amplitude} {bias}");
            assert!((third - harmonics[1]).abs() < 1e-4, "{amplitude} {bias}");
            let back = quantiser_bias(amplitude, expected_mean);
            assert!((quantiser(amplitude, back).0 - expected_mean).abs() < 1e-9);
        }
    }
    // The largest gain around a whole bias: 4/π at A = 1/√2.
    let most = (1..2000).map(|k| quantiser(1e-3 * f64::from(k), 0.0).1);
    let most = most.fold(0.0, f64::max);
    assert!((most - 4.0 / std::f64::consts::PI).abs() < 1e-5);
}
