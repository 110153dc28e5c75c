//! One sample of the law, top to bottom.

use super::filter::Filtered;
use super::term::Term;
use super::words::{AntiWindup, Derivative};
use super::{Begin, Law, LawInput, LawState, Operands, Terms, filter};
use crate::dac::{Codes, HALF};
use crate::output::Output;
use crate::wide;

impl Law {
    /// One sample: the code for the errors and the motion of this sample.
    #[inline(always)]
    pub fn step(&self, output: &Output, state: &mut LawState, input: &LawInput) -> i32 {
        state.dither(output);
        self.operands.step(output, state, input)
    }

    /// A sample that does not go on from the one before: the first, or one
    /// whose output goes on from the code in force.
    pub fn begin(
        &self,
        output: &Output,
        state: &mut LawState,
        input: &LawInput,
        begin: Begin,
    ) -> i32 {
        state.remainder = HALF;
        state.dither(output);
        self.operands.first(output, state, input, begin)
    }

    /// The terms of `y` alone.
    pub fn terms(&self, state: &mut LawState, input: &LawInput) -> Terms {
        {
            let ki_dt = self.operands.integrating(input);
            self.operands.terms(Codes::ZERO, state, input, ki_dt)
        }
    }
}

impl Operands {
    /// A first sample, see [`Law::begin`], with the `ρ` of the memory.
    #[inline(always)]
    pub(crate) fn first(
        &self,
        output: &Output,
        state: &mut LawState,
        input: &LawInput,
        begin: Begin,
    ) -> i32 {
        if self.prepare(state, input.error, input.difference, begin) {
            let terms = self.terms(Codes::ZERO, state, input, self.ki_dt);
            return self.take_over(output, state, terms.direct);
        }
        self.step(output, state, input)
    }

    /// One sample, see [`Law::step`].
    #[inline(always)]
    pub(crate) fn step(&self, output: &Output, state: &mut LawState, input: &LawInput) -> i32 {
        // ρ                                                            [codes]
        let rounding = Codes::from_bits(i64::from(state.remainder));
        let terms = self.terms(rounding, state, input, self.integrating(input));
        self.code(output, state, terms)
    }

    /// `Ki·Δt` of a sample.
    #[inline(always)]
    fn integrating(&self, input: &LawInput) -> Term {
        if input.hold_integral {
            Term::ZERO
        } else {
            self.ki_dt
        }
    }

    /// The terms of `y`, with `ρ` and `Ki·Δt` of this sample.
    ///
    /// They are products of words and integers, exact; the sums cannot wrap
    /// ([`super::words`], section Overflow).
    #[inline(always)]
    pub(crate) fn terms(
        &self,
        rounding: Codes,
        state: &mut LawState,
        input: &LawInput,
        ki_dt: Term,
    ) -> Terms {
        // |e| ≤ E                                                     [counts]
        let e = held(input.error, self.error_limit, &mut state.left_range);
        // δ = e − e_prev  or  −(c − c_prev),  |δ| ≤ D                 [counts]
        let difference = self.difference(state, input.difference, e);
        let rate = self.rate(state, difference);
        let e = if input.within_dead_band { 0 } else { e };

        // ρ + Kp·e + (Kd/Δt)·δ                          eq. 23, 1st and 3rd term
        let mut direct = rounding
            .wrapping_add(input.ahead)
            .wrapping_add(self.kp.times(e))
            .wrapping_add(self.kd_per_dt.times(rate));
        // Kv·v + Ka·a + Kf·sign(v)
        if self.feeds_forward {
            direct = direct.wrapping_add(self.feed_forward(input.velocity, input.acceleration));
        }
        // (Ki·Δt)·e
        let step = ki_dt.times(e);
        Terms { direct, step }
    }

