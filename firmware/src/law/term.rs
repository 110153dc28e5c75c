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
//! That is one 32×32→64-bit product ([`crate::product`]). A processor without
//! it has a shorter way where gain and integer are narrow ([`super::narrow`]).

#[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
use super::narrow::Narrow;
use crate::product::{self, by_target};
use crate::widen;
use crate::word::GainWord;

/// A gain aligned to the sum's unit, for integers up to a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Term {
    mantissa: i32,
    /// `2^s`: a product costs a processor what a shift does, and no mask.
    scale: i32,
    #[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
    narrow: Option<Narrow>,
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
                #[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
                narrow: Narrow::of(0, 0, limit),
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
        let shift = whole_shift.saturating_sub(taken);
        if shift > 30 {
            return None;
        }
        let scale = 1_i32.wrapping_shl(shift);
        let most = widen::word(limit).saturating_mul(widen::word(scale.unsigned_abs()));
        if most > widen::word(i32::MAX.unsigned_abs()) {
            return None;
        }
        Some(Self {
            mantissa,
            scale,
            #[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
            narrow: match whole_shift.to_le_bytes() {
                [shift, ..] => Narrow::of(word.mantissa, shift, limit),
            },
        })
    }

    /// `w·x` in the sum's unit, exactly, for `|x| ≤ limit`.
    #[inline]
    pub(crate) fn times(self, x: i32) -> i64 {
        by_target!(
            self.times_wide(x),
            match self.narrow {
                Some(narrow) => narrow.times(x),
                None => self.times_wide(x),
            }
        )
    }

    #[inline]
    fn times_wide(self, x: i32) -> i64 {
        // Fits by `align`: |x|·2^s < 2^31.
        product::signed(self.mantissa, x.wrapping_mul(self.scale))
    }

    /// Largest magnitude of [`Term::times`] \[2^−F codes\]: that of `limit`, for
    /// which the term was aligned.
    pub(crate) const fn largest(self, limit: u32) -> u64 {
        // Both below 2^31, by `align`.
        let scaled = limit.wrapping_mul(self.scale.unsigned_abs());
        widen::word(self.mantissa.unsigned_abs()).wrapping_mul(widen::word(scaled))
    }

    /// Tells whether the gain is 0.
    pub(crate) const fn is_zero(self) -> bool {
        self.mantissa == 0
    }
}

/// `x·w·2^−31`, rounded to the nearest integer, halves away from zero: odd in
/// `x`; for `0 ≤ w`, `|x| < 2^62`.
#[inline]
pub(crate) fn scaled(x: i64, w: i32) -> i64 {
    let [l0, l1, l2, l3, h0, h1, h2, h3] = x.to_le_bytes();
    let low = u32::from_le_bytes([l0, l1, l2, l3]);
    let high = i32::from_le_bytes([h0, h1, h2, h3]);
    // Adding ½ and cutting off rounds halves up; one unit less below zero
    // makes that halves away from zero.
    let half = (1_i32 << 30).wrapping_add(high.wrapping_shr(31));
    // x·w + ½ = H·w·2^32 + (L·w + ½), the bracket at least 0 and below 2^64
    let lower = product::unsigned(low, w.cast_unsigned())
        .wrapping_add(u64::from(half.cast_unsigned()))
        .cast_signed();
    let upper = product::signed(w, high).wrapping_add(lower.wrapping_shr(32));
    // Cut to 2^31 of them: from the upper two words of three and one bit more.
    let bit = lower.cast_unsigned().wrapping_shr(31) & 1;
    (upper.wrapping_shl(1).cast_unsigned() | bit).cast_signed()
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
                prop_assert!(term.times(x).unsigned_abs() <= term.largest(limit));
                if let Some(narrow) = term.narrow {
                    prop_assert_eq!(i128::from(narrow.times(x)), exact);
                }
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
    fn gains_of_24_bits_are_narrow_at_17_bits_of_error() {
        let narrow = |mantissa, f, limit| {
            let term = Term::align(GainWord::new(mantissa, f), 38, limit)?;
            term.narrow
        };
        for f in 20..=38 {
            assert!(narrow((1 << 24) - 1, f, 1 << 17).is_some(), "{f}");
        }
        // Contrast: 42 bits and more.
        assert!(narrow((1 << 30) - 1, 38, 1 << 17).is_none());
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
