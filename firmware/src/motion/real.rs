//! Numbers of planning: a signed mantissa of 63 bits and a binary exponent,
//! in integers.
//!
//! Planning happens once and spans many magnitudes: an interval of a
//! picosecond beside one of a month. With an exponent of its own each number
//! keeps 62 bits: an operation costs at most 2^−62 of its result. None is
//! inlined: a plan has hundreds of them, on a chip of 64 KiB.

/// `mantissa·2^exponent`; the mantissa is 0, or of magnitude 2^62 to 2^63 − 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Real {
    mantissa: i64,
    exponent: i32,
}

impl Real {
    pub(super) const ZERO: Self = Self {
        mantissa: 0,
        exponent: 0,
    };
    pub(super) const ONE: Self = Self {
        mantissa: 1 << 62,
        exponent: -62,
    };
    /// π/2 to 2^−63.
    pub(super) const HALF_PI: Self = Self {
        mantissa: 7_244_019_458_077_122_842,
        exponent: -62,
    };
    /// 2/π to 2^−64.
    pub(super) const TWO_OVER_PI: Self = Self {
        mantissa: 5_871_781_006_564_002_453,
        exponent: -63,
    };

    /// `value·2^exponent`, cut off to 63 bits.
    #[inline(never)]
    pub(super) fn new(value: i128, exponent: i32) -> Self {
        let magnitude = value.unsigned_abs();
        if magnitude == 0 {
            return Self::ZERO;
        }
        let bits = u128::BITS.wrapping_sub(magnitude.leading_zeros());
        let (normal, exponent) = if bits > 63 {
            let surplus = bits.wrapping_sub(63);
            (
                magnitude.wrapping_shr(surplus),
                exponent.saturating_add_unsigned(surplus),
            )
        } else {
            let missing = 63_u32.wrapping_sub(bits);
            (
                magnitude.wrapping_shl(missing),
                exponent.saturating_sub_unsigned(missing),
            )
        };
        // 63 bits by construction.
        let mantissa = i64::try_from(normal).unwrap_or(i64::MAX);
        Self {
            mantissa: if value < 0 {
                mantissa.wrapping_neg()
            } else {
                mantissa
            },
            exponent,
        }
    }

    /// An integer; exact below 2^63.
    pub(super) fn from_integer(value: u64) -> Self {
        Self::new(i128::from(value), 0)
    }

    pub(super) fn is_zero(self) -> bool {
        self.mantissa == 0
    }

    pub(super) fn negated(self) -> Self {
        Self {
            mantissa: self.mantissa.wrapping_neg(),
            ..self
        }
    }

    pub(super) fn magnitude(self) -> Self {
        Self {
            mantissa: self.mantissa.saturating_abs(),
            ..self
        }
    }

    pub(super) fn at_most(self, other: Self) -> bool {
        other.minus(self).mantissa >= 0
    }

    /// `self·2^power`, exactly.
    pub(super) fn scaled(self, power: i32) -> Self {
        Self {
            exponent: self.exponent.saturating_add(power),
            ..self
        }
    }

    #[inline(never)]
    pub(super) fn plus(self, other: Self) -> Self {
        if self.is_zero() {
            return other;
        }
        if other.is_zero() {
            return self;
        }
        let (large, small) = if self.exponent >= other.exponent {
            (self, other)
        } else {
            (other, self)
        };
        // Both with 62 bits below the mantissa, below 2^125 each.
        let gap = large.exponent.abs_diff(small.exponent).min(127);
        let aligned = i128::from(small.mantissa)
            .wrapping_shl(62)
            .wrapping_shr(gap);
        let sum = i128::from(large.mantissa)
            .wrapping_shl(62)
            .wrapping_add(aligned);
        Self::new(sum, large.exponent.saturating_sub(62))
    }

    pub(super) fn minus(self, other: Self) -> Self {
        self.plus(other.negated())
    }

    #[inline(never)]
    pub(super) fn times(self, other: Self) -> Self {
        // Below 2^126.
        let product = i128::from(self.mantissa).wrapping_mul(i128::from(other.mantissa));
        Self::new(product, self.exponent.saturating_add(other.exponent))
    }

    /// `self/divisor`; 0 where the divisor is 0, which no caller asks for.
    #[inline(never)]
    pub(super) fn over(self, divisor: Self) -> Self {
        // 2^125 to 2^126 over 2^62 to 2^63: at least 62 bits.
        let quotient = i128::from(self.mantissa)
            .wrapping_shl(63)
            .checked_div(i128::from(divisor.mantissa));
        let exponent = self
            .exponent
            .saturating_sub(divisor.exponent)
            .saturating_sub(63);
        quotient.map_or(Self::ZERO, |quotient| Self::new(quotient, exponent))
    }

