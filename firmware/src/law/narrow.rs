//! A term from two products of 32 bits, for a processor that has no longer
//! ones (see [`crate::product`]).
//!
//! A gain of 24 bits times an integer of 17 needs 41 bits, so two parts of the
//! gain do, where the general product takes four of 16-bit halves:
//!
//! ```text
//! w·x·2^s = (H·x)·2^(s+t) + (L·x)·2^s,   w = H·2^t + L,   |H·x|, |L·x| < 2^31,   s + t ≤ 31
//! ```

use crate::widen;

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
    pub(super) const fn of(mantissa: i32, shift: u8, limit: u32) -> Option<Self> {
        // The largest t that leaves L·x its 31 bits, and the shift its 31.
        let by_limit = limit.saturating_sub(1).leading_zeros().saturating_sub(1);
        let [by_limit, ..] = by_limit.to_le_bytes();
        let Some(by_shift) = 31_u8.checked_sub(shift) else {
            return None;
        };
        let t = if by_limit < by_shift {
            by_limit
        } else {
            by_shift
        };
        let high = mantissa.wrapping_shr(widen::byte(t));
        let low = mantissa.wrapping_sub(high.wrapping_shl(widen::byte(t)));
        let most = widen::word(high.unsigned_abs()).saturating_mul(widen::word(limit));
        if most > widen::word(i32::MAX.unsigned_abs()) {
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
    #[inline]
    pub(super) fn times(self, x: i32) -> i64 {
        let high = self.high_shift.of(self.high.wrapping_mul(x));
        high.wrapping_add(self.low_shift.of(self.low.wrapping_mul(x)))
    }
}

impl Shift {
    const fn by(places: u8) -> Self {
        Self {
            factor: 1_u32.wrapping_shl(widen::byte(places)),
            rest: widen::byte(31_u8.saturating_sub(places)),
        }
    }

    /// `value` shifted, from shifts of words.
    #[inline]
    fn of(self, value: i32) -> i64 {
        let low = value.cast_unsigned().wrapping_mul(self.factor);
        // Down by 32 less the places, in two steps: a word is never shifted by 32.
        let high = value.wrapping_shr(1).wrapping_shr(self.rest);
        i64::from(high).wrapping_shl(32) | i64::from(low)
    }
}
