//! Double words: words into them and back, and products of words with all 64
//! bits, chosen per target and the same on every one.
//!
//! # Conversions
//!
//! `From` and `TryFrom` cannot run in constants, and an image that is optimised for
//! its bytes takes a word apart where bytes say the same. So this file has `as`, and
//! besides it only the number of an enumeration's value.
//!
//! # Products
//!
//! Every product of two 32-bit words fits 64 bits, so nothing here can wrap.
//! ARMv7-M and larger processors have one instruction for it. ARMv6-M (the
//! Cortex-M0) multiplies 32 bits by 32 to the lower 32 only, and the
//! compiler's own routine for 64 bits by 64 takes about 40 instructions; there
//! the product is formed from those of 16-bit halves:
//!
//! ```text
//! a·b = ah·bh·2^32 + (ah·bl + al·bh)·2^16 + al·bl,   a = ah·2^16 + al,   0 ≤ al < 2^16
//! ```
//!
//! For words with sign `ah` and `bh` have it and `al` and `bl` do not, so that
//! nothing is to be corrected afterwards.

#![allow(
    clippy::as_conversions,
    reason = "each conversion has its function here, whose name says what is kept"
)]

/// A byte as a word.
pub(crate) const fn byte(value: u8) -> u32 {
    value as u32
}

/// A word as a double one.
pub(crate) const fn word(value: u32) -> u64 {
    value as u64
}

/// A word as a double one with a sign.
pub(crate) const fn unsigned(value: u32) -> i64 {
    value as i64
}

/// A byte as a double one with a sign.
pub(crate) const fn bits(value: u8) -> i64 {
    value as i64
}

/// A word with a sign as a double one.
pub(crate) const fn signed(value: i32) -> i64 {
    value as i64
}

/// The word that a double one fits, if it does.
pub(crate) const fn narrowed(value: u64) -> Option<u32> {
    let narrow = value as u32;
    if word(narrow) == value {
        Some(narrow)
    } else {
        None
    }
}

/// A double word with a sign, held at the end of the type.
pub(crate) const fn held(value: u64) -> i64 {
    if value > i64::MAX.unsigned_abs() {
        i64::MAX
    } else {
        value.cast_signed()
    }
}

/// The upper word, `floor(value/2^32)`.
#[inline(always)]
pub(crate) const fn upper(value: i64) -> i32 {
    value.wrapping_shr(32) as i32
}

/// The lower word: two's complement is arithmetic modulo 2^32.
#[inline(always)]
pub(crate) const fn lower(value: i64) -> i32 {
    value as i32
}

/// The double word of an upper and a lower one.
#[inline(always)]
pub(crate) const fn joined(upper: i32, lower: i32) -> i64 {
    signed(upper).wrapping_shl(32) | unsigned(lower.cast_unsigned())
}

/// `value` within `±most` in its upper word; of the upper end that word alone.
#[inline(never)]
pub(crate) fn within(value: i64, most: u32) -> i64 {
    let whole = upper(value);
    if whole.cast_unsigned().wrapping_add(most) < most.wrapping_mul(2) {
        return value;
    }
    let most = joined(most.cast_signed(), 0);
    if whole < 0 { most.wrapping_neg() } else { most }
}

/// True if the processor has a long multiplication. Of Arm's, those without
/// are the ones without compare-and-swap.
macro_rules! by_target {
    ($long:expr, $halves:expr) => {{
        #[cfg(not(all(target_arch = "arm", not(target_has_atomic = "32"))))]
        {
            $long
        }
        #[cfg(all(target_arch = "arm", not(target_has_atomic = "32")))]
        {
            $halves
        }
    }};
}

pub(crate) use by_target;

/// `u·v`.
#[inline]
pub(crate) fn product(u: u32, v: u32) -> u64 {
    by_target!(
        u64::from(u).wrapping_mul(u64::from(v)),
        halves::unsigned(u, v)
    )
}

/// `a·b`.
#[inline]
pub(crate) fn signed_product(a: i32, b: i32) -> i64 {
    by_target!(
        i64::from(a).wrapping_mul(i64::from(b)),
        halves::signed(a, b)
    )
}

/// `floor(u·v/2^64)`.
#[inline]
pub(crate) fn high_product(u: u64, v: u64) -> u64 {
    let [[u0, u1], [v0, v1]] = [u, v].map(words);
    let [_, carry] = words(product(u0, v0));
    let [low, high] = words(product(u1, v0).wrapping_add(word(carry)));
    let [_, carry] = words(product(u0, v1).wrapping_add(word(low)));
    product(u1, v1)
        .wrapping_add(word(high))
        .wrapping_add(word(carry))
}

/// The lower and the upper word.
#[inline]
fn words(value: u64) -> [u32; 2] {
    let value = value.cast_signed();
    [lower(value), upper(value)].map(i32::cast_unsigned)
}

