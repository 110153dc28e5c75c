//! One sample of the law, top to bottom.

use super::filter::{FilterWords, Filtered};
use super::term::Term;
use super::words::LARGEST_RATE;
use super::{Begin, Law, LawInput, LawState, Terms, filter};
use crate::dac::{Codes, HALF};
use crate::output::Output;
use crate::settings::Words;
use crate::wide;
use crate::word::Part;

impl Law {
    /// One sample: the code for the errors and the motion of this sample, on the output
    /// that the memory began with ([`Law::begin`]).
    #[inline(always)]
    pub fn step(&self, output: &Output, state: &mut LawState, input: &LawInput) -> i32 {
        state.dither(output);
        let inputs = self.inputs(state, input);
        let sum = self.settings.sum::<true>(state, inputs);
        if output.reaches(state.code, sum.code(), output.slew_codes()) {
            sum.take(output, state)
        } else {
            let code = output.nearest(state.code, sum.code());
            let treatment = self.settings.anti_windup();
            self.settings.limit(state, sum, code, treatment)
        }
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
        let settings = &self.settings;
        let e = settings.held_error::<false>(input.error, &mut false);
        let moved = settings.held_movement::<false>(input.difference, &mut false);
        if !settings.begin(state, e, moved, begin) {
            return self.step(output, state, input);
        }
        state.dither(output);
        let inputs = self.inputs(state, input);
        let sum = settings.sum::<true>(state, inputs);
        let code = output.reachable(state.code, state.code);
        settings.limit(state, sum, code, TAKES_OVER)
    }

    /// The terms of `y` alone.
    pub fn terms(&self, state: &mut LawState, input: &LawInput) -> Terms {
        let inputs = self.inputs(state, input);
        self.settings.terms::<true>(Codes::ZERO, state, inputs)
    }

    /// An input within or beyond the declared ranges as the terms take it.
    #[inline(always)]
    fn inputs(&self, state: &mut LawState, input: &LawInput) -> Inputs {
        let settings = &self.settings;
        // |e| ≤ E                                                     [counts]
        let e = settings.held_error::<true>(input.error, &mut state.left_range);
        let rates = if settings.feeds_forward() {
            settings.feed_forward::<true>(input.velocity, input.acceleration)
        } else {
            Codes::ZERO
        };
        let ki_dt = if input.hold_integral {
            Term::ZERO
        } else {
            settings.gain(Part::Integral)
        };
        Inputs {
            e,
            counted: if input.within_dead_band { 0 } else { e },
            moved: if settings.derivative_of_measurement() != 0 {
                settings.held_movement::<true>(input.difference, &mut state.left_range)
            } else {
                0
            },
            ahead: input.ahead.wrapping_add(rates),
            ki_dt,
        }
    }
}

/// Inputs of a sample as the law takes them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inputs {
    /// `e` within its range \[counts\].
    pub(crate) e: i32,
    /// The same, 0 within the dead band.
    pub(crate) counted: i32,
    /// `c − c_prev`, within its range where the derivative is its \[counts\].
    pub(crate) moved: i32,
    /// Feed-forward \[codes\].
    pub(crate) ahead: Codes,
    /// `Ki·Δt`, 0 while the integral is held.
    pub(crate) ki_dt: Term,
}

impl Words {
    /// The terms of `y`, with `ρ`; of gains that may be constants of an image.
    ///
    /// They are products of words and integers, exact; the sums cannot wrap
    /// ([`super::words`], section Overflow).
    #[inline(always)]
    pub(crate) fn terms<const CONSTANT: bool>(
        &self,
        rounding: Codes,
        state: &mut LawState,
        inputs: Inputs,
    ) -> Terms {
        let (e, counted) = (inputs.e, inputs.counted);
        // δ = e − e_prev  or  −(c − c_prev),  |δ| ≤ D                 [counts]
        let (before, left_range) = (state.previous_error, &mut state.left_range);
        let difference = self.difference::<CONSTANT>(before, e, inputs.moved, left_range);
        state.previous_error = e;
        // δ, filtered where that is asked for                    [2^−h counts]
        let rate = if self.filter_smoothing() == 0 {
            difference
        } else {
            filter::step(self, &mut state.filtered, difference)
        };
        let errors = self.error_limit_counts();
        let differences = match self.filter_smoothing() {
            0 => self.difference_limit_counts(),
            _ => FilterWords::LARGEST_DIFFERENCE,
        };
        let (kp, kd_per_dt) = (self.gain(Part::Proportional), self.gain(Part::Derivative));
        // ρ + FF + Kp·e + (Kd/Δt)·δ                     eq. 23, 1st and 3rd term
        let direct = rounding
            .wrapping_add(inputs.ahead)
            .wrapping_add(term::<CONSTANT>(kp, counted, errors))
            .wrapping_add(term::<CONSTANT>(kd_per_dt, rate, differences));
        // (Ki·Δt)·e
        let step = term::<CONSTANT>(inputs.ki_dt, counted, errors);
        Terms { direct, step }
    }