    /// The `b` of `2^(b−1) ≤ |self| < 2^b`; far below anything for 0.
    pub(super) fn bits(self) -> i32 {
        if self.is_zero() {
            return i32::MIN;
        }
        self.exponent.saturating_add(63)
    }

    /// The nearest multiple of `2^−fraction_bits`, in its units; halves go
    /// up. Held at the ends of the type.
    #[inline(never)]
    pub(super) fn to_fixed(self, fraction_bits: i32) -> i128 {
        let shift = self.exponent.saturating_add(fraction_bits);
        let amount = shift.unsigned_abs();
        let mantissa = i128::from(self.mantissa);
        if shift < 0 {
            // Half a unit is added one bit further down.
            let twice = mantissa.wrapping_shr(amount.wrapping_sub(1).min(127));
            twice.wrapping_add(1).wrapping_shr(1)
        } else if amount < 64 || self.is_zero() {
            mantissa.wrapping_shl(amount.min(63))
        } else if self.mantissa < 0 {
            i128::MIN
        } else {
            i128::MAX
        }
    }

    /// Sine and cosine of `0 ≤ self ≤ π/2`, to 2^−60; a little beyond, where a curve
    /// has its last point, as well.
    #[inline(never)]
    pub(super) fn sine_cosine(self) -> (Self, Self) {
        let square = self.times(self);
        (series(self, square, 2), series(Self::ONE, square, 1))
    }
}

/// `first·(1 − θ²/(n(n+1))·(1 − θ²/((n+2)(n+3))·…))`. The first term left out
/// is below (π/2)^28/28! < 2^−79.
#[inline(never)]
fn series(first: Real, square: Real, n: u64) -> Real {
    let mut term = first;
    let mut sum = first;
    for pair in 0..13_u64 {
        let n = pair.wrapping_mul(2).wrapping_add(n);
        let divisor = Real::from_integer(n.wrapping_mul(n.wrapping_add(1)));
        term = term.times(square).over(divisor).negated();
        sum = sum.plus(term);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constants_belong_together() {
        let one = Real::HALF_PI.times(Real::TWO_OVER_PI);
        assert!(Real::ONE.minus(one).bits() <= -60);
        // π·2^61 and 2^64/π, from the digits of π.
        assert_eq!(Real::HALF_PI.to_fixed(30), 1_686_629_713);
        assert_eq!(Real::TWO_OVER_PI.to_fixed(30), 683_565_276);
    }

    #[test]
    fn sine_and_cosine_lie_on_the_circle_and_meet_at_the_ends() {
        for k in 0..=64 {
            let angle = Real::HALF_PI.times(Real::new(k, -6));
            let (sine, cosine) = angle.sine_cosine();
            let square = sine.times(sine).plus(cosine.times(cosine));
            assert!(square.minus(Real::ONE).bits() <= -58, "node {k}");
            let (mirrored, _) = Real::HALF_PI.minus(angle).sine_cosine();
            assert!(mirrored.minus(cosine).bits() <= -59, "node {k}");
        }
        // sin(π/6) = 1/2 tells the circle's points apart.
        let third = Real::HALF_PI.over(Real::from_integer(3));
        let half = Real::ONE.scaled(-1);
        assert!(third.sine_cosine().0.minus(half).bits() <= -60);
    }

    #[test]
    fn fixed_point_is_the_nearest() {
        let value = Real::new(-5, -1);
        assert_eq!(value.to_fixed(0), -2);
        assert_eq!(value.to_fixed(1), -5);
        assert_eq!(value.to_fixed(40), -5 << 39);
        assert_eq!(value.to_fixed(-200), 0);
        assert_eq!(value.to_fixed(200), i128::MIN);
        assert_eq!(Real::ZERO.to_fixed(2_000), 0);
    }

    #[test]
    fn sums_of_any_magnitudes_keep_the_larger() {
        let one = Real::ONE;
        assert_eq!(one.plus(Real::new(1, -300)), one);
        assert_eq!(one.minus(one), Real::ZERO);
        assert_eq!(one.plus(Real::new(-1, -1)), Real::new(1, -1));
        assert_eq!(one.over(Real::ZERO), Real::ZERO);
    }
}
