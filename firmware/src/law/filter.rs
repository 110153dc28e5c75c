//! First-order filter of the derivative, without a dead zone.
//!
//! ```text
//! v(k) = v(k−1) + a·(x(k) − v(k−1)),   a = Δt/(T_f + Δt)      x = Δe or −Δc [counts]
//! ```
//!
//! the backward-difference form of `1/(T_f·s + 1)`. A recursion in fixed point
//! must round somewhere, and one that drops what it rounds off stops moving
//! while `a·(x − v)` is below half a unit: a constant input is then never
//! reached. So the remainder is kept: the state `W` has 32 fraction bits more
//! than the value `v̂` that is fed back,
//!
//! ```text
//! v̂ = round(W·2^−32),   W ← W + 2·A·(x·2^h − v̂),   A = a·2^31      v = W·2^−(32+h)
//! ```
//!
//! With `r = v̂ − W·2^−32`, `|r| ≤ ½`, the error against the exact recursion
//! obeys `d ← (1 − a)·d − a·r`, hence `|d| ≤ ½` for ever: the value that goes
//! into the law is within one unit of `2^−h` counts of the exact filter
//! (½ from `d`, ½ from rounding `W`), however long it runs and however small
//! `a` is. Rounding goes to the nearest, halves away from zero, so that the
//! filter is exactly odd.
//!
//! With `|x| ≤ X` and `X·2^h ≤ 2^29`, `|x·2^h − v̂| ≤ 2^30 + 1` and
//! `|W| ≤ 2^61`: nothing overflows.

use crate::dac::HALF;
use crate::settings::Words;
use crate::wide;

/// The filter as words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FilterWords {
    /// `a·2^31`, 1 to 2^31 − 1.
    pub smoothing: i32,
    /// `h`: fraction bits of the filtered difference, 0 to 29.
    pub fraction_bits: u8,
}

impl FilterWords {
    /// Largest difference that a filter takes \[counts\].
    pub const LARGEST_DIFFERENCE: u32 = 1 << 29;

    /// Most fraction bits that leave room for differences up to `limit`, at
    /// most [`Self::LARGEST_DIFFERENCE`].
    pub const fn most_fraction_bits(limit: u32) -> u8 {
        // limit·2^h ≤ 2^29, with 2^ceil(log2(limit)) for the limit
        let bits = u32::BITS.saturating_sub(limit.saturating_sub(1).leading_zeros());
        let [h, ..] = 29_u32.saturating_sub(bits).to_le_bytes();
        h
    }
}

/// `W·2^−32` to the nearest integer, halves away from zero.
#[inline(always)]
fn rounded(state: i64) -> i32 {
    let (upper, lower) = (wide::upper(state), wide::lower(state).cast_unsigned());
    // Adding ½ and cutting off rounds halves up; one unit less below zero
    // makes that halves away from zero.
    let half = HALF.wrapping_add(upper.wrapping_shr(31).cast_unsigned());
    let (_, carries) = lower.overflowing_add(half);
    upper.wrapping_add(i32::from(carries))
}

/// One sample: the filtered difference \[2^−h counts\] for the difference `x`
/// \[counts\].
#[inline(always)]
pub(crate) fn step(settings: &Words, state: &mut Filtered, x: i32) -> i32 {
    let smoothing = settings.filter_smoothing().cast_signed();
    let gap = settings.filtered(x).wrapping_sub(state.value);
    let change = wide::signed_product(smoothing, gap);
    state.sum = state.sum.wrapping_add(change).wrapping_add(change);
    state.value = rounded(state.sum);
    state.value
}

impl Words {
    /// `x·2^h` \[2^−h counts\].
    #[inline(always)]
    fn filtered(&self, x: i32) -> i32 {
        x.wrapping_mul(self.filter_scale().cast_signed())
    }
}

/// Memory of the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub(crate) struct Filtered {
    /// `W`.
    sum: i64,
    /// `v̂`.
    value: i32,
}

impl Filtered {
    pub(crate) const ZERO: Self = Self { sum: 0, value: 0 };

    /// That has settled at the difference `x` \[counts\].
    pub(crate) fn settled(settings: &Words, x: i32) -> Self {
        let value = settings.filtered(x);
        let sum = i64::from(value).wrapping_shl(32);
        Self { sum, value }
    }

