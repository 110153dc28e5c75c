//! One interval of the motion as the samples see it, and what is computed at
//! every sample: 32×32→64 products and additions.
//!
//! # Words
//!
//! | value | fraction bits | type |
//! | --- | --- | --- |
//! | line: position less the sine; its step and growth | 62 | [`Long`], modulo 2^34 counts |
//! | sine, cosine: amplitude 2^61 to 2^62 | `Fy`, 30 to 92 | `i64` |
//! | `ε = 2·sin(ω/2)` | 62 | two halves of 32 bits |
//! | velocity | `Fv + 30` | `i64`, below 2^60 |
//! | weight of the velocity | `Fv + 62 − Fy` | `i32`, below 2^31 |
//! | weight of the acceleration | `Fa + 61 − Fy` | `i32`, up to 2^30 |

use super::real::Real;
use crate::reference::Setpoint;
use crate::wide::{self, by_target};

/// Fraction bits at which line and sine meet.
pub(super) const GRID_BITS: u32 = 30;
/// Fraction bits of the sine at most: it is shifted by less than a word.
pub(super) const SINE_BITS_MAX: i32 = 92;
/// Fraction bits of the velocity's sum beyond those of the output.
pub(super) const VELOCITY_BITS: i32 = 30;
/// Half a unit of the output in the velocity's sum.
pub(super) const VELOCITY_HALF: i64 = 1 << 29;
/// Fraction bits of the acceleration's product beyond those of the output.
const ACCELERATION_BITS: u32 = 29;
/// Half a unit of the output in the acceleration's product.
pub(super) const ACCELERATION_HALF: i32 = 1 << 28;

/// Fixed point with 62 fraction bits in 96 bits: what is summed a million
/// times. One addition is three of a 32-bit machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Long {
    /// Multiples of 2^−30, in two words: 12 bytes instead of 16.
    pub high: [u32; 2],
    /// Multiples of 2^−62.
    pub low: u32,
}

impl Long {
    pub(super) fn from_real(value: Real) -> Self {
        let [a, b, c, d, e, f, g, h, i, j, k, l, ..] = value.to_fixed(62).to_le_bytes();
        Self {
            high: [
                u32::from_le_bytes([e, f, g, h]),
                u32::from_le_bytes([i, j, k, l]),
            ],
            low: u32::from_le_bytes([a, b, c, d]),
        }
    }

    /// Cut off to multiples of 2^−30.
    #[inline]
    pub(super) fn grid(self) -> i64 {
        let [lower, upper] = self.high;
        (u64::from(upper).wrapping_shl(32) | u64::from(lower)).cast_signed()
    }

    /// The sum modulo 2^34.
    #[inline]
    fn plus(self, other: Self) -> Self {
        let [a1, a2] = self.high;
        let [b1, b2] = other.high;
        let (low, carry) = self.low.overflowing_add(other.low);
        let (sum1, carry) = a1.carrying_add(b1, carry);
        let (sum2, _) = a2.carrying_add(b2, carry);
        Self {
            high: [sum1, sum2],
            low,
        }
    }
}

/// The factor `ε = 2·sin(ω/2)`, at most √2, with 62 fraction bits:
/// `high·2^32 + low`, where `|low| ≤ 2^31`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Turn {
    /// Multiples of 2^−30.
    pub high: u32,
    /// Multiples of 2^−62.
    pub low: i32,
    /// Half a unit of the result, and the mean of what is left out.
    pub centre: i32,
}

impl Turn {
    pub(super) fn from_real(epsilon: Real) -> Self {
        let [a, b, c, d, e, f, g, h, ..] = epsilon.to_fixed(62).to_le_bytes();
        let low = i32::from_le_bytes([a, b, c, d]);
        // A low half that counts as negative lends one to the high half.
        let lent = u32::from(low < 0);
        Self {
            high: u32::from_le_bytes([e, f, g, h]).wrapping_add(lent),
            low,
            // At most 2^30 + 2^29 in magnitude.
            centre: low.wrapping_shr(1).wrapping_add(1 << 29),
        }
    }

    /// `ε·value` to 1.5 units, for `|value| < 2^62`.
    ///
    /// With `ε = (E·2^32 + l)·2^−62` and `value = H·2^32 + L` the product is
    /// `4·E·H + (E·L + l·H)·2^−30 + l·L·2^−62`. The last term is taken at
    /// `L = 2^31`, which is `centre`'s `l/2` and off by at most 1; the floor is
    /// off by at most ½ from the rounding that the other part of `centre`
    /// makes of it. `E ≤ √2·2^30`, `|H| ≤ 2^30` and `|l| ≤ 2^31`: the bracket
    /// stays below `(√2 + ½)·2^62 + 2^31 < 2^63`, the whole below 2^63.
    fn of(self, value: i64) -> i64 {
        let (high, low) = (wide::upper(value), wide::lower(value).cast_unsigned());
        let cross = wide::product(self.high, low).cast_signed();
        let lower = i64::from(self.centre)
            .wrapping_add(cross)
            .wrapping_add(wide::signed_product(self.low, high));
        // 4·E·H + lower·2^−30: the upper two of three words, and two bits more
        let upper = wide::signed_product(self.high.cast_signed(), high)
            .wrapping_add(i64::from(wide::upper(lower)));
        upper.wrapping_shl(2) | i64::from(wide::lower(lower).cast_unsigned().wrapping_shr(30))
    }
}

