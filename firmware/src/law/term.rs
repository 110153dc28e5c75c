//! One term of the law: a gain times an integer, exact.
//!
//! A sum counts 2^−32 codes ([`Codes`]). A gain `w·2^−f` times an integer `x` is
//! `w·x·2^(32−f)` of them. Shifting the product costs
//! a 32-bit processor several instructions, shifting one 32-bit factor costs
//! one; so the mantissa takes as much of the shift as its 31 bits hold, once,
//! when the gain is accepted, and `x` takes the rest:
//!
//! ```text
//! w·x·2^(32−f) = (w·2^m)·(x·2^s),   m + s = 32 − f,   w·2^m < 2^31,   |x|·2^s < 2^31
//! ```
//!
//! That is one 32×32→64-bit product ([`crate::wide`]). A processor without
//! it has a shorter way where gain and integer are narrow: a gain of 24 bits
//! times an integer of 17 needs 41 bits, so two products of 32 bits with parts
//! of the gain do, where the general product takes four of 16-bit halves:
//!
//! ```text
//! w·x·2^s = (H·x)·2^(s+t) + (L·x)·2^s,   w = H·2^t + L,   |H·x|, |L·x| < 2^31,   s + t ≤ 31
//! ```

use crate::dac::Codes;
use crate::settings::{Settings, Words};
use crate::wide::{self, by_target};
use crate::word::{GainWord, Part};

/// Fraction bits of a sum, and of a gain at most.
pub(crate) const FRACTION_BITS: u8 = 32;

/// A gain aligned to the unit of a sum, for integers up to a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Term {
    pub(crate) mantissa: i32,
    /// `2^s`: a product costs a processor what a shift does, and no mask.
    pub(crate) scale: i32,
}

impl Term {
    /// No gain.
    pub(crate) const ZERO: Self = Self {
        mantissa: 0,
        scale: 1,
    };

    /// The term of `word` for integers `|x| ≤ limit`, or `None` where the word
    /// is negative, is finer than the sum, or a factor needs more than 31 bits.
    pub(crate) const fn align(word: GainWord, limit: u32) -> Option<Self> {
        let Some(whole_shift) = FRACTION_BITS.checked_sub(word.fraction_bits) else {
            return None;
        };
        let whole_shift = wide::byte(whole_shift);
        if word.mantissa == 0 {
            return Some(Self::ZERO);
        }
        // Zero bits above the mantissa, less the sign; none above a negative one.
        let Some(room) = word.mantissa.leading_zeros().checked_sub(1) else {
            return None;
        };
        let taken = if whole_shift < room {
            whole_shift
        } else {
            room
        };
        let mantissa = word.mantissa.wrapping_shl(taken);
        let shift = whole_shift.saturating_sub(taken);
        if shift > 30 {
            return None;
        }
        let scale = 1_i32.wrapping_shl(shift);
        let most = wide::word(limit).saturating_mul(wide::word(scale.unsigned_abs()));
        if most > wide::word(i32::MAX.unsigned_abs()) {
            return None;
        }
        Some(Self { mantissa, scale })
    }

    /// `w·2^−f·x` \[codes\], exactly, for `|x| ≤ limit`.
    #[inline(always)]
    pub(crate) fn times(self, x: i32) -> Codes {
        // Fits by `align`: |x|·2^s < 2^31.
        Codes::from_bits(wide::signed_product(
            self.mantissa,
            x.wrapping_mul(self.scale),
        ))
    }

    /// The same where the term is a constant of the image.
    #[inline(always)]
    pub(crate) fn times_as_constant(self, x: i32, limit: u32) -> Codes {
        by_target!(
            {
                let _ = limit;
                self.times(x)
            },
            self.times_in_parts(x, limit)
        )
    }

    #[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
    #[inline(always)]
    fn times_in_parts(self, x: i32, limit: u32) -> Codes {
        let zeros = self.mantissa.trailing_zeros();
        let shift = zeros.wrapping_add(self.scale.trailing_zeros());
        let word = self.mantissa.checked_shr(zeros).unwrap_or(0);
        match narrow::Narrow::of(word, shift, limit) {
            Some(narrow) => Codes::from_bits(narrow.times(x)),
            None => self.times(x),
        }
    }

    /// Largest magnitude of [`Term::times`] \[2^−32 codes\]: that of `limit`, for
    /// which the term was aligned.
    pub(crate) const fn largest(self, limit: u32) -> u64 {
        // Both below 2^31, by `align`.
        let scaled = limit.wrapping_mul(self.scale.unsigned_abs());
        wide::word(self.mantissa.unsigned_abs()).wrapping_mul(wide::word(scaled))
    }
}

/// Gains among the words of settings.
impl Settings {
    /// Settings with these six gains and everything else off.
    pub(crate) const fn of_terms([kp, ki_dt, kd_per_dt, v, a, friction]: [Term; 6]) -> Self {
        Self {
            kp_mantissa: kp.mantissa.cast_unsigned(),
            kp_scale: kp.scale.cast_unsigned(),
            ki_dt_mantissa: ki_dt.mantissa.cast_unsigned(),
            ki_dt_scale: ki_dt.scale.cast_unsigned(),
            kd_per_dt_mantissa: kd_per_dt.mantissa.cast_unsigned(),
            kd_per_dt_scale: kd_per_dt.scale.cast_unsigned(),
            velocity_ff_mantissa: v.mantissa.cast_unsigned(),
            velocity_ff_scale: v.scale.cast_unsigned(),
            acceleration_ff_mantissa: a.mantissa.cast_unsigned(),
            acceleration_ff_scale: a.scale.cast_unsigned(),
            friction_ff_mantissa: friction.mantissa.cast_unsigned(),
            friction_ff_scale: friction.scale.cast_unsigned(),
            ..Self::OFF
        }
    }
}