    /// The sum of a sample.
    #[inline(always)]
    pub(crate) fn sum<const CONSTANT: bool>(&self, state: &mut LawState, inputs: Inputs) -> Sum {
        let rounding = Codes::from_bits(i64::from(state.remainder));
        let Terms { direct, step } = self.terms::<CONSTANT>(rounding, state, inputs);
        // I ← I + (Ki·Δt)·e                                   eq. 23, 2nd term
        let integral = state.integral.wrapping_add(step);
        Sum {
            codes: direct.wrapping_add(integral),
            integral,
        }
    }

    /// `e` within its range \[counts\].
    #[inline(always)]
    pub(crate) fn held_error<const CONSTANT: bool>(
        &self,
        error: i32,
        left_range: &mut bool,
    ) -> i32 {
        held::<CONSTANT>(error, self.error_limit_counts(), left_range)
    }

    /// A measured difference within its range \[counts\].
    #[inline(always)]
    pub(crate) fn held_movement<const CONSTANT: bool>(
        &self,
        moved: i32,
        left_range: &mut bool,
    ) -> i32 {
        let mut beyond = false;
        let moved = held::<CONSTANT>(moved, self.difference_limit_counts(), &mut beyond);
        // Where D outweighs everything else, nothing is lost.
        if beyond && self.difference_is_declared() != 0 {
            *left_range = true;
        }
        moved
    }

    /// `δ = e − e_prev` or `−(c − c_prev)`, `|δ| ≤ D` \[counts\].
    #[inline(always)]
    fn difference<const CONSTANT: bool>(
        &self,
        previous_error: i32,
        e: i32,
        moved: i32,
        left_range: &mut bool,
    ) -> i32 {
        if self.derivative_of_measurement() != 0 {
            return moved.wrapping_neg();
        }
        // |e| ≤ 2^29, so the difference fits
        self.held_movement::<CONSTANT>(e.wrapping_sub(previous_error), left_range)
    }

    /// A sum that the output cannot give, or is not to: `code` instead, with the integral
    /// kept from winding up, or where the sum is that code.
    #[inline(always)]
    pub(crate) fn limit(&self, state: &mut LawState, sum: Sum, code: i32, treatment: u32) -> i32 {
        rare();
        let next = sum.integral;
        // x, and the integral's step, in whole codes
        let excess = sum.code().wrapping_sub(code);
        let pushes = wide::upper(next.wrapping_sub(state.integral).to_bits());
        let rounding = Codes::from_bits(i64::from(state.remainder));
        state.code = code;
        state.remainder = HALF;
        let unbounded = match treatment {
            // No gain would ever bring back what is drawn from it here.
            _ if self.ki_dt_mantissa() == 0 => {
                state.integral = next;
                return code;
            }
            1 => {
                if (pushes.wrapping_sub(excess) ^ excess) >= 0 {
                    // Up to the end, and no further out.
                    state.integral = next.wrapping_sub(codes(excess));
                } else if (pushes ^ excess) < 0 {
                    state.integral = next;
                }
                return code;
            }
            // I ← I + (u − y)·Δt/T_t
            2 => {
                let back = wide::signed_product(self.tracking().cast_signed(), excess);
                next.wrapping_sub(Codes::from_bits(back.wrapping_shl(1)))
            }
            // I with y = the code
            TAKES_OVER => {
                next.wrapping_sub(sum.codes.wrapping_sub(rounding).wrapping_sub(codes(code)))
            }
            _ => next,
        };
        state.integral = self.bounded(unbounded, &mut state.left_range);
        code
    }

    /// The integral, kept where no sum can overflow; one beyond its declared range
    /// is told. Clamped it needs neither: it stays below the largest sum
    /// ([`super::words`]).
    #[inline(always)]
    fn bounded(&self, integral: Codes, left_range: &mut bool) -> Codes {
        // Both ends fill their upper word alone.
        let range = self.integral_range_codes();
        let whole = wide::upper(integral.to_bits());
        if whole.cast_unsigned().wrapping_add(range) < range.wrapping_mul(2) {
            return integral;
        }
        rare();
        *left_range = true;
        Codes::from_bits(wide::within(integral.to_bits(), INTEGRAL_MOST))
    }

    /// Puts the memory where a sample can begin that does not go on from the one
    /// before; tells whether its output is the code in force ([`TAKES_OVER`]).
    #[cold]
    #[inline(never)]
    pub(crate) fn begin(&self, state: &mut LawState, e: i32, moved: i32, begin: Begin) -> bool {
        let anew = match begin {
            Begin::GoingOn => return false,
            Begin::OtherGains => false,
            Begin::AtRest | Begin::FromCode => true,
        };
        let takes_over = begin != Begin::AtRest && self.ki_dt_mantissa() != 0;
        if anew {
            state.previous_error = e;
        }
        if anew || !takes_over {
            // A step that an integral gain of 0 would keep for ever.
            state.integral = Codes::ZERO;
        }
        if self.filter_smoothing() != 0 {
            if !anew && state.filter_of == self.filter() {
                // The speed is what it was; other words may declare less of it.
                state.filtered.hold(self);
            } else {
                // Nothing was filtered yet: start settled, without a transient.
                let difference =
                    self.difference::<false>(state.previous_error, e, moved, &mut false);
                state.filtered = Filtered::settled(self, difference);
            }
        }
        state.filter_of = self.filter();
        takes_over
    }

