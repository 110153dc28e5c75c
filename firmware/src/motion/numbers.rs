//! The numbers of planning in their places, and the equations between them.

use super::equations::{EQUATIONS, Program, RELATIVE};
use super::real::Real;

/// Bits of a place.
const PLACE: u8 = 0x7f;
/// In the place of a result: a product or a quotient, otherwise a sum or a difference.
/// In that of the first operand: the latter of the two.
const OPERATION: u8 = 0x80;

/// The numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
#[repr(C)]
pub(super) struct Numbers {
    /// Where the relative places begin.
    pub(super) base: u8,
    places: [Real; 128],
    /// Beside them: every place is one of the 128.
    nowhere: Real,
}

impl Numbers {
    pub(super) const ZEROS: Self = Self {
        base: 0,
        places: [Real::ZERO; 128],
        nowhere: Real::ZERO,
    };

    /// Makes equations true, one after the other.
    #[inline(never)]
    pub(super) fn make(&mut self, program: Program) {
        let first = program.first.into();
        let (_, equations) = EQUATIONS.split_at_checked(first).unwrap_or_default();
        for [result, a, b] in equations.iter().take(program.count.into()) {
            let other = *self.at(*b);
            let mut made = *self.relative(*a);
            let latter = u32::from(a.wrapping_shr(7));
            if result & OPERATION == 0 {
                made.add(other, latter);
            } else if latter == 0 {
                made.multiply(other);
            } else {
                made.divide(other);
            }
            made.normalise();
            *self.relative(*result) = made;
        }
    }

    /// The number at a place, which may be relative.
    #[inline(never)]
    fn relative(&mut self, place: u8) -> &mut Real {
        let mut place = place & PLACE;
        if place < RELATIVE {
            place = place.wrapping_add(self.base);
        }
        self.at(place)
    }

    /// The number at a place that is not relative.
    #[inline(always)]
    pub(super) fn at(&mut self, place: u8) -> &mut Real {
        let place = usize::from(place & PLACE);
        self.places.get_mut(place).unwrap_or(&mut self.nowhere)
    }

    /// Puts a whole number in a place, cut off to 63 bits.
    #[inline(never)]
    pub(super) fn set(&mut self, place: u8, value: u64) -> &mut Real {
        let there = self.relative(place);
        *there = Real::integer(value);
        there.normalise();
        there
    }
}
