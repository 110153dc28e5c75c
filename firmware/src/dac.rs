//! Codes of the D/A converter: the unit of the control law's sum, and the one
//! rounding of the controller.
//!
//! A converter of `n` bits (eq. 24) takes the codes −2^(n−1) to 2^(n−1)−1. The
//! law gives a sum `y` in the unit of one code, and
//!
//! ```text
//! code = clamp(floor(y + ½), −2^(n−1), 2^(n−1) − 1)
//! ```
//!
//! Two sums that lie at most 1 apart give codes that lie at most 1 apart:
//! `floor(y + ½)` steps once in every unit, and a clamp never moves two values
//! away from each other. That is why the error budget of [`crate::gains`] is
//! one code for everything before this line.
//!
//! # Types
//!
//! * [`Codes`] has 32 integer and 32 fraction bits: a machine word of 64 bits,
//!   for the proportional and the derivative term, which together stay below
//!   2^31 codes.
//! * [`CodeSum`] has 88 integer and 40 fraction bits: for the integral, which
//!   needs 40 fraction bits (see [`crate::gains`]) and at least 29 integer
//!   bits, 69 in all and thus more than 64. One tick adds less than 2^20
//!   codes, so that no number of ticks that fits the 64-bit tick counter
//!   brings it to its end at 2^87.

use crate::refusal::{Refusal, What, accepted};

use fixed::types::{I32F32, I88F40};

/// A term of the control law, in DAC codes.
pub type Codes = I32F32;

/// The integral and the sum of the control law, in DAC codes.
pub type CodeSum = I88F40;

/// Half a code.
const HALF: CodeSum = CodeSum::from_bits(1 << 39);

/// Range of a bipolar D/A converter of `n` bits.
///
/// ```
/// use firmware::{CodeSum, Dac};
///
/// let dac = Dac::with_bits(12)?;
/// // Halves go up, on both sides of zero.
/// assert_eq!(dac.code(CodeSum::from_bits(5 << 39)), 3);
/// assert_eq!(dac.code(CodeSum::from_bits(-5 << 39)), -2);
/// assert_eq!(dac.code(CodeSum::MAX), 2_047);
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dac {
    min_code: i32,
    max_code: i32,
}

impl Dac {
    /// Smallest number of bits.
    pub const MIN_BITS: u32 = 2;
    /// Largest number of bits.
    pub const MAX_BITS: u32 = 24;

    /// The range of a converter of `bits` bits, 2 to 24.
    ///
    /// # Errors
    /// [`Refusal`] where `bits` lies outside 2 to 24.
    pub const fn with_bits(bits: u32) -> Result<Self, Refusal> {
        accepted!(What::DacBits.word_within(bits, [Self::MIN_BITS, Self::MAX_BITS]));
        // An arithmetic shift of −2^31 by 32 − n leaves −2^(n−1); the
        // complement of that is 2^(n−1) − 1.
        let min_code = i32::MIN.wrapping_shr(u32::BITS.wrapping_sub(bits));
        Ok(Self {
            min_code,
            max_code: !min_code,
        })
    }

    /// `−2^(n−1)`.
    pub const fn min_code(self) -> i32 {
        self.min_code
    }

    /// `2^(n−1) − 1`.
    pub const fn max_code(self) -> i32 {
        self.max_code
    }

    /// `n`.
    pub const fn bits(self) -> u32 {
        // Behind the sign there are n − 1.
        u32::BITS
            .wrapping_sub(self.max_code.leading_zeros())
            .wrapping_add(1)
    }

    /// Tells whether `code` is one of the two at the ends of the range.
    pub const fn is_limit(self, code: i32) -> bool {
        code == self.max_code || code == self.min_code
    }

    /// The code for the sum `y` \[codes\].
    pub fn code(self, sum: CodeSum) -> i32 {
        // floor(y + ½): a saturating addition, and a conversion that rounds
        // down and saturates as well.
        let nearest: i32 = sum.saturating_add(HALF).saturating_to_num();
        // clamp(…, −2^(n−1), 2^(n−1) − 1)                              eq. 24
        nearest.min(self.max_code).max(self.min_code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_width_has_its_range() {
        for bits in 0..=64 {
            let dac = Dac::with_bits(bits);
            if !(2..=24).contains(&bits) {
                let refusal = Refusal::new(What::DacBits, bits.into(), [2, 24]);
                assert_eq!(dac, Err(refusal));
                continue;
            }
            let dac = dac.expect("2 to 24 bits are supported");
            assert_eq!(dac.min_code(), -(1 << (bits - 1)));
            assert_eq!(dac.max_code(), (1 << (bits - 1)) - 1);
        }
    }

    #[test]
    fn rounding_is_floor_of_y_plus_a_half() {
        let dac = Dac::with_bits(14).expect("14 bits are supported");
        // Quarters of a code.
        for quarters in -40_000..40_000_i32 {
            let sum = CodeSum::from_bits(i128::from(quarters) << 38);
            let expected = (quarters + 2).div_euclid(4).clamp(-8_192, 8_191);
            assert_eq!(dac.code(sum), expected);
        }
    }

    #[test]
    fn extreme_sums_saturate() {
        let dac = Dac::with_bits(24).expect("24 bits are supported");
        assert_eq!(dac.code(CodeSum::MAX), (1 << 23) - 1);
        assert_eq!(dac.code(CodeSum::MIN), -(1 << 23));
    }
}
