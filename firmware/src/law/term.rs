//! One term of the law: a gain times an integer, exact, in the unit of the sum.
//!
//! The sum of the law is an `i64` that counts `2^−F` codes. A gain `w·2^−f`
//! times an integer `x` is `w·x·2^(F−f)` of them. Shifting the product costs
//! a 32-bit processor several instructions, shifting one 32-bit factor costs
//! one; so the mantissa takes as much of the shift as its 31 bits hold, once,
//! when the gain is accepted, and `x` takes the rest:
//!
//! ```text
//! w·x·2^(F−f) = (w·2^m)·(x·2^s),   m + s = F − f,   w·2^m < 2^31,   |x|·2^s < 2^31
//! ```
//!
//! That is one 32×32→64-bit product ([`crate::product`]).

use crate::product;
use crate::widen;
use crate::word::GainWord;

/// A gain aligned to the sum's unit, for integers up to a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Term {
    mantissa: i32,
    /// `2^s`: a product costs a processor what a shift does, and no mask.
    scale: i32,
    /// Largest magnitude of the term \[2^−F codes\].
    largest: u64,
}

impl Term {
    /// The term of `word` for integers `|x| ≤ limit`, or `None` where the word
    /// is negative, is finer than the sum, or a factor needs more than 31 bits.
    pub(crate) const fn align(word: GainWord, sum_fraction_bits: u8, limit: u32) -> Option<Self> {
        let Some(whole_shift) = sum_fraction_bits.checked_sub(word.fraction_bits) else {
            return None;
        };
        let whole_shift = widen::byte(whole_shift);
        if word.mantissa == 0 {
            return Some(Self {
                mantissa: 0,
                scale: 0,
                largest: 0,
            });
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
        let Some(scale) = 2_i32.checked_pow(whole_shift.saturating_sub(taken)) else {
            return None;
        };
        let most = widen::word(limit).saturating_mul(widen::word(scale.unsigned_abs()));
        if most > widen::word(i32::MAX.unsigned_abs()) {
            return None;
        }
        Some(Self {
            mantissa,
            scale,
            // Both below 2^31.
            largest: most.wrapping_mul(widen::word(mantissa.unsigned_abs())),
        })
    }

    /// `w·x` in the sum's unit, exactly, for `|x| ≤ limit`.
    #[inline]
    pub(crate) fn times(self, x: i32) -> i64 {
        // Fits by `align`: |x|·2^s < 2^31.
        product::of_gain(self.mantissa, x.wrapping_mul(self.scale))
    }

    /// Largest magnitude of [`Term::times`] \[2^−F codes\].
    pub(crate) const fn largest(self) -> u64 {
        self.largest
    }

    /// Whether the gain is 0.
    pub(crate) const fn is_zero(self) -> bool {
        self.mantissa == 0
    }
}

/// `x·w·2^−31`, rounded to the nearest integer, halves away from zero: odd in
/// `x`; for `0 ≤ w`, `|x| < 2^62`.
pub(crate) fn scaled(x: i64, w: i32) -> i64 {
    const LOW: u64 = (1 << 31) - 1;
    let magnitude = x.unsigned_abs();
    let w = u64::from(w.unsigned_abs());
    // |x|·w = (h·2^31 + l)·w: both products are below 2^62.
    let high = magnitude.wrapping_shr(31).wrapping_mul(w);
    let low = (magnitude & LOW)
        .wrapping_mul(w)
        .wrapping_add(1 << 30)
        .wrapping_shr(31);
    let rounded = high.wrapping_add(low).cast_signed();
    if x < 0 {
        rounded.wrapping_neg()
    } else {
        rounded
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
            mantissa in 0..=i32::MAX, f in 0..=40_u8, sum in 32..=40_u8, limit_bits in 1..=30_u32,
            x in any::<i32>(),
        ) {
            let limit = 1_u32 << limit_bits;
            let x = x >> (31 - limit_bits);
            if let Some(term) = Term::align(GainWord::new(mantissa, f), sum, limit) {
                let exact = (i128::from(mantissa) * i128::from(x)) << (sum - f);
                prop_assert_eq!(i128::from(term.times(x)), exact);
                prop_assert!(term.times(x).unsigned_abs() <= term.largest());
            }
        }

        #[test]
        fn scaling_rounds_halves_away(x in -(1_i64 << 62) + 1..1 << 62, w in 0..=i32::MAX) {
            let doubled = i128::from(x.unsigned_abs()) * i128::from(w) * 2 + (1 << 31);
            let exact = (doubled >> 32) * i128::from(x.signum());
            prop_assert_eq!(i128::from(scaled(x, w)), exact);
            prop_assert_eq!(scaled(-x, w), -scaled(x, w));
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        // 2^30·2^(38−29): 2^39 of 2^−38 codes a count; 2^22 counts are 31 bits.
        let word = GainWord::new(1 << 30, 29);
        assert!(Term::align(word, 38, (1 << 22) - 1).is_some());
        assert!(Term::align(word, 38, 1 << 22).is_none());
        assert!(Term::align(word, 28, 1).is_none(), "finer than the sum");
        assert!(Term::align(GainWord::new(-1, 30), 38, 1).is_none());
        assert!(Term::align(GainWord::new(0, 0), 38, i32::MAX.unsigned_abs()).is_some());
    }
}