/// Course of an interval from one sample to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Constant acceleration; also an interval that has one sample only.
    Straight {
        /// Difference of two steps.
        growth: Long,
        /// Difference of two velocities.
        velocity_growth: i64,
        /// In units of the output.
        acceleration: i32,
    },
    /// A quarter of a sine or of a cosine.
    Sine {
        /// From one sample to the next.
        turn: Turn,
        /// Bits by which the sine is finer than the grid, `Fy − 30`.
        shift: u8,
        /// The velocity where the cosine is 0.
        velocity_centre: i64,
        /// Velocity per unit of two cosines.
        velocity_weight: i32,
        /// Acceleration per unit of the sine.
        acceleration_weight: i32,
        /// Half a unit, and the mean of what is left out.
        acceleration_centre: i32,
    },
}

/// State of the motion at a sample: all that changes.
///
/// In a sine the line is `x + S·sin φ`, `sine` is `S·sin φ`, and `cosine` is
/// `S·cos φ` half a sample later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Point {
    /// The position less the sine.
    pub line: Long,
    /// Its change to the next sample.
    pub step: Long,
    /// `S·sin φ`.
    pub sine: i64,
    /// `S·cos φ`, half a sample later.
    pub cosine: i64,
    /// The velocity's sum.
    pub velocity: i64,
}

/// The samples of one interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// Number of samples, at least one.
    pub samples: u32,
    /// The first of them.
    pub entry: Point,
    /// The way from one to the next.
    pub shape: Shape,
}

impl Piece {
    /// From one sample to the next within the interval.
    #[inline]
    pub(super) fn advance(&self, point: &mut Point) {
        point.line = point.line.plus(point.step);
        match self.shape {
            Shape::Straight {
                growth,
                velocity_growth,
                ..
            } => {
                point.step = point.step.plus(growth);
                point.velocity = point.velocity.wrapping_add(velocity_growth);
            }
            Shape::Sine {
                turn,
                velocity_centre,
                velocity_weight,
                ..
            } => {
                let before = point.cosine;
                point.sine = point.sine.wrapping_add(turn.of(before));
                point.cosine = before.wrapping_sub(turn.of(point.sine));
                // Both below 2^30, so that their sum fits.
                let sum = wide::upper(before).wrapping_add(wide::upper(point.cosine));
                point.velocity =
                    velocity_centre.wrapping_sub(wide::signed_product(velocity_weight, sum));
            }
        }
    }

    /// The setpoint of a travel in the positive direction, or of a mirrored
    /// one where `sign` is not 0 but −1: −a is the complement of a, plus 1.
    #[inline]
    pub(super) fn setpoint(&self, point: &Point, sign: i32) -> Setpoint {
        let (sine, acceleration) = match self.shape {
            Shape::Straight { acceleration, .. } => (0, acceleration),
            Shape::Sine {
                shift,
                acceleration_weight,
                acceleration_centre,
                ..
            } => {
                let weighted = wide::signed_product(acceleration_weight, wide::upper(point.sine))
                    .wrapping_add(i64::from(acceleration_centre));
                (
                    by_target!(
                        point.sine.wrapping_shr(u32::from(shift)),
                        shifted(point.sine, shift)
                    ),
                    wide::lower(weighted.wrapping_shr(ACCELERATION_BITS)),
                )
            }
        };
        let turned = |value: i32| (value ^ sign).wrapping_sub(sign);
        let position = point.line.grid().wrapping_sub(sine);
        let position = (position ^ i64::from(sign))
            .wrapping_sub(i64::from(sign))
            .wrapping_add(1 << GRID_BITS.wrapping_sub(1));
        let velocity = point.velocity.wrapping_shr(VELOCITY_BITS.unsigned_abs());
        Setpoint {
            position: wide::lower(position.wrapping_shr(GRID_BITS)),
            velocity: turned(wide::lower(velocity)),
            acceleration: turned(acceleration),
        }
    }
}

/// `floor(value/2^shift)` for shifts up to 63, from shifts of words: a
/// processor without long products has no routine as short as this.
#[cfg(any(test, all(target_arch = "arm", not(target_has_atomic = "32"))))]
fn shifted(value: i64, shift: u8) -> i64 {
    let (high, low) = (wide::upper(value), wide::lower(value).cast_unsigned());
    let shift = u32::from(shift);
    if shift < 32 {
        // Up by 32 less the shift, in two steps: a word is never shifted by 32.
        let crossing = high
            .cast_unsigned()
            .wrapping_shl(1)
            .wrapping_shl(31_u32.wrapping_sub(shift));
        let low = low.wrapping_shr(shift) | crossing;
        i64::from(high.wrapping_shr(shift)).wrapping_shl(32) | i64::from(low)
    } else {
        i64::from(high.wrapping_shr(shift.wrapping_sub(32)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_by_words_is_the_shift() {
        for value in [
            0,
            1,
            -1,
            i64::MIN,
            i64::MAX,
            0x1234_5678_9abc_def0,
            -(1 << 31),
        ] {
            for shift in 0..=63 {
                assert_eq!(shifted(value, shift), value >> shift, "{value} >> {shift}");
            }
        }
    }
}
