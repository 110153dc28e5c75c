//! A gain as a word: a mantissa and its own binary exponent.
//!
//! ```text
//! gain = mantissa · 2^(−fraction_bits)
//! ```
//!
//! Each gain has an exponent of its own, so that each uses its mantissa to the
//! full. A common format would not do: at `Δt` = 0.1 ms the paper's `Kd/Δt` is
//! 500, which leaves a word of 24 bits and sign 14 fraction bits, and in these
//! its `Ki·Δt` = 0.0005 is 8.19, rounded to 8: 2 % off. The mantissa is an
//! `i32` because its product with a 32-bit count is then exact in 64 bits.

use core::fmt;

/// A gain as a word, in DAC codes per encoder count.
///
/// Plain data: any mantissa and exponent can be written here, and
/// [`crate::law::Law::accept`] decides whether they can serve as a gain.
///
/// ```
/// use firmware::GainWord;
///
/// let half = GainWord::new(1, 1);
/// assert_eq!(half.to_string(), "1·2^-1");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GainWord {
    /// Mantissa, in units of 2^−`fraction_bits` codes per count.
    pub mantissa: i32,
    /// Number of fraction bits of the mantissa.
    pub fraction_bits: u8,
}

impl GainWord {
    /// The word `mantissa·2^(−fraction_bits)` codes per count.
    pub const fn new(mantissa: i32, fraction_bits: u8) -> Self {
        Self {
            mantissa,
            fraction_bits,
        }
    }
}

/// A part of the law that has a gain of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Part {
    /// `Kp·e`.
    Proportional,
    /// `(Ki·Δt)·Σe`.
    Integral,
    /// `(Kd/Δt)·Δe`.
    Derivative,
    /// Velocity feed-forward.
    Velocity,
    /// Acceleration feed-forward.
    Acceleration,
    /// Friction feed-forward.
    Friction,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Proportional => "Kp",
            Self::Integral => "Ki·Δt",
            Self::Derivative => "Kd/Δt",
            Self::Velocity => "the velocity feed-forward",
            Self::Acceleration => "the acceleration feed-forward",
            Self::Friction => "the friction feed-forward",
        })
    }
}

/// `2^bits`, or the largest number where 64 bits do not hold it. By a shift: a
/// power in general multiplies in a loop, and the compiler writes that out at
/// every use.
pub(crate) const fn power_of_two_or_most(bits: u32) -> u64 {
    match 1_u64.checked_shl(bits) {
        Some(power) => power,
        None => u64::MAX,
    }
}

impl fmt::Display for GainWord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}·2^-{}", self.mantissa, self.fraction_bits)
    }
}
