//! Products of 32-bit words, with all 64 bits, chosen per target and the same
//! on every one.
//!
//! Every product of two 32-bit words fits 64 bits, so nothing here can wrap.
//! ARMv7-M and larger processors have one instruction for it. ARMv6-M (the
//! Cortex-M0) multiplies 32 bits by 32 to the lower 32 only, and the
//! compiler's own routine for 64 bits by 64 takes about 40 instructions; there
//! the product is formed from those of 16-bit halves:
//!
//! ```text
//! u·v = uh·vh·2^32 + (uh·vl + ul·vh)·2^16 + ul·vl          for words without sign
//! a·b = word(a)·word(b) − 2^32·(b·[a < 0] + a·[b < 0])     modulo 2^64
//! ```

/// Whether the processor has a long multiplication. Of Arm's, those without
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
pub(crate) fn unsigned(u: u32, v: u32) -> u64 {
    by_target!(
        u64::from(u).wrapping_mul(u64::from(v)),
        halves::unsigned(u, v)
    )
}

/// `a·b`.
#[inline]
pub(crate) fn signed(a: i32, b: i32) -> i64 {
    by_target!(
        i64::from(a).wrapping_mul(i64::from(b)),
        halves::signed(a, b)
    )
}

/// `a·b` for `a ≥ 0`.
#[inline]
pub(crate) fn of_gain(a: i32, b: i32) -> i64 {
    by_target!(
        i64::from(a).wrapping_mul(i64::from(b)),
        halves::of_gain(a, b)
    )
}

/// The same from halves: what ARMv6-M runs, here for every machine to test.
#[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
mod halves {
    /// The two words of `u·v`, the lower one first.
    #[inline]
    fn words(u: u32, v: u32) -> [u32; 2] {
        const LOW: u32 = 0xffff;
        let [u_low, u_high] = [u & LOW, u.wrapping_shr(16)];
        let [v_low, v_high] = [v & LOW, v.wrapping_shr(16)];
        // Products of halves are at most (2^16 − 1)^2; with another 2^16 − 1
        // they stay below 2^32, so only the second sum can carry.
        let low = u_low.wrapping_mul(v_low);
        let middle = u_high
            .wrapping_mul(v_low)
            .wrapping_add(low.wrapping_shr(16));
        let (middle, carry) = middle.overflowing_add(u_low.wrapping_mul(v_high));
        let high = u_high
            .wrapping_mul(v_high)
            .wrapping_add(middle.wrapping_shr(16))
            .wrapping_add(u32::from(carry).wrapping_shl(16));
        [middle.wrapping_shl(16) | (low & LOW), high]
    }

    fn joined(low: u32, high: u32) -> u64 {
        u64::from(high).wrapping_shl(32) | u64::from(low)
    }

    #[inline]
    pub(super) fn unsigned(u: u32, v: u32) -> u64 {
        let [low, high] = words(u, v);
        joined(low, high)
    }

    #[inline]
    pub(super) fn signed(a: i32, b: i32) -> i64 {
        let [u, v] = [a.cast_unsigned(), b.cast_unsigned()];
        let [low, high] = words(u, v);
        let signs = (v & sign_mask(a)).wrapping_add(u & sign_mask(b));
        joined(low, high.wrapping_sub(signs)).cast_signed()
    }

    #[inline]
    pub(super) fn of_gain(a: i32, b: i32) -> i64 {
        let [u, v] = [a.cast_unsigned(), b.cast_unsigned()];
        let [low, high] = words(u, v);
        joined(low, high.wrapping_sub(u & sign_mask(b))).cast_signed()
    }

    /// All ones below 0.
    fn sign_mask(x: i32) -> u32 {
        x.wrapping_shr(31).cast_unsigned()
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
        assert_eq!(i128::from(signed(a, b)), exact, "{a}·{b}");
        assert_eq!(i128::from(halves::signed(a, b)), exact, "{a}·{b}");
        assert_eq!(u128::from(unsigned(u, v)), words, "{u}·{v}");
        assert_eq!(u128::from(halves::unsigned(u, v)), words, "{u}·{v}");
        if a >= 0 {
            assert_eq!(i128::from(of_gain(a, b)), exact, "{a}·{b}");
            assert_eq!(i128::from(halves::of_gain(a, b)), exact, "{a}·{b}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100_000))]

        #[test]
        fn every_way_gives_the_exact_product(a in any::<i32>(), b in any::<i32>()) {
            agree(a, b);
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
}
