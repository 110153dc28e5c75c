//! Setpoints and encoder counts: integers modulo 2^32.
//!
//! A counter on a chip has 32 bits and wraps round. So does everything here:
//! a position is an `i32` that stands for all integers that differ from it by
//! a multiple of 2^32, and only differences of positions have a meaning. The
//! difference is right as long as its true magnitude is below 2^31; where the
//! axis stands on the wheel of 2^32 counts changes nothing, so that adding one
//! constant to setpoints and counts alike does not change a single code.
//!
//! The error of eq. 22 is in encoder steps from the start:
//!
//! ```text
//! e = r − c   (modulo 2^32, taken between −2^31 and 2^31 − 1)
//! ```

use crate::refusal::{Refusal, What, accepted};
use crate::wide;

use fixed::types::I32F32;

/// A position modulo 2^32 with its fraction, in encoder counts.
pub type Counts = I32F32;

/// The position modulo 2^32 that a counter of 32 bits shows for `position`
/// \[counts\].
///
/// ```
/// use firmware::counts::wrap;
///
/// assert_eq!(wrap(-5), -5);
/// assert_eq!(wrap(1 << 31), i32::MIN);
/// assert_eq!(wrap((1 << 40) + 7), 7);
/// ```
pub const fn wrap(position: i64) -> i32 {
    wide::lower(position)
}

/// `e = r − c`, eq. 20 and 22 in counts: how far the encoder is behind the
/// setpoint \[counts\].
///
/// ```
/// use firmware::counts::difference;
///
/// assert_eq!(difference(10, 4), 6);
/// // The setpoint has passed the end of the wheel, the axis has not yet.
/// assert_eq!(difference(i32::MIN + 2, i32::MAX - 1), 4);
/// ```
pub const fn difference(setpoint: i32, count: i32) -> i32 {
    // e = r − c                                             eq. 20, 22 [counts]
    setpoint.wrapping_sub(count)
}

/// The errors for which the promises of this crate hold: `|e| ≤ E`, `E` a
/// power of two \[counts\].
///
/// `E` sets how many fraction bits the gains need, so it is chosen with them,
/// from the errors that the axis may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorRange {
    bits: u8,
    limit: i32,
}

impl ErrorRange {
    /// Smallest exponent: errors of 2^17 counts are always within range.
    pub const MIN_BITS: u8 = 17;
    /// Largest exponent: the difference of two errors is then at most 2^30
    /// and fits an `i32` with either sign.
    pub const MAX_BITS: u8 = 29;

    /// The range `|e| ≤ 2^bits` counts.
    ///
    /// # Errors
    /// [`Refusal`] unless `bits` is 17 to 29.
    ///
    /// ```
    /// use firmware::ErrorRange;
    ///
    /// assert_eq!(ErrorRange::from_bits(17).map(|range| range.limit()), Ok(131_072));
    /// assert!(ErrorRange::from_bits(30).is_err());
    /// ```
    pub const fn from_bits(bits: u8) -> Result<Self, Refusal> {
        accepted!(What::ErrorBits.byte_within(bits, [Self::MIN_BITS, Self::MAX_BITS]));
        Ok(Self {
            bits,
            limit: 1_i32.wrapping_shl(wide::byte(bits)),
        })
    }

    /// The exponent of `E`, 17 to 29.
    pub const fn bits(self) -> u8 {
        self.bits
    }

    /// `E` \[counts\], 2^17 to 2^29.
    pub const fn limit(self) -> i32 {
        self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_range_is_its_power_of_two() {
        for bits in 0..=u8::MAX {
            let allowed = (17..=29).contains(&bits);
            let range = ErrorRange::from_bits(bits);
            assert_eq!(
                range.map(ErrorRange::limit).ok(),
                allowed.then(|| 1 << bits)
            );
        }
    }

    #[test]
    fn wrapped_positions_keep_their_differences() {
        for base in [0_i64, (1 << 31) - 2, -(1 << 31), 5_000_000_000, i64::MIN] {
            assert_eq!(difference(wrap(base + 3), wrap(base)), 3);
            assert_eq!(difference(wrap(base), wrap(base + 3)), -3);
        }
    }
}
