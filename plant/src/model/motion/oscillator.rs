//! The command as the state of a linear system, for solver `exact`.

use super::point::MotionPoint;

/// Rates of the linear system `ȧ = up·w`, `ẇ = −down·a` that an interval of the
/// command is: both ω for a sine or a cosine, 1 and 0 for a constant jerk, 0 and 0
/// for a constant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Coupling {
    /// \[1/s\]
    pub(crate) up_per_s: f64,
    /// \[1/s\]
    pub(crate) down_per_s: f64,
}

/// The command as a linear system of its own within one interval.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Oscillator {
    pub(crate) point: MotionPoint,
    /// `w` \[m/s²\].
    pub(crate) quadrature_mps2: f64,
    pub(crate) coupling: Coupling,
}

/// What a step of one length makes of the command within an interval, in closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OscillatorStep {
    length_s: f64,
    up_per_s: f64,
    cos: f64,
    /// What w adds to a, and a takes from w.
    sin: (f64, f64),
    /// `cos ωt` integrated one to four times over the step.
    integrals: [f64; 4],
}

impl OscillatorStep {
    pub(crate) fn new(coupling: Coupling, length_s: f64) -> Self {
        let (t, up_per_s, w) = (length_s, coupling.up_per_s, coupling.down_per_s);
        let (cos, sin, integrals) = if w == 0.0 {
            let powers = [t, t * t / 2.0, t * t * t / 6.0, t * t * t * t / 24.0];
            (1.0, (up_per_s * t, 0.0), powers)
        } else {
            let (sin, cos) = (libm::sin(w * t), libm::cos(w * t));
            let (once, twice) = (sin / w, versine(w * t) / (w * w));
            let (w, rest) = (w * w, t * t / 2.0 - twice);
            (cos, (sin, sin), [once, twice, (t - once) / w, rest / w])
        };
        Self {
            length_s,
            up_per_s,
            cos,
            sin,
            integrals,
        }
    }
}

impl Oscillator {
    /// The command a step later.
    #[inline(always)]
    pub(crate) fn after(&self, step: &OscillatorStep) -> Self {
        // a(t) = a·cos ωt + jerk·∫cos ωt dt, and so on for its integrals.
        let (point, w, t) = (&self.point, self.quadrature_mps2, step.length_s);
        let (a, v, x) = (
            point.acceleration_mps2,
            point.velocity_mps,
            point.displacement_m,
        );
        let (q, jerk) = (point.displacement_integral_ms, w * step.up_per_s);
        let [once, twice, thrice, last] = step.integrals;
        Self {
            point: MotionPoint {
                acceleration_mps2: step.cos * a + step.sin.0 * w,
                velocity_mps: v + (once * a + twice * jerk),
                displacement_m: x + (v * t + (twice * a + thrice * jerk)),
                displacement_integral_ms: q
                    + (x * t + (v * t * t / 2.0 + (thrice * a + last * jerk))),
            },
            quadrature_mps2: step.cos * w - step.sin.1 * a,
            coupling: self.coupling,
        }
    }

    /// Coefficients of x_ref as a power series in θ = t/length, valid until the interval of
    /// the command ends.
    pub(crate) fn series(&self, length_s: f64, coefficients: &mut [f64]) {
        let (point, w) = (&self.point, self.quadrature_mps2);
        let phases = [self.coupling.up_per_s, self.coupling.down_per_s].map(|rate| rate * length_s);
        // x, v·h and then a·h²/2!, up·w·h³/3!, −up·down·a·h⁴/4!, …
        let mut scale = length_s * length_s / 2.0;
        let a = point.acceleration_mps2;
        let derivatives = [a, w, -a, -w];
        for (n, c) in (0_u16..).zip(coefficients.iter_mut()) {
            *c = match n {
                0 => point.displacement_m,
                1 => point.velocity_mps * length_s,
                _ => {
                    let term = derivatives[usize::from(n - 2) % 4] * scale;
                    scale *= phases[usize::from(n % 2)] / f64::from(n + 1);
                    term
                }
            };
        }
    }
}

/// `1 − cos φ` without cancellation.
pub(super) fn versine(phi: f64) -> f64 {
    let half = libm::sin(phi / 2.0);
    2.0 * half * half
}