    /// Number of the filter that a memory is of: its unit, and what it filters.
    fn filter(&self) -> u32 {
        if self.filter_smoothing() == 0 {
            return 0;
        }
        self.filter_scale().wrapping_shl(1) | self.derivative_of_measurement()
    }

    /// Tells whether any feed-forward is not zero.
    #[inline(always)]
    pub(crate) const fn feeds_forward(&self) -> bool {
        (self.velocity_ff_mantissa()
            | self.acceleration_ff_mantissa()
            | self.friction_ff_mantissa())
            != 0
    }

    /// `Kv·v + Ka·a + Kf·sign(v)` \[codes\]; of gains that may be constants of an image.
    #[inline(always)]
    pub(crate) fn feed_forward<const CONSTANT: bool>(&self, v: i32, a: i32) -> Codes {
        let velocity = term::<CONSTANT>(self.gain(Part::Velocity), rate(v), LARGEST_RATE);
        let acceleration = term::<CONSTANT>(self.gain(Part::Acceleration), rate(a), LARGEST_RATE);
        let rates = velocity.wrapping_add(acceleration);
        let friction = self.gain(Part::Friction).times(1);
        match v {
            0 => rates,
            1.. => rates.wrapping_add(friction),
            _ => rates.wrapping_sub(friction),
        }
    }

    /// Keeps a feed-forward that its source has computed within its declared range.
    #[inline(always)]
    pub(crate) fn hold_ahead(&self, ahead: &mut Codes) {
        *ahead = Codes::from_bits(wide::within(ahead.to_bits(), self.ahead_limit_codes()));
    }
}

/// The sum of a sample with what rounding adds, and the integral that it has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sum {
    /// `y + ρ` \[codes\]                                                  eq. 23
    codes: Codes,
    integral: Codes,
}

impl Sum {
    /// `floor(y + ρ)`: the upper word                                   eq. 24
    #[inline(always)]
    pub(crate) const fn code(self) -> i32 {
        wide::upper(self.codes.to_bits())
    }

    /// The code of a sum that the output can give; the lower word is what rounding
    /// leaves.
    #[inline(always)]
    pub(crate) fn take(self, output: &Output, state: &mut LawState) -> i32 {
        if output.keeps_rest() {
            state.remainder = wide::lower(self.codes.to_bits()).cast_unsigned();
        }
        state.integral = self.integral;
        state.code = self.code();
        state.code
    }
}

/// A velocity or an acceleration as the feed-forward takes it.
#[inline(always)]
fn rate(value: i32) -> i32 {
    const MOST: i32 = LARGEST_RATE.cast_signed();
    value.min(MOST.wrapping_sub(1)).max(MOST.wrapping_neg())
}

/// A term of an integer `|x| ≤ limit`.
#[inline(always)]
fn term<const CONSTANT: bool>(term: Term, x: i32, limit: u32) -> Codes {
    if CONSTANT {
        term.times_as_constant(x, limit)
    } else {
        term.times(x)
    }
}

/// Largest magnitude of the integral \[codes\].
const INTEGRAL_MOST: u32 = 1 << 30;

/// In the place of a treatment of wind-up: the output goes on from the code in force.
pub(crate) const TAKES_OVER: u32 = 3;

/// `value`, held between `−limit` and `limit`; one beyond is told. With a limit that is a
/// constant of the image nearly every value is within a power of two below it, which
/// takes half the instructions of 32 bits.
#[inline(always)]
fn held<const CONSTANT: bool>(value: i32, limit: u32, beyond: &mut bool) -> i32 {
    let narrow = CONSTANT && cfg!(target_pointer_width = "32");
    let (bits, usual) = (value.cast_unsigned(), power_of_two_within(limit));
    // −limit ≤ value ≤ limit is 0 ≤ value + limit ≤ 2·limit without sign.
    let is_usual = match narrow {
        true => bits.wrapping_add(usual) < usual.wrapping_mul(2),
        false => bits.wrapping_add(limit) <= limit.wrapping_mul(2),
    };
    if is_usual {
        return value;
    }
    rare();
    if narrow && value.unsigned_abs() <= limit {
        return value;
    }
    *beyond = true;
    let limit = limit.cast_signed();
    if value > 0 {
        limit
    } else {
        limit.wrapping_neg()
    }
}

/// The largest power of two up to `limit`: a constant that many an instruction has room
/// for.
const fn power_of_two_within(limit: u32) -> u32 {
    let zeros = limit.leading_zeros();
    (1_u32 << 31).wrapping_shr(zeros)
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