impl Words {
    /// The gain of a part of the law.
    #[inline(always)]
    pub(crate) const fn gain(&self, part: Part) -> Term {
        let [mantissa, scale] = match part {
            Part::Proportional => [self.kp_mantissa(), self.kp_scale()],
            Part::Integral => [self.ki_dt_mantissa(), self.ki_dt_scale()],
            Part::Derivative => [self.kd_per_dt_mantissa(), self.kd_per_dt_scale()],
            Part::Velocity => [self.velocity_ff_mantissa(), self.velocity_ff_scale()],
            Part::Acceleration => [
                self.acceleration_ff_mantissa(),
                self.acceleration_ff_scale(),
            ],
            Part::Friction => [self.friction_ff_mantissa(), self.friction_ff_scale()],
        };
        Term {
            mantissa: mantissa.cast_signed(),
            scale: scale.cast_signed(),
        }
    }
}

/// Terms from two products of 32 bits, where the gain is a constant of the image: the
/// parts are then in the instructions.
#[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
mod narrow {
    use crate::wide;

    /// A gain in two parts, aligned to the sum's unit.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(super) struct Narrow {
        high: i32,
        low: i32,
        /// `s + t`.
        high_shift: Shift,
        /// `s`.
        low_shift: Shift,
    }

    /// A shift of a word into a double one.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Shift {
        /// `2^places`, for up to 31 of them: a product needs no mask.
        factor: u32,
        /// Rest of 31 places.
        rest: u32,
    }

    impl Narrow {
        /// The parts of `mantissa·2^shift`, `mantissa ≥ 0`, for integers
        /// `0 < |x| ≤ limit`; `None` where they are too wide.
        #[inline(always)]
        pub(super) fn of(mantissa: i32, shift: u32, limit: u32) -> Option<Self> {
            // The largest t that leaves L·x its 31 bits, and the shift its 31.
            let by_limit = limit.saturating_sub(1).leading_zeros().saturating_sub(1);
            let t = by_limit.min(31_u32.checked_sub(shift)?);
            let high = mantissa.wrapping_shr(t);
            let low = mantissa.wrapping_sub(high.wrapping_shl(t));
            let most = wide::word(high.unsigned_abs()).saturating_mul(wide::word(limit));
            if most > wide::word(i32::MAX.unsigned_abs()) {
                return None;
            }
            Some(Self {
                high,
                low,
                high_shift: Shift::by(shift.saturating_add(t)),
                low_shift: Shift::by(shift),
            })
        }

        /// `w·x·2^s`.
        #[inline(always)]
        pub(super) fn times(self, x: i32) -> i64 {
            let high = self.high_shift.of(self.high.wrapping_mul(x));
            high.wrapping_add(self.low_shift.of(self.low.wrapping_mul(x)))
        }
    }

    impl Shift {
        #[inline(always)]
        fn by(places: u32) -> Self {
            Self {
                factor: 1_u32.wrapping_shl(places),
                rest: 31_u32.saturating_sub(places),
            }
        }

        /// `value` shifted, from shifts of words.
        #[inline(always)]
        fn of(self, value: i32) -> i64 {
            let low = value.cast_unsigned().wrapping_mul(self.factor);
            // Down by 32 less the places, in two steps: a word is never shifted by 32.
            let high = value.wrapping_shr(1).wrapping_shr(self.rest);
            i64::from(high).wrapping_shl(32) | i64::from(low)
        }
    }
}

#[cfg(test)]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::integer_division_remainder_used,
    reason = "a model computes as the mathematics does, with overflow checks on"
)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100_000))]

        #[test]
        fn a_term_is_the_gain_times_the_integer(
            mantissa in 0..=i32::MAX, f in 0..=32_u8, limit_bits in 1..=30_u32, x in any::<i32>(),
        ) {
            let limit = 1_u32 << limit_bits;
            let x = x >> (31 - limit_bits);
            if let Some(term) = Term::align(GainWord::new(mantissa, f), limit) {
                let exact = (i128::from(mantissa) * i128::from(x)) << (32 - f);
                prop_assert_eq!(i128::from(term.times(x).to_bits()), exact);
                prop_assert!(term.times(x).to_bits().unsigned_abs() <= term.largest(limit));
                prop_assert_eq!(i128::from(term.times_in_parts(x, limit).to_bits()), exact);
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        // 2^30·2^(32−23): 2^39 of 2^−32 codes a count; 2^22 counts are 31 bits.
        let word = GainWord::new(1 << 30, 23);
        assert!(Term::align(word, (1 << 22) - 1).is_some());
        assert!(Term::align(word, 1 << 22).is_none());
        let finer = GainWord::new(1, 33);
        assert!(Term::align(finer, 1).is_none(), "finer than the sum");
        assert!(Term::align(GainWord::new(-1, 30), 1).is_none());
        assert!(Term::align(GainWord::new(0, 0), i32::MAX.unsigned_abs()).is_some());
    }
}
