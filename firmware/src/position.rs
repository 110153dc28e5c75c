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
//! is accepted from there on, and the way back is to start anew with
//! `PositionState::default()`, which needs a new reference.
//!
//! # Ranges
//!
//! `n` is 8 to 32. The largest jump is at least 1, or no axis could move, and
//! below `2^(n−1)`, where differences end and no jump would be seen.

use crate::faults::{FaultCause, Trip};
use crate::refusal::{Refusal, What, accepted};
use crate::wide;

/// A counter and what its axis can do at most.
///
/// ```
/// use firmware::{CounterParameters, PositionState};
///
/// // 16 bits, at most 500 counts per sample.
/// let counter = CounterParameters::accept(16, Some(500))?;
/// let mut state = PositionState::default();
/// assert_eq!(counter.read(&mut state, 0x7FFF).position, 32_767);
/// // Two counts on, across the end of the register.
/// assert_eq!(counter.read(&mut state, 0x8001).position, 32_769);
///
/// let reading = counter.read(&mut state, 0x0001);
/// assert_eq!(reading.glitch.map(|trip| trip.measured), Some(-32_768));
/// assert_eq!((reading.position, reading.difference), (32_769, 0));
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
        let counter = Self { bits, largest_jump };
        if let Some(jump) = largest_jump {
            let most = counter.half_wheel().saturating_sub(1);
            accepted!(What::LargestJump(bits).word_within(jump, [1, most]));
        }
        Ok(counter)
    }

    /// Takes the register as it was read; bits above the counter's width are
    /// ignored.
    #[inline]
    pub fn read(&self, state: &mut PositionState, register: u32) -> Reading {
        let Some(last) = state.position else {
            let position = self.signed(register);
            state.position = Some(position);
            return Reading {
                position,
                difference: 0,
                glitch: None,
            };
        };

        // d = register − c, modulo 2^n                                 [counts]
        let difference = self.signed(register.wrapping_sub(last.cast_unsigned()));
        if let Some(limit) = self.allowed(state.missed)
            && difference.unsigned_abs() > limit
        {
            // At 10 µs it takes 12 hours to the end, and there it stays.
            state.missed = state.missed.saturating_add(1);
            return Reading {
                position: last,
                difference: 0,
                glitch: Some(Trip::new(
                    FaultCause::EncoderGlitch,
                    i64::from(difference),
                    i64::from(limit),
                )),
            };
        }

        // c ← c + d, modulo 2^32                                       [counts]
        let position = last.wrapping_add(difference);
        *state = PositionState {
            position: Some(position),
            missed: 0,
        };
        Reading {
            position,
            difference,
            glitch: None,
        }
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

    /// Largest `|d|` after `missed` bad readings \[counts\].
    #[inline]
    fn allowed(&self, missed: u32) -> Option<u32> {
        let largest = self.largest_jump?;
        if missed == 0 {
            return Some(largest);
        }
        let grown = largest.saturating_mul(missed.saturating_add(1));
        Some(if grown < self.half_wheel() { grown } else { 0 })
    }

    /// The low `n` bits as a signed number.
    #[inline]
    fn signed(&self, register: u32) -> i32 {
        // To the top of the word and back with the sign; 0 to 24 places.
        let above = u32::BITS.saturating_sub(u32::from(self.bits));
        register
            .wrapping_shl(above)
            .cast_signed()
            .wrapping_shr(above)
    }

    /// `2^(n−1)`.
    const fn half_wheel(&self) -> u32 {
        1_u32.wrapping_shl(wide::byte(self.bits.saturating_sub(1)))
    }
}

/// Memory of a counter. The default is the state before the first reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PositionState {
    /// `c` of the last good reading \[counts, modulo 2^32\].
    position: Option<i32>,
    /// Bad readings since then.
    missed: u32,
}

impl PositionState {
    /// Position of the last good reading \[counts, modulo 2^32\]; `None` before
    /// the first.
    pub const fn position(&self) -> Option<i32> {
        self.position
    }

    /// Number of readings in a row that have been glitches, up to the last one. Not 0
    /// when a fault is reset: the counter has not come back, start anew.
    pub const fn missed(&self) -> u32 {
        self.missed
    }
}

/// Results of one reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// Position \[counts, modulo 2^32\]: the last good one after a glitch.
    pub position: i32,
    /// Change since the last good reading \[counts\]; 0 at the first reading
    /// and at a glitch.
    pub difference: i32,
    /// The jump, signed, and the largest magnitude that was allowed, if the
    /// reading was not credible.
    pub glitch: Option<Trip>,
}
