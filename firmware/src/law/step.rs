//! One sample of the law.

use super::words::{AntiWindup, Derivative};
use super::{Law, LawInput, LawOutput, LawState, Phase, filter, term};
use crate::counts;
use crate::output::{self, Window};
use crate::wide;

impl Law {
    /// One sample: the sum `y` for the errors and the motion of this sample.
    ///
    /// The sums below cannot wrap ([`super::words`], section Overflow).
    #[inline(always)]
    pub fn step(&self, state: &mut LawState, input: &LawInput, window: Window) -> LawOutput {
        if state.phase != Phase::Running {
            return self.begin(state, *input, window);
        }
        let e = self.aligned.range.hold(input.error);
        let (direct, difference_limited) = self.direct(state, input, e);
        let limited = (e != input.error, difference_limited);
        let (integral, sum) = if input.hold_integral {
            (state.integral, direct.wrapping_add(state.integral))
        } else {
            self.integrated(state.integral, counted(input, e), direct, window)
        };
        self.end(state, (integral, sum), direct, limited)
    }

    /// A sample that does not go on from the one before: the first, or one
    /// whose output goes on from a code. Rare, so it is compiled apart: the
    /// input comes by value so that the other samples need not keep theirs in
    /// memory for it.
    #[cold]
    fn begin(&self, state: &mut LawState, input: LawInput, window: Window) -> LawOutput {
        let input = &input;
        let phase = core::mem::replace(&mut state.phase, Phase::Running);
        let e = self.aligned.range.hold(input.error);
        if !phase.goes_on() {
            // No error came before: no difference either.
            state.previous_error = e;
        }
        self.begin_filter(state, input, e, phase);
        let (direct, difference_limited) = self.direct(state, input, e);
        let (integral, sum) = match phase {
            // I with y = the last code, which the window holds: in range, it
            // can be shifted
            Phase::TakeOver(code) | Phase::ChangeOver(code) if !self.aligned.integral.is_zero() => {
                let code = code.min(window.high()).max(window.low());
                let sum = output::sum_of(code, self.words.sum_fraction_bits);
                (sum.wrapping_sub(direct), sum)
            }
            // A step that an integral gain of 0 would keep for ever.
            Phase::TakeOver(_) | Phase::ChangeOver(_) => (0, direct),
            _ if input.hold_integral => (state.integral, direct.wrapping_add(state.integral)),
            _ => self.integrated(state.integral, counted(input, e), direct, window),
        };
        let limited = (e != input.error, difference_limited);
        self.end(state, (integral, sum), direct, limited)
    }

    /// Keeps the integral within its range, and with it the sum. `limited`:
    /// whether the error was held, and whether a difference was.
    #[inline(always)]
    fn end(
        &self,
        state: &mut LawState,
        (integral, sum): (i64, i64),
        direct: i64,
        limited: (bool, bool),
    ) -> LawOutput {
        let mut output = LawOutput {
            // y                                                          eq. 23
            sum,
            error_limited: limited.0,
            difference_limited: limited.1,
            integral_limited: false,
        };
        let limit = self.aligned.integral_limit;
        // |I| ≤ Q. Q is a power of two and fills the upper word alone, in which
        // one addition and one comparison tell for all but Q itself.
        let [upper, whole] = [wide::upper(integral), wide::upper(limit)];
        let above = upper.wrapping_add(whole).cast_unsigned();
        state.integral = integral;
        if above >= whole.wrapping_mul(2).cast_unsigned() {
            state.integral = integral.min(limit).max(limit.wrapping_neg());
            output.sum = direct.wrapping_add(state.integral);
            output.integral_limited = state.integral != integral;
        }
        output
    }

    /// Everything but the integral, and whether a δ was held that does not
    /// outweigh everything else.
    #[inline(always)]
    fn direct(&self, state: &mut LawState, input: &LawInput, e: i32) -> (i64, bool) {
        // Kp·e + (Kd/Δt)·δ                              eq. 23, 1st and 3rd term
        let (derivative, limited) = self.derivative(state, input, e);
        let proportional = self.aligned.proportional.times(counted(input, e));
        let pd = proportional.wrapping_add(derivative);
        // Kv·v + Ka·a + Kf·sign(v)
        let direct = if self.feeds_forward {
            pd.wrapping_add(self.feed_forward(input))
        } else {
            pd
        };
        (direct, limited)
    }

