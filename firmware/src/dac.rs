//! Codes of the D/A converter: the unit of the control law's sum.
//!
//! A converter of `n` bits (eq. 24) takes the codes −2^(n−1) to 2^(n−1)−1.

use crate::refusal::{Refusal, What, accepted};

use fixed::types::I32F32;

/// A term of the control law or its sum, in DAC codes: the upper word counts
/// codes, the lower one is their fraction.
pub type Codes = I32F32;

/// Half a code \[2^−32 codes\].
pub(crate) const HALF: u32 = 1 << 31;

/// Range of a bipolar D/A converter of `n` bits.
///
/// ```
/// use firmware::Dac;
///
/// let dac = Dac::with_bits(12)?;
/// assert_eq!((dac.min_code(), dac.max_code()), (-2_048, 2_047));
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

    /// All zeros, of an axis that has no settings yet.
    pub(crate) const ZERO: Self = Self {
        min_code: 0,
        max_code: 0,
    };

    /// The range of a converter of `bits` bits, 2 to 24.
    ///
    /// # Errors
    /// [`Refusal`] where `bits` lies outside 2 to 24.
    pub const fn with_bits(bits: u32) -> Result<Self, Refusal> {
        accepted!(What::DacBits.word_within(bits, [Self::MIN_BITS, Self::MAX_BITS]));
        Ok(Self::of_bits(bits))
    }

    /// That of bits in their range.
    pub(crate) const fn of_bits(bits: u32) -> Self {
        // An arithmetic shift of −2^31 by 32 − n leaves −2^(n−1); the
        // complement of that is 2^(n−1) − 1.
        let min_code = i32::MIN.wrapping_shr(u32::BITS.wrapping_sub(bits));
        Self {
            min_code,
            max_code: !min_code,
        }
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
}