    /// The code of a sum: the upper word of `y + ρ`, whose lower one is what
    /// rounding leaves. One test tells whether the output can give it.
    #[inline(always)]
    pub(crate) fn code(&self, output: &Output, state: &mut LawState, terms: Terms) -> i32 {
        // I ← I + (Ki·Δt)·e                                   eq. 23, 2nd term
        let integral = state.integral.wrapping_add(terms.step);
        // y + ρ                                                        eq. 23
        let sum = terms.direct.wrapping_add(integral);
        // floor(y + ρ)                                                 eq. 24
        let whole = wide::upper(sum.to_bits());
        if output.reaches(state.code, whole) {
            state.code = whole;
            state.integral = integral;
            state.remainder = output.remainder(wide::lower(sum.to_bits()).cast_unsigned());
            return whole;
        }
        self.limit(output, state, terms.step, whole)
    }

    /// A sum that the output cannot give, whose code would be `whole`.
    #[inline(always)]
    fn limit(&self, output: &Output, state: &mut LawState, step: Codes, whole: i32) -> i32 {
        rare();
        let code = output.window(state.code).nearest(whole);
        state.code = code;
        state.integral = self.limited(state, step, whole.wrapping_sub(code));
        state.remainder = HALF;
        code
    }

    /// The integral after a sample whose sum lies `excess` codes beyond what the
    /// output can give: kept from winding up.
    #[inline(always)]
    fn limited(&self, state: &mut LawState, step: Codes, excess: i32) -> Codes {
        let next = state.integral.wrapping_add(step);
        if self.ki_dt.is_zero() {
            // No gain would ever bring back what is drawn from it here.
            return next;
        }
        // Of the step, in whole codes.
        let pushes = wide::upper(step.to_bits());
        match self.anti_windup {
            AntiWindup::None => self.bounded(next, &mut state.left_range),
            // Up to the end, and no further out.
            AntiWindup::Clamp if (pushes.wrapping_sub(excess) ^ excess) >= 0 => {
                next.wrapping_sub(codes(excess))
            }
            AntiWindup::Clamp if (pushes ^ excess) >= 0 => state.integral,
            AntiWindup::Clamp => next,
            // I ← I + (u − y)·Δt/T_t
            AntiWindup::BackCalculation { tracking } => {
                let back = wide::signed_product(tracking, excess).wrapping_shl(1);
                self.bounded(
                    next.wrapping_sub(Codes::from_bits(back)),
                    &mut state.left_range,
                )
            }
        }
    }

    /// The integral, kept where no sum can overflow; one beyond its declared range
    /// is told. Clamped it needs neither: it stays below the largest sum
    /// ([`super::words`]).
    #[inline(always)]
    fn bounded(&self, integral: Codes, left_range: &mut bool) -> Codes {
        // Both ends fill their upper word alone.
        let whole = wide::upper(integral.to_bits());
        let within = |range: i32| {
            let above = whole.wrapping_add(range).cast_unsigned();
            above < range.wrapping_mul(2).cast_unsigned()
        };
        if within(self.integral_range) {
            return integral;
        }
        rare();
        *left_range = true;
        if within(Self::INTEGRAL_MOST) {
            integral
        } else if whole > 0 {
            codes(Self::INTEGRAL_MOST)
        } else {
            codes(Self::INTEGRAL_MOST.wrapping_neg())
        }
    }

    /// Puts the memory where a sample can begin that does not go on from the one
    /// before; tells whether its output is the code in force ([`Self::take_over`]).
    #[cold]
    #[inline(never)]
    pub(crate) fn prepare(
        &self,
        state: &mut LawState,
        error: i32,
        moved: i32,
        begin: Begin,
    ) -> bool {
        let takes_over = begin != Begin::AtRest && !self.ki_dt.is_zero();
        if begin != Begin::OtherGains {
            // No error came before: no difference either.
            state.previous_error = held(error, self.error_limit, &mut false);
            state.filter_of = None;
        }
        if begin != Begin::OtherGains || !takes_over {
            // A step that an integral gain of 0 would keep for ever.
            state.integral = Codes::ZERO;
        }
        self.begin_filter(state, error, moved);
        takes_over
    }

