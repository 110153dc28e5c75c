//! One sample of the law.

use super::state::{LawState, Phase};
use super::words::{AntiWindup, Derivative};
use super::{Law, filter, term};
use crate::counts;
use crate::output::{self, Window};

/// What one sample brings to the law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LawInput {
    /// `e` \[counts\].
    pub error: i32,
    /// `c − c_prev` of the motor \[counts\].
    pub difference: i32,
    /// `v` of the setpoint, in its source's unit, below 2^30.
    pub velocity: i32,
    /// `a` of the setpoint, in its source's unit, below 2^30.
    pub acceleration: i32,
    /// Whether the error is within the dead band of an axis at rest: it counts
    /// as 0 for `Kp` and `Ki`. Its difference does not, or the band's edge
    /// would be a step of the derivative.
    pub within_dead_band: bool,
    /// Whether the integral stands still: an axis at rest may ask for it.
    pub hold_integral: bool,
}

/// What one sample of the law gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LawOutput {
    /// `y` before rounding \[2^−F codes\].
    pub sum: i64,
    /// Whether `|e|` was beyond the declared range and held at its limit.
    pub error_limited: bool,
    /// Whether a difference was beyond its declared range and held at its
    /// limit; not where the limit is one that outweighs everything else.
    pub difference_limited: bool,
    /// Whether the integral was held at the end of its declared range.
    pub integral_limited: bool,
}

impl Law {
    /// One sample: the sum `y` for the errors and the motion of this sample.
    ///
    /// The sums below cannot wrap ([`super::words`], section Overflow).
    pub fn step(&self, state: &mut LawState, input: &LawInput, window: Window) -> LawOutput {
        let law = &self.aligned;
        let e = law.range.hold(input.error);
        let error_limited = e != input.error;

        let phase = core::mem::replace(&mut state.phase, Phase::Running);

        // Kp·e + (Kd/Δt)·δ                              eq. 23, 1st and 3rd term
        let (derivative, difference_limited) = self.derivative(state, input, e, phase);
        let e = if input.within_dead_band { 0 } else { e };
        let pd = law.proportional.times(e).wrapping_add(derivative);
        // Kv·v + Ka·a + Kf·sign(v)
        let direct = if self.feeds_forward {
            pd.wrapping_add(self.feed_forward(input))
        } else {
            pd
        };

        let integral = match phase {
            // I with y = the last code, which the window holds: in range, it
            // can be shifted
            Phase::TakeOver(code) | Phase::ChangeOver(code) if !law.integral.is_zero() => {
                let code = code.min(window.high()).max(window.low());
                output::sum_of(code, self.words.sum_fraction_bits).wrapping_sub(direct)
            }
            // A step that an integral gain of 0 would keep for ever.
            Phase::TakeOver(_) | Phase::ChangeOver(_) => 0,
            _ if input.hold_integral => state.integral,
            _ => self.integrated(state.integral, e, direct, window),
        };
        let held = self.within_range(integral);
        state.integral = held;

        LawOutput {
            // y                                                          eq. 23
            sum: direct.wrapping_add(held),
            error_limited,
            difference_limited,
            integral_limited: held != integral,
        }
    }

    /// `|I| ≤ Q`, held at its end.
    #[inline]
    fn within_range(&self, integral: i64) -> i64 {
        let limit = self.aligned.integral_limit;
        // Q is a power of two and fills the upper word alone, in which one
        // addition and one comparison tell for all but Q itself.
        let [above, whole] = [integral.wrapping_add(limit), limit].map(output::upper);
        if above.cast_unsigned() < whole.wrapping_mul(2).cast_unsigned() {
            integral
        } else {
            integral.min(limit).max(limit.wrapping_neg())
        }
    }

    /// `(Kd/Δt)·δ` \[2^−F codes\], and whether a δ was held that does not
    /// outweigh everything else.
    fn derivative(
        &self,
        state: &mut LawState,
        input: &LawInput,
        e: i32,
        phase: Phase,
    ) -> (i64, bool) {
        let law = &self.aligned;
        let e_prev = core::mem::replace(&mut state.previous_error, e);
        let difference = match self.words.derivative {
            // e − e_prev; |e| ≤ 2^29, so the difference fits          [counts]
            Derivative::Error if phase.goes_on() => e.wrapping_sub(e_prev),
            Derivative::Error => 0,
            // −(c − c_prev); its only magnitude without an opposite is held
            Derivative::Measurement => input.difference.saturating_neg(),
        };
        let held = counts::within(difference, law.slope_limit);
        let Some(filter) = self.words.filter else {
            if phase != Phase::Running {
                state.filter_bits = None;
            }
            let outweighs = law.slope_limit < law.range.limit().wrapping_mul(2);
            return (law.derivative.times(held), held != difference && !outweighs);
        };
        if phase != Phase::Running {
            let most = filter::settled(filter, law.slope_limit);
            let bits = Some(filter.fraction_bits);
            state.filtered = if phase.goes_on() && state.filter_bits == bits {
                // The speed is what it was; other words may declare less of it.
                state.filtered.min(most).max(most.wrapping_neg())
            } else {
                // Nothing was filtered yet: start settled, without a transient.
                filter::settled(filter, held)
            };
            state.filter_bits = bits;
        }
        let filtered = filter::step(filter, &mut state.filtered, held);
        (law.derivative.times(filtered), held != difference)
    }

    fn feed_forward(&self, input: &LawInput) -> i64 {
        let law = &self.aligned;
        let friction = i64::from(input.velocity.signum()).wrapping_mul(law.friction);
        law.velocity
            .times(input.velocity)
            .wrapping_add(law.acceleration.times(input.acceleration))
            .wrapping_add(friction)
    }

    /// The integral after this sample.
    #[inline]
    fn integrated(&self, integral: i64, e: i32, direct: i64, window: Window) -> i64 {
        // (Ki·Δt)·Σe ← (Ki·Δt)·Σe + (Ki·Δt)·e                 eq. 23, 2nd term
        let next = integral.wrapping_add(self.aligned.integral.times(e));
        let sum = next.wrapping_add(direct);
        let bits = self.words.sum_fraction_bits;
        match self.words.anti_windup {
            AntiWindup::None => next,
            // Beyond the headroom, and e pushes further out: up to its end, if
            // the sum was not there before.
            AntiWindup::Clamp => match window.excess(sum, bits) {
                excess if excess > 0 && e > 0 => next.wrapping_sub(excess).max(integral),
                excess if excess < 0 && e < 0 => next.wrapping_sub(excess).min(integral),
                _ => next,
            },
            AntiWindup::BackCalculation { tracking } => {
                // I ← I + (u − y)·Δt/T_t
                match window.excess(sum, bits) {
                    0 => next,
                    excess => next.wrapping_sub(term::scaled(excess, tracking)),
                }
            }
        }
    }
}
