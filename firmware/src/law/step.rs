//! One sample of the law, top to bottom.

use super::words::{AntiWindup, Derivative};
use super::{Begin, HALF, Law, LawInput, LawState, Terms, filter};
use crate::dac::Codes;
use crate::output::{Output, Quantiser};
use crate::wide;

impl Law {
    /// One sample: the code for the errors and the motion of this sample.
    #[inline(always)]
    pub fn step(&self, output: &Output, state: &mut LawState, input: &LawInput) -> i32 {
        // ρ                                                            [codes]
        let rounding = rounding(output, state);
        let terms = self.terms_from(rounding, state, input);
        self.code(output, state, terms)
    }

    /// The terms of `y`, with `ρ` of this sample.
    ///
    /// They are products of words and integers, exact; the sums cannot wrap
    /// ([`super::words`], section Overflow).
    #[inline(always)]
    fn terms_from(&self, rounding: Codes, state: &mut LawState, input: &LawInput) -> Terms {
        // |e| ≤ E                                                     [counts]
        let e = held(input.error, self.error_limit, &mut state.left_range);
        // δ = e − e_prev  or  −(c − c_prev),  |δ| ≤ D                 [counts]
        let difference = self.difference(state, input, e);
        let rate = self.rate(state, difference);
        let e = if input.within_dead_band { 0 } else { e };

        // ρ + Kp·e + (Kd/Δt)·δ                          eq. 23, 1st and 3rd term
        let mut direct = rounding
            .wrapping_add(self.kp.times(e))
            .wrapping_add(self.kd_per_dt.times(rate));
        // Kv·v + Ka·a + Kf·sign(v)
        if self.feeds_forward {
            direct = direct.wrapping_add(self.feed_forward(input));
        }
        // (Ki·Δt)·e
        let step = if input.hold_integral {
            Codes::ZERO
        } else {
            self.ki_dt.times(e)
        };
        Terms { direct, step }
    }

    /// The terms of `y` alone.
    pub fn terms(&self, state: &mut LawState, input: &LawInput) -> Terms {
        self.terms_from(Codes::ZERO, state, input)
    }

    /// The code of a sum: the upper word of `y + ρ`, whose lower one is what
    /// rounding leaves. One test tells whether the output can give it.
    #[inline(always)]
    fn code(&self, output: &Output, state: &mut LawState, terms: Terms) -> i32 {
        // I ← I + (Ki·Δt)·e                                   eq. 23, 2nd term
        let integral = state.integral.wrapping_add(terms.step);
        // y + ρ                                                        eq. 23
        let sum = terms.direct.wrapping_add(integral);
        // floor(y + ρ)                                                 eq. 24
        let whole = wide::upper(sum.to_bits());
        let code = output.window(state.code).nearest(whole);
        state.code = code;
        if code == whole {
            state.integral = integral;
            state.remainder = wide::lower(sum.to_bits()).cast_unsigned();
            return code;
        }
        rare();
        state.integral = self.limited(state, terms.step, whole.wrapping_sub(code));
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
        match self.words.anti_windup {
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

    /// A sample that does not go on from the one before: the first, or one
    /// whose output goes on from the code in force.
    #[cold]
    #[inline(never)]
    pub fn begin(
        &self,
        output: &Output,
        state: &mut LawState,
        input: &LawInput,
        begin: Begin,
    ) -> i32 {
        if begin != Begin::OtherGains {
            // No error came before: no difference either.
            state.previous_error = held(input.error, self.error_limit, &mut false);
            state.integral = Codes::ZERO;
            state.filter_of = None;
        }
        state.remainder = HALF;
        self.begin_filter(state, input);
        let mut terms = self.terms(state, input);
        if begin != Begin::AtRest {
            if !self.ki_dt.is_zero() {
                // I with y = the code in force
                let code = output.window(state.code).nearest(state.code);
                let integral = codes(code).wrapping_sub(terms.direct);
                state.integral = self.bounded(integral, &mut state.left_range);
                state.code = code;
                return code;
            }
            // A step that an integral gain of 0 would keep for ever.
            state.integral = Codes::ZERO;
        }
        terms.direct = terms.direct.wrapping_add(rounding(output, state));
        self.code(output, state, terms)
    }

    /// δ, held at its limit \[counts\]; of the measurement with the other sign,
    /// which its gain has too.
    #[inline(always)]
    fn difference(&self, state: &mut LawState, input: &LawInput, e: i32) -> i32 {
        let previous = core::mem::replace(&mut state.previous_error, e);
        let difference = match self.words.derivative {
            // |e| ≤ 2^30, so the difference fits
            Derivative::Error => e.wrapping_sub(previous),
            Derivative::Measurement => input.difference,
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
        match self.words.filter {
            None => difference,
            Some(filter) => filter::step(filter, &mut state.filtered, difference),
        }
    }

    /// Makes the filter's memory one that this sample can go on from.
    fn begin_filter(&self, state: &mut LawState, input: &LawInput) {
        let derivative = self.words.derivative;
        let of = self
            .words
            .filter
            .map(|filter| (filter.fraction_bits, derivative));
        if let Some(filter) = self.words.filter {
            state.filtered = if state.filter_of == of {
                // The speed is what it was; other words may declare less of it.
                let most = filter::settled(filter, self.difference_limit);
                state.filtered.min(most).max(most.wrapping_neg())
            } else {
                // Nothing was filtered yet: start settled, without a transient.
                let mut before = *state;
                let e = held(input.error, self.error_limit, &mut before.left_range);
                filter::settled(filter, self.difference(&mut before, input, e))
            };
        }
        state.filter_of = of;
    }

    #[inline(always)]
    fn feed_forward(&self, input: &LawInput) -> Codes {
        let [v, a] = [input.velocity, input.acceleration].map(rate_within);
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

/// `ρ` of this sample ([`crate::output`]).
#[inline(always)]
fn rounding(output: &Output, state: &mut LawState) -> Codes {
    let rounding = match output.quantiser() {
        Quantiser::Nearest => HALF,
        Quantiser::ErrorFeedback => state.remainder,
        Quantiser::Dither { .. } => {
            // A linear congruential generator of full period (Numerical
            // Recipes, section 7.1, "quick and dirty"): modulo 2^32, its upper
            // bits are what rounding looks at.
            state.random = state
                .random
                .wrapping_mul(1_664_525)
                .wrapping_add(1_013_904_223);
            state.random
        }
    };
    Codes::from_bits(i64::from(rounding))
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
