//! From the register of an encoder counter to a position.
//!
//! A counter of `n` bits shows the position modulo `2^n`. Between two samples
//! the axis moves by less than half of that, so the difference of two readings
//! tells how far, across the end of the register as anywhere else:
//!
//! ```text
//! d = register − c   (modulo 2^n, taken between −2^(n−1) and 2^(n−1) − 1)
//! c ← c + d          (modulo 2^32)                                  [counts]
//! ```
//!
//! The first reading defines the position: the register, sign-extended. As
//! 2^n divides 2^32, the position agrees with the register modulo `2^n` from
//! then on, so that it is the only memory needed. A register of 32 bits *is*
//! the position.
//!
//! # Glitches
//!
//! If the largest `|d|` per sample of any motion is known, a larger one is
//! no motion: a disturbed transfer, a counter that was reset, or lost edges in
//! bulk. The position then stays at the last good reading, and the next one is
//! compared with that. Since the axis may have moved on meanwhile, `m` bad
//! readings in a row allow `(m + 1)` times the jump, so that one disturbed
//! transfer costs nothing. Once this reaches `2^(n−1)`, a motion could not be
//! told from its complement: only the very register of the last good reading
//! is accepted from there on, and the way back is to start anew, with the reset
//! of the fault, which needs a new reference.
//!
//! # Ranges
//!
//! `n` is 8 to 32. The largest jump is at least 1, or no axis could move, and
//! below `2^(n−1)`, where differences end and no jump would be seen.

use crate::refusal::{Refusal, What, accepted};
use crate::wide;

/// A counter and what its axis can do at most.
///
/// ```
/// use firmware::CounterParameters;
///
/// // 16 bits, at most 500 counts per sample.
/// let counter = CounterParameters::accept(16, Some(500))?;
/// assert_eq!((counter.bits(), counter.largest_jump()), (16, Some(500)));
/// // Half a turn forwards is half a turn backwards.
/// assert!(CounterParameters::accept(16, Some(32_768)).is_err());
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CounterParameters {
    /// `n`.
    bits: u8,
    /// Largest `|d|` per sample \[counts\].
    largest_jump: Option<u32>,
}

impl CounterParameters {
    /// Fewest bits of a counter.
    pub const MIN_BITS: u8 = 8;
    /// Most bits of a counter.
    pub const MAX_BITS: u8 = 32;
    /// The default: 32 bits, no glitch looked for.
    pub const WORD: Self = Self {
        bits: Self::MAX_BITS,
        largest_jump: None,
    };

    /// A counter of `bits` bits, whose count changes by no more than
    /// `largest_jump` counts from one sample to the next; `None` where glitches
    /// are not looked for.
    ///
    /// # Errors
    /// A [`Refusal`] unless `bits` is 8 to 32 and the jump 1 to
    /// `2^(bits−1) − 1`.
    pub const fn accept(bits: u8, largest_jump: Option<u32>) -> Result<Self, Refusal> {
        accepted!(What::CounterBits.byte_within(bits, [Self::MIN_BITS, Self::MAX_BITS]));
        if let Some(jump) = largest_jump {
            // 2^(n−1) − 1
            let half_wheel = 1_u32.wrapping_shl(wide::byte(bits.saturating_sub(1)));
            let most = half_wheel.saturating_sub(1);
            accepted!(What::LargestJump(bits).word_within(jump, [1, most]));
        }
        Ok(Self { bits, largest_jump })
    }

    /// `n`, the width of the counter.
    pub const fn bits(&self) -> u8 {
        self.bits
    }

    /// Largest change per sample that is no glitch \[counts\], where one is
    /// looked for.
    pub const fn largest_jump(&self) -> Option<u32> {
        self.largest_jump
    }
}

/// The low bits of a register as a signed number; `shift` is 32 less their number.
#[inline(always)]
pub(crate) const fn signed(register: u32, shift: u32) -> i32 {
    // To the top of the word and back with the sign.
    register
        .wrapping_shl(shift)
        .cast_signed()
        .wrapping_shr(shift)
}

/// Memory of a counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counter {
    /// `c` of the last good reading \[counts, modulo 2^32\].
    pub(crate) position: i32,
    /// Bad readings since then, 0 where the last one was good.
    pub(crate) missed: u32,
    /// True from the first reading on.
    pub(crate) known: bool,
}

impl Counter {
    /// Before the first reading.
    pub(crate) const UNKNOWN: Self = Self {
        position: 0,
        missed: 0,
        known: false,
    };

    /// Takes a register of `bits` bits, of which changes up to `jump` are credible: the
    /// change \[counts\]. One that is not is not followed, and counts as missed.
    #[inline]
    pub(crate) fn follow(&mut self, register: u32, bits: u32, jump: u32) -> i32 {
        let shift = u32::BITS.wrapping_sub(bits);
        if !self.known {
            self.known = true;
            self.position = signed(register, shift);
            return 0;
        }
        // d = register − c, modulo 2^n                                 [counts]
        let difference = signed(register.wrapping_sub(self.position.cast_unsigned()), shift);
        // At 10 µs it takes 12 hours to the end, and there it stays.
        self.missed = self.missed.saturating_add(1);
        if difference.unsigned_abs() <= self.allowed(bits, jump) {
            // c ← c + d, modulo 2^32                                   [counts]
            self.position = self.position.wrapping_add(difference);
            self.missed = 0;
        }
        difference
    }

    /// Largest `|d|` of the last of so many readings since the last good one \[counts\].
    pub(crate) fn allowed(&self, bits: u32, jump: u32) -> u32 {
        if self.missed <= 1 || jump == u32::MAX {
            return jump;
        }
        let half_wheel = 1_u32.wrapping_shl(bits.wrapping_sub(1));
        let grown = jump.saturating_mul(self.missed);
        if grown < half_wheel { grown } else { 0 }
    }

    /// Starts anew after a reading that never came back.
    pub(crate) fn reset(&mut self) {
        if self.missed != 0 {
            *self = Self::UNKNOWN;
        }
    }

    /// The position of the last good reading, if there was one.
    pub(crate) fn position(&self) -> Option<i32> {
        self.known.then_some(self.position)
    }
}
