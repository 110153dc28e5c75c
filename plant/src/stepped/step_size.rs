//! How long the steps of solver `dopri5` are: what error one may make, and what
//! follows from the error for the next.

use crate::model::state::Vector;
use crate::stepped::dop853::Step;

/// What a step may add to a state's error, as shares of the tolerance: of 1
/// rad, rad/s or A, and of the state itself. A run of a second takes tens of
/// thousands of steps, and a joint that rattles multiplies the error of each:
/// over 240 random cases against a program in extended precision the largest
/// error of β was 9.5e-8 rad with shares of 1 and 0.01, and 1.2e-8 with these.
const ABSOLUTE_SHARE: f64 = 0.1;
const RELATIVE_SHARE: f64 = 0.001;

/// Share of the step after the last jump of the voltage that is tried after the
/// next one: jumps differ, and a rejected step costs as much as a good one.
const RESTART_SHARE: f64 = 0.8;

/// What the estimates make of the rounding of one stage: the root of the sum of
/// the squares of their weights is 2.2, and half a last bit is the most of it.
const NOISE_WEIGHT: f64 = 2.0;

/// Steps that the error control would take next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepSize {
    next_s: f64,
    /// After a jump of the voltage, from the last such jump: the transient that
    /// follows needs shorter steps than what it has become by the next one.
    /// Without this memory every sixth step was rejected (W1: 1 ms between
    /// jumps).
    restart_s: f64,
    restarted: bool,
}

impl StepSize {
    /// Before anything is known; the first steps correct it.
    pub(crate) fn new() -> Self {
        Self {
            next_s: 1e-5,
            restart_s: 1e-5,
            restarted: false,
        }
    }

    /// Step to take next \[s\].
    pub(crate) fn next_s(&self) -> f64 {
        self.next_s
    }

    /// The voltage has jumped.
    pub(crate) fn restart(&mut self) {
        self.next_s = self.next_s.min(RESTART_SHARE * self.restart_s);
        self.restarted = true;
    }

    /// A step of `h` had an error above 1.
    pub(crate) fn reject(&mut self, h: f64, error: f64) {
        self.next_s = h * growth(error).min(0.9);
    }

    /// A step of `h` was good; `last` if the interval's end cut it short, which
    /// says little about the next.
    pub(crate) fn accept(&mut self, h: f64, error: f64, last: bool) {
        let wanted_s = h * growth(error);
        let longer = |known_s: f64| {
            if last {
                wanted_s.max(known_s)
            } else {
                wanted_s
            }
        };
        self.next_s = longer(self.next_s);
        if self.restarted {
            self.restart_s = longer(self.restart_s);
            self.restarted = false;
        }
    }
}

/// Error of the step, 1 being what is allowed: the largest of its components
/// relative to what the tolerance allows them. The estimates of order 5 and 3
/// go with h⁶ and h⁴; `e5²/√(e5² + e3²/100)` goes with h⁸ (Hairer, Nørsett,
/// Wanner, section II.10), here written so that no square overflows first.
///
/// `noise` is the rounding in the derivatives. The estimates weigh it like a
/// part of the solution, and it does not go with any power of h: at a tolerance
/// of 1e-14 a joint of 9e5 N m/rad behind a gap of 0.13 rad shortened the steps
/// to nothing. What it amounts to is allowed.
pub(crate) fn error_norm(step: &Step, noise: &Vector, tolerance: f64) -> f64 {
    let (fifth, third) = step.errors();
    let (mut e5, mut e3, mut sum) = (0.0_f64, 0.0_f64, 0.0);
    let parts = fifth.iter().zip(third.iter()).zip(noise.iter());
    for (((fifth, third), noise), y) in parts.zip(step.y1.iter()) {
        let of_solution = tolerance * (ABSOLUTE_SHARE + RELATIVE_SHARE * y.abs());
        let allowed = of_solution + NOISE_WEIGHT * noise * step.h;
        let per_allowed = 1.0 / allowed;
        let (share5, share3) = (fifth.abs() * per_allowed, third.abs() * per_allowed);
        e5 = e5.max(share5);
        e3 = e3.max(share3);
        sum += share5 + share3;
    }
    // `max` hides a NaN, a sum does not.
    if !sum.is_finite() {
        return f64::NAN;
    }
    if e5 == 0.0 {
        return 0.0;
    }
    let ratio = e3 / e5;
    e5 / (1.0 + 0.01 * ratio * ratio).sqrt()
}

/// Factor for the next step: the error goes with h⁸.
fn growth(error: f64) -> f64 {
    if error.is_nan() {
        return 0.2;
    }
    (0.9 / error.sqrt().sqrt().sqrt()).clamp(0.2, 5.0)
}

/// The step to take of what is left, so that equal steps no longer than
/// `wanted_s` fill it and no short one remains at its end.
pub(crate) fn even_share(left_s: f64, wanted_s: f64) -> f64 {
    // A remainder too short to matter is joined to the others.
    let steps = (left_s / wanted_s - 0.001).ceil();
    if steps > 1.0 { left_s / steps } else { left_s }
}
