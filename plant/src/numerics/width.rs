//! Numbers of runs that are computed side by side, and their instructions.
//!
//! Every lane sees the operations of a single run in the same order, so the
//! width decides about speed alone, never about bits: nothing is added across
//! lanes, and multiplications and additions are never fused.

use core::ops::{Add, Div, Mul, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4, f64x8, mask64x4, mask64x8};

/// A number of lanes and the instructions that work on them.
pub trait Width: Copy {
    /// Runs side by side.
    const LANES: usize;
    /// One number per lane in memory.
    type Array: Copy + core::fmt::Debug + AsRef<[f64]> + AsMut<[f64]>;
    /// One number per lane in registers.
    type Vector: Copy
        + Add<Output = Self::Vector>
        + Sub<Output = Self::Vector>
        + Mul<Output = Self::Vector>
        + Div<Output = Self::Vector>;
    /// One truth value per lane.
    type Mask: Copy;

    /// The same number in every lane of memory.
    fn array(value: f64) -> Self::Array;
    /// The same number in every lane.
    fn splat(self, value: f64) -> Self::Vector;
    /// From memory.
    fn load(self, array: &Self::Array) -> Self::Vector;
    /// To memory.
    fn store(self, vector: Self::Vector, array: &mut Self::Array);
    /// The largest whole number that is no larger.
    fn floor(self, vector: Self::Vector) -> Self::Vector;
    /// The magnitude.
    fn abs(self, vector: Self::Vector) -> Self::Vector;
    /// `a > b`; false where either is not a number.
    fn greater(self, a: Self::Vector, b: Self::Vector) -> Self::Mask;
    /// `a ≤ b`; false where either is not a number.
    fn at_most(self, a: Self::Vector, b: Self::Vector) -> Self::Mask;
    /// `a` where `mask` holds, elsewhere `b`.
    fn select(self, mask: Self::Mask, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// Bit i of lane i.
    fn bits(self, mask: Self::Mask) -> u64;
    /// Lane i where bit i is set.
    fn lanes(self, bits: u64) -> Self::Mask;
    /// Both hold.
    fn both(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// At least one of them holds.
    fn either(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// The larger of the two, either of them where one is not a number: a single
    /// instruction, of which each set has its own.
    fn max(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// The smaller of the two, likewise.
    fn min(self, a: Self::Vector, b: Self::Vector) -> Self::Vector;

    /// Does something that is seldom done with the width's instructions, but not
    /// in the caller's code: what that keeps in registers stays there.
    fn apart<R>(self, work: impl FnOnce() -> R) -> R;

    /// A copy in memory.
    #[inline(always)]
    fn stored(self, vector: Self::Vector) -> Self::Array {
        let mut array = Self::array(0.0);
        self.store(vector, &mut array);
        array
    }

    /// The larger of the two, `b` where `a` is not a number.
    #[inline(always)]
    fn larger(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        self.select(self.greater(a, b), a, b)
    }

    /// The smaller of the two, `b` where `a` is not a number.
    #[inline(always)]
    fn smaller(self, a: Self::Vector, b: Self::Vector) -> Self::Vector {
        self.select(self.greater(b, a), a, b)
    }
}

/// One run in plain scalars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct One;

/// Numbers in memory, one per lane, on a boundary of their own.
macro_rules! in_memory {
    ($(#[doc = $doc:expr])* $array:ident, $align:literal, $lanes:literal) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[repr(C, align($align))]
        pub struct $array([f64; $lanes]);

        impl AsRef<[f64]> for $array {
            fn as_ref(&self) -> &[f64] {
                &self.0
            }
        }

        impl AsMut<[f64]> for $array {
            fn as_mut(&mut self) -> &mut [f64] {
                &mut self.0
            }
        }
    };
}

in_memory!(
    /// One number in memory, apart from its neighbours: a vector of them, loaded
    /// right after they were stored one by one, would wait for the stores.
    Alone, 16, 1
);

impl Width for One {
    const LANES: usize = 1;
    type Array = Alone;
    type Vector = f64;
    type Mask = bool;

    #[inline(always)]
    fn array(value: f64) -> Alone {
        Alone([value])
    }
    #[inline(always)]
    fn splat(self, value: f64) -> f64 {
        value
    }
    #[inline(always)]
    fn load(self, array: &Alone) -> f64 {
        array.0[0]
    }
    #[inline(always)]
    fn store(self, vector: f64, array: &mut Alone) {
        array.0[0] = vector;
    }
    #[inline(always)]
    fn floor(self, vector: f64) -> f64 {
        vector.floor()
    }
    #[inline(always)]
    fn abs(self, vector: f64) -> f64 {
        vector.abs()
    }
    #[inline(always)]
    fn greater(self, a: f64, b: f64) -> bool {
        a > b
    }
    #[inline(always)]
    fn at_most(self, a: f64, b: f64) -> bool {
        a <= b
    }
    #[inline(always)]
    fn select(self, mask: bool, a: f64, b: f64) -> f64 {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn bits(self, mask: bool) -> u64 {
        u64::from(mask)
    }
    #[inline(always)]
    fn lanes(self, bits: u64) -> bool {
        bits & 1 != 0
    }
    #[inline(always)]
    fn both(self, a: bool, b: bool) -> bool {
        a & b
    }
    #[inline(always)]
    fn either(self, a: bool, b: bool) -> bool {
        a | b
    }
    #[inline(always)]
    fn max(self, a: f64, b: f64) -> f64 {
        if a > b { a } else { b }
    }
    #[inline(always)]
    fn min(self, a: f64, b: f64) -> f64 {
        if b > a { a } else { b }
    }
    #[inline(never)]
    fn apart<R>(self, work: impl FnOnce() -> R) -> R {
        work()
    }
}

/// Runs side by side with the instructions that `S` stands for.
macro_rules! side_by_side {
    ($width:ident, $runs:literal, $array:ident, $align:literal, $lanes:literal, $vector:ident, $mask:ident) => {
        in_memory!(
            #[doc = concat!($runs, " numbers in memory, on a boundary of as many bytes: a load that")]
            #[doc = "crosses the end of a cache line takes twice as long."]
            $array, $align, $lanes
        );

        #[doc = concat!($runs, " runs, with the instructions that `S` stands for.")]
        #[derive(Debug, Clone, Copy)]
        pub struct $width<S: Simd>(
            /// The instruction set, as detected.
            pub S,
        );

        impl<S: Simd> Width for $width<S> {
            const LANES: usize = $lanes;
            type Array = $array;
            type Vector = $vector<S>;
            type Mask = $mask<S>;

            #[inline(always)]
            fn array(value: f64) -> $array {
                $array([value; $lanes])
            }
            #[inline(always)]
            fn splat(self, value: f64) -> $vector<S> {
                $vector::splat(self.0, value)
            }
            #[inline(always)]
            fn load(self, array: &$array) -> $vector<S> {
                $vector::from_slice(self.0, &array.0)
            }
            #[inline(always)]
            fn store(self, vector: $vector<S>, array: &mut $array) {
                vector.store_slice(&mut array.0);
            }
            #[inline(always)]
            fn floor(self, vector: $vector<S>) -> $vector<S> {
                vector.floor()
            }
            #[inline(always)]
            fn abs(self, vector: $vector<S>) -> $vector<S> {
                vector.abs()
            }
            #[inline(always)]
            fn greater(self, a: $vector<S>, b: $vector<S>) -> $mask<S> {
                a.simd_gt(b)
            }
            #[inline(always)]
            fn at_most(self, a: $vector<S>, b: $vector<S>) -> $mask<S> {
                a.simd_le(b)
            }
            #[inline(always)]
            fn select(self, mask: $mask<S>, a: $vector<S>, b: $vector<S>) -> $vector<S> {
                mask.select(a, b)
            }
            #[inline(always)]
            fn bits(self, mask: $mask<S>) -> u64 {
                mask.to_bitmask()
            }
            #[inline(always)]
            fn lanes(self, bits: u64) -> $mask<S> {
                $mask::from_bitmask(self.0, bits)
            }
            #[inline(always)]
            fn both(self, a: $mask<S>, b: $mask<S>) -> $mask<S> {
                a & b
            }
            #[inline(always)]
            fn either(self, a: $mask<S>, b: $mask<S>) -> $mask<S> {
                a | b
            }
            #[inline(always)]
            fn max(self, a: $vector<S>, b: $vector<S>) -> $vector<S> {
                a.max(b)
            }
            #[inline(always)]
            fn min(self, a: $vector<S>, b: $vector<S>) -> $vector<S> {
                a.min(b)
            }
            #[inline(never)]
            fn apart<R>(self, work: impl FnOnce() -> R) -> R {
                self.0.vectorize(work)
            }
        }
    };
}

side_by_side!(Four, "Four", Quartet, 32, 4, f64x4, mask64x4);
side_by_side!(Eight, "Eight", Octet, 64, 8, f64x8, mask64x8);