/// `u·2^63/v` cut off, for `u < 2·v`; 0 where `v` is 0.
pub(crate) fn wide_quotient(u: u64, v: u64) -> u64 {
    let quotient = u128::from(u).wrapping_shl(63).checked_div(v.into());
    quotient.unwrap_or(0) as u64
}

/// The same from halves: what ARMv6-M runs, here for every machine to test.
#[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
mod halves {
    const LOW: u32 = 0xffff;

    #[inline]
    pub(super) fn unsigned(u: u32, v: u32) -> u64 {
        let [u_low, u_high] = [u & LOW, u.wrapping_shr(16)];
        let [v_low, v_high] = [v & LOW, v.wrapping_shr(16)];
        // Products of halves are at most (2^16 − 1)^2; with another 2^16 − 1
        // they stay below 2^32: no sum carries.
        let low = u_low.wrapping_mul(v_low);
        let first = u_high
            .wrapping_mul(v_low)
            .wrapping_add(low.wrapping_shr(16));
        let second = u_low.wrapping_mul(v_high).wrapping_add(first & LOW);
        let high = u_high
            .wrapping_mul(v_high)
            .wrapping_add(first.wrapping_shr(16))
            .wrapping_add(second.wrapping_shr(16));
        joined(second, low, high)
    }

    #[inline]
    pub(super) fn signed(a: i32, b: i32) -> i64 {
        let (a_low, a_high) = (a.cast_unsigned() & LOW, a.wrapping_shr(16));
        let (b_low, b_high) = (b.cast_unsigned() & LOW, b.wrapping_shr(16));
        // Upper halves are −2^15 to 2^15 − 1, lower ones 0 to 2^16 − 1; their
        // products with another 2^16 − 1 stay within 31 bits and sign.
        let low = a_low.wrapping_mul(b_low);
        let first = a_high
            .wrapping_mul(b_low.cast_signed())
            .wrapping_add(low.wrapping_shr(16).cast_signed());
        let second = b_high
            .wrapping_mul(a_low.cast_signed())
            .wrapping_add((first.cast_unsigned() & LOW).cast_signed());
        let high = a_high
            .wrapping_mul(b_high)
            .wrapping_add(first.wrapping_shr(16))
            .wrapping_add(second.wrapping_shr(16));
        joined(second.cast_unsigned(), low, high.cast_unsigned()).cast_signed()
    }

    /// `high·2^32 + (middle mod 2^16)·2^16 + (low mod 2^16)`.
    #[inline]
    fn joined(middle: u32, low: u32, high: u32) -> u64 {
        let low = middle.wrapping_shl(16) | (low & LOW);
        u64::from(high).wrapping_shl(32) | u64::from(low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn agree(a: i32, b: i32) {
        let [u, v] = [a.cast_unsigned(), b.cast_unsigned()];
        let exact = i128::from(a).wrapping_mul(i128::from(b));
        let words = u128::from(u).wrapping_mul(u128::from(v));
        assert_eq!(i128::from(signed_product(a, b)), exact, "{a}·{b}");
        assert_eq!(i128::from(halves::signed(a, b)), exact, "{a}·{b}");
        assert_eq!(u128::from(product(u, v)), words, "{u}·{v}");
        assert_eq!(u128::from(halves::unsigned(u, v)), words, "{u}·{v}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100_000))]

        #[test]
        fn every_way_gives_the_exact_product(a in any::<i32>(), b in any::<i32>()) {
            agree(a, b);
        }
    }

    proptest! {
        #[test]
        fn the_high_product_is_the_upper_half(u in any::<u64>(), v in any::<u64>()) {
            let exact = u128::from(u).wrapping_mul(u128::from(v)) >> 64;
            prop_assert_eq!(u128::from(high_product(u, v)), exact);
        }
    }

    #[test]
    fn the_corners_too() {
        let corners = [
            0,
            1,
            -1,
            i32::MAX,
            i32::MIN,
            0xffff,
            -0xffff,
            0x1_0000,
            -0x1_0000,
        ];
        for a in corners {
            for b in corners {
                agree(a, b);
            }
        }
    }

    #[test]
    fn they_are_what_from_and_try_from_give() {
        for value in [0, 1, 0x7f, 0x80, 0xff] {
            assert_eq!(byte(value), u32::from(value));
        }
        for value in [0, 1, 0xff00, 0x1234_5678, u32::MAX] {
            assert_eq!(word(value), u64::from(value));
            assert_eq!(unsigned(value), i64::from(value));
            assert_eq!(narrowed(u64::from(value)), Some(value));
            let beyond = u64::from(value) + (1 << 32);
            assert_eq!(narrowed(beyond), u32::try_from(beyond).ok());
        }
        assert_eq!([held(7), held(1 << 63)], [7, i64::MAX]);
        for value in [0, 1, -1, i32::MIN, i32::MAX] {
            assert_eq!(signed(value), i64::from(value));
        }
    }
}
