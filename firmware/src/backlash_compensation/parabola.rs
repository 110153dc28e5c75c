//! The parabolas of the move across: how many samples they take, and their
//! numbers, whole ones and a part of `N²`.

use super::{HALF_SAMPLES_MAX, Room};
use crate::widen;

/// A number `whole + part/N²` with `part < N²`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Mixed {
    pub(super) whole: u32,
    pub(super) part: u32,
}

impl Mixed {
    /// `numerator/denominator`; `None` for a denominator of 0.
    pub(super) const fn ratio(numerator: u32, denominator: u32) -> Option<Self> {
        match (
            numerator.checked_div(denominator),
            numerator.checked_rem(denominator),
        ) {
            (Some(whole), Some(part)) => Some(Self { whole, part }),
            _ => None,
        }
    }

    /// The sum, in parts of `n2`. Whole numbers stay below 2^26, and only a sum
    /// of parts below `n2` is ever formed: nothing wraps.
    #[inline]
    pub(super) const fn plus(self, other: Self, n2: u32) -> Self {
        let whole = self.whole.wrapping_add(other.whole);
        let missing = n2.wrapping_sub(other.part);
        let (carry, part) = if self.part >= missing {
            (1, self.part.wrapping_sub(missing))
        } else {
            (0, self.part.wrapping_add(other.part))
        };
        let whole = whole.wrapping_add(carry);
        Self { whole, part }
    }

    /// The difference, in parts of `n2`, for `other ≤ self`: nothing wraps.
    #[inline]
    pub(super) const fn minus(self, other: Self, n2: u32) -> Self {
        let whole = self.whole.wrapping_sub(other.whole);
        let (borrow, part) = if self.part >= other.part {
            (0, self.part.wrapping_sub(other.part))
        } else {
            let missing = n2.wrapping_sub(other.part);
            (1, self.part.wrapping_add(missing))
        };
        let whole = whole.wrapping_sub(borrow);
        Self { whole, part }
    }
}

/// The smallest `N` with `D/N ≤ v_left` and `D/N² ≤ a_left`, up to 65 535.
pub(super) const fn half_samples(distance: u32, room: Room) -> Option<u32> {
    // The largest N that is not enough, bit by bit from the top.
    let (mut too_small, mut bit) = (0_u32, 1_u32 << 15);
    while bit > 0 {
        let n = too_small | bit;
        if !enough(n, distance, room) {
            too_small = n;
        }
        bit = bit.wrapping_shr(1);
    }
    let n = too_small.wrapping_add(1);
    if n <= HALF_SAMPLES_MAX { Some(n) } else { None }
}

/// Whether `N = n` samples, at most 65 535, keep both limits.
const fn enough(n: u32, distance: u32, room: Room) -> bool {
    // D·2^32 ≤ 2^57. A product that saturates is large enough in any case.
    let scaled = widen::word(distance).wrapping_shl(32);
    let n = widen::word(n);
    // N² ≤ 65 535²
    scaled <= room.velocity.saturating_mul(n)
        && scaled <= room.acceleration.saturating_mul(n.wrapping_mul(n))
}