    /// δ before and after it is held at its limit \[counts\].
    #[inline(always)]
    fn difference(&self, state: &LawState, input: &LawInput, e: i32) -> (i32, i32) {
        let limit = self.aligned.slope_limit;
        match self.words.derivative {
            // e − e_prev; |e| ≤ 2^29, so the difference fits
            Derivative::Error => {
                let difference = e.wrapping_sub(state.previous_error);
                (difference, counts::within(difference, limit))
            }
            // −(c − c_prev); only what is held surely has an opposite
            Derivative::Measurement => {
                let held = counts::within(input.difference, limit);
                (input.difference.saturating_neg(), held.wrapping_neg())
            }
        }
    }

    /// `(Kd/Δt)·δ` \[2^−F codes\], and whether a δ was held that does not
    /// outweigh everything else.
    #[inline(always)]
    fn derivative(&self, state: &mut LawState, input: &LawInput, e: i32) -> (i64, bool) {
        let law = &self.aligned;
        let (difference, held) = self.difference(state, input, e);
        state.previous_error = e;
        if let Some(filter) = self.words.filter {
            let filtered = filter::step(filter, &mut state.filtered, held);
            return (law.derivative.times(filtered), held != difference);
        }
        let outweighs = law.slope_limit < law.range.limit().wrapping_mul(2);
        (law.derivative.times(held), held != difference && !outweighs)
    }

    /// Makes the filter's memory one that this sample can go on from.
    fn begin_filter(&self, state: &mut LawState, input: &LawInput, e: i32, phase: Phase) {
        let Some(filter) = self.words.filter else {
            state.filter_bits = None;
            return;
        };
        let bits = Some(filter.fraction_bits);
        state.filtered = if phase.goes_on() && state.filter_bits == bits {
            // The speed is what it was; other words may declare less of it.
            let most = filter::settled(filter, self.aligned.slope_limit);
            state.filtered.min(most).max(most.wrapping_neg())
        } else {
            // Nothing was filtered yet: start settled, without a transient.
            filter::settled(filter, self.difference(state, input, e).1)
        };
        state.filter_bits = bits;
    }

    #[inline(always)]
    fn feed_forward(&self, input: &LawInput) -> i64 {
        let law = &self.aligned;
        let rates = law
            .velocity
            .times(input.velocity)
            .wrapping_add(law.acceleration.times(input.acceleration));
        if input.velocity > 0 {
            rates.wrapping_add(law.friction)
        } else if input.velocity < 0 {
            rates.wrapping_sub(law.friction)
        } else {
            rates
        }
    }

    /// The integral after this sample, and the sum with it.
    #[inline(always)]
    fn integrated(&self, integral: i64, e: i32, direct: i64, window: Window) -> (i64, i64) {
        // (Ki·Δt)·Σe ← (Ki·Δt)·Σe + (Ki·Δt)·e                 eq. 23, 2nd term
        let next = integral.wrapping_add(self.aligned.integral.times(e));
        let sum = next.wrapping_add(direct);
        let bits = self.words.sum_fraction_bits;
        let integral = match self.words.anti_windup {
            AntiWindup::None => return (next, sum),
            _ if window.surely_holds(sum, bits) => return (next, sum),
            // Beyond the headroom, and e pushes further out: up to its end, if
            // the sum was not there before.
            AntiWindup::Clamp if e > 0 => {
                let end = output::sum_of(window.high(), bits).wrapping_sub(direct);
                if end <= integral {
                    integral
                } else {
                    next.min(end)
                }
            }
            AntiWindup::Clamp => {
                let end = output::sum_of(window.low(), bits).wrapping_sub(direct);
                if end >= integral {
                    integral
                } else {
                    next.max(end)
                }
            }
            // I ← I + (u − y)·Δt/T_t
            AntiWindup::BackCalculation { tracking } => {
                next.wrapping_sub(term::scaled(window.excess(sum, bits), tracking))
            }
        };
        (integral, direct.wrapping_add(integral))
    }
}

/// The error as `Kp` and `Ki` see it.
#[inline(always)]
const fn counted(input: &LawInput, e: i32) -> i32 {
    if input.within_dead_band { 0 } else { e }
}
