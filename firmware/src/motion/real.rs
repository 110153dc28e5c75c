//! Numbers of planning: a mantissa of 63 bits, a binary exponent and a sign, in
//! integers.
//!
//! Planning happens once and spans many magnitudes: an interval of a
//! picosecond beside one of a month. With an exponent of its own each number
//! keeps 62 bits: an operation costs at most 2^−62 of its result. On a chip time is of no
//! account, so that shifts and quotients are made bit by bit where that is shorter.

use crate::wide::{high_product, wide_quotient};

/// `±mantissa·2^(exponent − BIAS − 64)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Real {
    /// 0, or an even number of 2^63 and more.
    mantissa: u64,
    exponent: i32,
    /// 1 below zero.
    sign: u32,
}

/// 0 is all zeros, and its exponent below that of every other number.
const BIAS: i32 = 1 << 28;

impl Real {
    pub(super) const ZERO: Self = Self {
        mantissa: 0,
        exponent: 0,
        sign: 0,
    };

    /// A whole number, to be normalised.
    pub(super) const fn integer(value: u64) -> Self {
        Self {
            mantissa: value,
            exponent: BIAS + 64,
            sign: 0,
        }
    }

    /// Brings the mantissa to 63 bits, less what is below them.
    #[inline(never)]
    pub(super) fn normalise(&mut self) {
        if self.mantissa == 0 {
            *self = Self::ZERO;
            return;
        }
        if cfg!(target_pointer_width = "64") {
            let zeros = self.mantissa.leading_zeros();
            self.mantissa = self.mantissa.wrapping_shl(zeros);
            self.exponent = self.exponent.wrapping_sub_unsigned(zeros);
        }
        while self.mantissa.cast_signed() >= 0 {
            self.mantissa = self.mantissa.wrapping_shl(1);
            self.exponent = self.exponent.wrapping_sub(1);
        }
        self.mantissa &= !1;
    }

    /// Multiplies by `2^power`, exactly.
    #[inline(always)]
    pub(super) fn scale(&mut self, power: i32) -> &mut Self {
        self.exponent = self.exponent.wrapping_add(power);
        self
    }

    /// Gives it a sign.
    #[inline(always)]
    pub(super) fn sign(&mut self, negative: bool) {
        self.sign = negative.into();
    }

    pub(super) const fn is_zero(&self) -> bool {
        self.mantissa == 0
    }

    pub(super) const fn is_negative(&self) -> bool {
        self.sign != 0
    }

    /// Adds or, with 1, subtracts; to be normalised.
    #[inline(always)]
    pub(super) fn add(&mut self, mut other: Self, minus: u32) {
        other.sign ^= minus;
        if self.exponent < other.exponent {
            core::mem::swap(self, &mut other);
        }
        let gap = self.exponent.wrapping_sub(other.exponent).min(127);
        // 62 bits below the mantissa are kept, towards −∞.
        let shift = if cfg!(target_pointer_width = "64") {
            shifted_at_once
        } else {
            shifted_by_bits
        };
        let (shifted, below) = shift(other.mantissa, gap, other.is_negative());
        other.mantissa = shifted;
        if self.sign == other.sign {
            self.mantissa = self.mantissa.wrapping_shr(1);
            self.mantissa = self.mantissa.wrapping_add(other.mantissa.wrapping_shr(1));
            self.exponent = self.exponent.wrapping_add(1);
            return;
        }
        let is_less = self.mantissa < other.mantissa;
        let left = self.mantissa.wrapping_sub(other.mantissa);
        self.mantissa = left.wrapping_sub(below);
        // Only where there is no gap.
        if is_less {
            self.mantissa = self.mantissa.wrapping_neg();
            self.sign = other.sign;
        }
    }

    /// Multiplies; to be normalised.
    #[inline(always)]
    pub(super) fn multiply(&mut self, other: Self) {
        self.mantissa = high_product(self.mantissa, other.mantissa);
        self.exponent = self.exponent.wrapping_add(other.exponent);
        self.exponent = self.exponent.wrapping_sub(BIAS);
        self.sign ^= other.sign;
    }

    /// Divides, by anything but 0; to be normalised.
    #[inline(always)]
    pub(super) fn divide(&mut self, other: Self) {
        let rest = self.mantissa.wrapping_shr(1);
        let divisor = other.mantissa.wrapping_shr(1);
        self.mantissa = if cfg!(target_pointer_width = "64") {
            wide_quotient(rest, divisor)
        } else {
            quotient_by_bits(rest, divisor)
        };
        self.exponent = self.exponent.wrapping_sub(other.exponent);
        self.exponent = self.exponent.wrapping_add(BIAS + 1);
        self.sign ^= other.sign;
    }

    /// The `b` of `2^(b−1) ≤ |self| < 2^b`; far below anything for 0.
    pub(super) const fn bits(&self) -> i32 {
        self.exponent.wrapping_sub(BIAS)
    }

    /// The nearest multiple of `2^−fraction_bits`, in its units, modulo 2^64; halves go
    /// up. From 2^126 on it is −1, or 0 below zero.
    #[inline(never)]
    pub(super) fn fixed(&self, fraction_bits: i32) -> i64 {
        let bits = self.bits().wrapping_add(fraction_bits);
        let mut down = 63_i32.wrapping_sub(bits).min(65);
        if down <= -64 {
            return i64::from(self.sign).wrapping_sub(1);
        }
        let mut fixed = self.signed_mantissa();
        // The last bit that goes is a half.
        let mut half = 0;
        while down > 0 {
            half = fixed & 1;
            fixed = fixed.wrapping_shr(1);
            down = down.wrapping_sub(1);
        }
        while down < 0 {
            fixed = fixed.wrapping_shl(1);
            down = down.wrapping_add(1);
        }
        fixed.wrapping_add(half)
    }