    /// Goes on from the code in force: the integral with which the sum is that code.
    #[cold]
    #[inline(never)]
    pub(crate) fn take_over(&self, output: &Output, state: &mut LawState, direct: Codes) -> i32 {
        // I with y = the code in force
        let code = output.window(state.code).nearest(state.code);
        let integral = codes(code).wrapping_sub(direct);
        state.integral = self.bounded(integral, &mut state.left_range);
        state.remainder = HALF;
        state.code = code;
        code
    }

    /// δ, held at its limit \[counts\]; of the measurement with the other sign,
    /// which its gain has too.
    #[inline(always)]
    fn difference(&self, state: &mut LawState, moved: i32, e: i32) -> i32 {
        let previous = core::mem::replace(&mut state.previous_error, e);
        let difference = match self.derivative {
            // |e| ≤ 2^30, so the difference fits
            Derivative::Error => e.wrapping_sub(previous),
            Derivative::Measurement => moved,
        };
        let mut told = false;
        let held = held(difference, self.difference_limit, &mut told);
        // Where D outweighs everything else, nothing is lost.
        if told && self.difference_is_declared {
            state.left_range = true;
        }
        held
    }

    /// δ, filtered where that is asked for \[2^−h counts\].
    #[inline(always)]
    fn rate(&self, state: &mut LawState, difference: i32) -> i32 {
        match self.filter {
            None => difference,
            Some(filter) => filter::step(filter, &mut state.filtered, difference),
        }
    }

    /// Makes the filter's memory one that this sample can go on from.
    fn begin_filter(&self, state: &mut LawState, error: i32, moved: i32) {
        let derivative = self.derivative;
        let of = self.filter.map(|filter| (filter.fraction_bits, derivative));
        if let Some(filter) = self.filter {
            if state.filter_of == of {
                // The speed is what it was; other words may declare less of it.
                state.filtered.hold(filter, self.difference_limit);
            } else {
                // Nothing was filtered yet: start settled, without a transient.
                let mut before = *state;
                let e = held(error, self.error_limit, &mut before.left_range);
                let difference = self.difference(&mut before, moved, e);
                state.filtered = Filtered::settled(filter, difference);
            }
        }
        state.filter_of = of;
    }

    /// A feed-forward that its source has computed, within its declared range.
    pub(crate) fn held_ahead(&self, ahead: Codes) -> Codes {
        let most = codes(self.ahead_limit);
        ahead.min(most).max(most.wrapping_neg())
    }

    #[inline(always)]
    pub(crate) fn feed_forward(&self, v: i32, a: i32) -> Codes {
        let [v, a] = [v, a].map(rate_within);
        let rates = self
            .velocity
            .times(v)
            .wrapping_add(self.acceleration.times(a));
        if v > 0 {
            rates.wrapping_add(self.friction)
        } else if v < 0 {
            rates.wrapping_sub(self.friction)
        } else {
            rates
        }
    }
}

/// `value`, held between `−limit` and `limit`; a value beyond is told.
#[inline(always)]
fn held(value: i32, limit: i32, told: &mut bool) -> i32 {
    // −limit ≤ value ≤ limit is 0 ≤ value + limit ≤ 2·limit without sign.
    let above = value.wrapping_add(limit).cast_unsigned();
    if above <= limit.wrapping_mul(2).cast_unsigned() {
        return value;
    }
    rare();
    *told = true;
    if value > 0 {
        limit
    } else {
        limit.wrapping_neg()
    }
}

/// Tells the compiler which way is not the usual one.
#[cold]
#[inline(always)]
fn rare() {}

/// `count` codes.
#[inline(always)]
fn codes(count: i32) -> Codes {
    Codes::from_bits(i64::from(count).wrapping_shl(32))
}

/// A rate of the setpoint within its declared range.
#[inline(always)]
fn rate_within(rate: i32) -> i32 {
    const MOST: i32 = super::words::LARGEST_RATE.cast_signed();
    rate.min(MOST.wrapping_sub(1)).max(MOST.wrapping_neg())
}