    /// Keeps it within what has settled at the largest difference.
    pub(crate) fn hold(&mut self, settings: &Words) {
        let most = settings.difference_limit_counts();
        let most = most.wrapping_mul(settings.filter_scale());
        self.sum = wide::within(self.sum, most);
        self.value = rounded(self.sum);
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
    use crate::settings::Settings;
    use proptest::prelude::*;

    fn words(smoothing: i32, fraction_bits: u8) -> Words {
        Words::of(&Settings {
            filter_smoothing: smoothing.cast_unsigned(),
            filter_scale: 1 << fraction_bits,
            ..Settings::OFF
        })
    }

    #[test]
    fn rounding_is_to_nearest_and_odd() {
        for (halves, nearest) in [(0, 0), (1, 1), (2, 1), (3, 2), (5, 3)] {
            assert_eq!(rounded(halves << 31), nearest);
            assert_eq!(rounded(-(halves << 31)), -nearest);
            assert_eq!(
                rounded((halves << 31) - 1),
                nearest - i32::from(halves % 2 == 1)
            );
        }
    }

    #[test]
    fn the_most_fraction_bits_leave_no_room_for_one_more() {
        for limit in [1, 2, 3, 1_000, 1 << 18, (1 << 29) - 1, 1 << 29] {
            let h = FilterWords::most_fraction_bits(limit);
            assert!(u64::from(limit) << h <= 1 << 29);
            assert!(h == 29 || u64::from(limit) << (h + 1) > 1 << 29);
        }
    }

    proptest! {
        /// The exact filter has 60 bits more than a unit; what it cuts off below
        /// them adds up to at most 2^−60/a ≤ 2^−29 units.
        #[test]
        fn never_further_than_a_unit_from_the_exact_filter(
            smoothing in prop_oneof![1..=i32::MAX, 1..=1000_i32, Just(1 << 30), Just(i32::MAX)],
            fraction_bits in 0..=29_u8,
            inputs in prop::collection::vec(
                prop_oneof![Just(1_i64 << 31), Just(-1_i64 << 31), Just(0), -(1_i64 << 31)..=1 << 31],
                1..40,
            ),
            repeat in 1..50_usize,
        ) {
            let words = words(smoothing, fraction_bits);
            let (mut wide, mut mirrored, mut exact) = (Filtered::ZERO, Filtered::ZERO, 0_i128);
            for &input in inputs.iter().cycle().take(inputs.len() * repeat) {
                // To the largest difference, both ends included.
                let x = wide::lower(input >> (fraction_bits + 2));
                let v = step(&words, &mut wide, x);
                prop_assert_eq!(step(&words, &mut mirrored, -x), -v);
                let gap = (i128::from(x) << (fraction_bits + 60)) - exact;
                exact += (i128::from(smoothing) * gap) >> 31;
                let apart = (i128::from(v) << 60) - exact;
                prop_assert!(apart.abs() <= (1 << 60) + (1 << 31), "{apart}");
            }
        }
    }

    #[test]
    fn a_constant_is_reached_where_a_truncating_filter_stalls() {
        // a = 10^−5, input 1 count with 4 fraction bits: a·(x − v) is far
        // below half a unit from the start.
        let smoothing = 21_475;
        let words = words(smoothing, 4);
        let mut wide = Filtered::ZERO;
        let mut last = 0;
        for _ in 0..1_500_000 {
            last = step(&words, &mut wide, 1);
        }
        assert_eq!(last, 16);
        // Contrast: the same recursion that rounds its state.
        let mut stalled = 0_i64;
        for _ in 0..1_500_000 {
            stalled += (i64::from(smoothing) * (16 - stalled) + (1 << 30)) >> 31;
        }
        assert_eq!(stalled, 0);
    }

    #[test]
    fn settled_is_where_a_constant_input_ends() {
        let words = words(1 << 29, 10);
        let mut wide = Filtered::settled(&words, -37);
        assert_eq!(step(&words, &mut wide, -37), -37 << 10);
        assert_eq!(wide, Filtered::settled(&words, -37));
    }
}