    /// The magnitude of the nearest integer, at most `i64::MAX`; halves go up.
    pub(super) fn rounded(&self) -> i64 {
        let down = 63_i32.wrapping_sub(self.bits()).min(64);
        let mantissa = self.signed_mantissa();
        let nearest = match down {
            ..0 => i64::MAX,
            0 => mantissa,
            // No loop: an image that makes no message needs none of it.
            1.. => {
                let twice = mantissa.wrapping_shr(down.wrapping_sub(1).unsigned_abs());
                twice.wrapping_shr(1).wrapping_add(twice & 1)
            }
        };
        nearest.saturating_abs()
    }

    /// The mantissa's 63 bits with the sign.
    fn signed_mantissa(&self) -> i64 {
        let mantissa = self.mantissa.wrapping_shr(1).cast_signed();
        if self.is_negative() {
            mantissa.wrapping_neg()
        } else {
            mantissa
        }
    }
}

/// `mantissa·2^−gap` cut off, and 1 where that was off: of the bits that are cut off the
/// 61 uppermost count, or `all`.
#[inline(always)]
fn shifted_by_bits(mut mantissa: u64, mut gap: i32, all: bool) -> (u64, u64) {
    let mut below = 0;
    while gap > 0 {
        if gap < 62 || all {
            below |= mantissa & 1;
        }
        mantissa = mantissa.wrapping_shr(1);
        gap = gap.wrapping_sub(1);
    }
    (mantissa, below)
}

/// The same where a shift by many bits is one instruction.
fn shifted_at_once(mantissa: u64, gap: i32, all: bool) -> (u64, u64) {
    let gap = gap.unsigned_abs();
    let from = |bit: u32| u64::MAX.checked_shl(bit).unwrap_or(0);
    let first = if all { 0 } else { gap.saturating_sub(61) };
    let below = mantissa & from(first) & !from(gap);
    (
        mantissa.checked_shr(gap).unwrap_or(0),
        u64::from(below != 0),
    )
}

/// `rest·2^63/divisor` cut off, for `rest < 2·divisor`.
#[inline(always)]
fn quotient_by_bits(mut rest: u64, divisor: u64) -> u64 {
    let mut quotient = 0_u64;
    for _ in 0..64 {
        quotient = quotient.wrapping_shl(1);
        if rest >= divisor {
            rest = rest.wrapping_sub(divisor);
            quotient |= 1;
        }
        rest = rest.wrapping_shl(1);
    }
    quotient
}

#[cfg(test)]
mod tests {
    use super::*;

    fn real(value: i64, power: i32) -> Real {
        let mut real = Real::integer(value.unsigned_abs());
        real.normalise();
        real.scale(power).sign(value < 0);
        real
    }

    fn sum(mut a: Real, b: Real, minus: u32) -> Real {
        a.add(b, minus);
        a.normalise();
        a
    }

    #[test]
    fn fixed_point_is_the_nearest() {
        let value = real(-5, -1);
        assert_eq!(value.fixed(0), -2);
        assert_eq!(value.rounded(), 2);
        assert_eq!(value.fixed(1), -5);
        assert_eq!(value.fixed(40), -5 << 39);
        assert_eq!(value.fixed(-200), 0);
        assert_eq!(value.fixed(200), 0);
        assert_eq!(real(5, -1).fixed(0), 3);
        assert_eq!(real(5, -1).fixed(200), -1);
        assert_eq!(Real::ZERO.fixed(2_000), 0);
        assert_eq!(real(9, 60).rounded(), i64::MAX);
        assert_eq!(real(i64::MAX, 0).rounded(), i64::MAX);
        assert_eq!(real(1, -2).rounded(), 0);
    }

    #[test]
    fn sums_of_any_magnitudes_keep_the_larger() {
        let one = real(1, 0);
        let (mut product, mut quotient) = (one, one);
        assert_eq!(sum(one, real(1, -300), 0), one);
        assert_eq!(sum(one, one, 1), Real::ZERO);
        assert_eq!(sum(one, real(-1, -1), 0), real(1, -1));
        assert_eq!(sum(real(1, -1), one, 1), real(-1, -1));
        // What is far below counts where it takes away from something positive.
        let less = real((1 << 62) - 1 + (1 << 62), -63);
        assert_eq!(sum(one, real(1, -300), 1), less);
        assert_eq!(sum(real(-1, 0), real(1, -300), 0), real(-1, 0));
        product.multiply(real(-6, 0));
        product.normalise();
        quotient.divide(real(-6, 0));
        quotient.normalise();
        product.multiply(quotient);
        product.normalise();
        assert_eq!(product.fixed(60), 1 << 60);
    }

    proptest::proptest! {
        /// What a chip makes bit by bit a host makes at once.
        #[test]
        fn bit_by_bit_is_the_same_as_at_once(
            u in proptest::prelude::any::<u64>(), v in proptest::prelude::any::<u64>(),
            zeros in 0..64_u32, gap in 0..=127_i32, all in proptest::prelude::any::<bool>(),
        ) {
            let sparse = u >> zeros << zeros;
            proptest::prop_assert_eq!(
                shifted_by_bits(sparse, gap, all),
                shifted_at_once(sparse, gap, all)
            );
            // Mantissas of 63 bits, as they are divided.
            let [u, v] = [u, v].map(|mantissa| (mantissa | 1 << 63) >> 1);
            proptest::prop_assert_eq!(quotient_by_bits(u, v), wide_quotient(u, v));
        }
    }
}
