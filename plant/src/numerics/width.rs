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
    /// Four numbers per lane in registers, which have their operations in common: a vector
    /// of their own where there is one lane.
    type Quad: Copy + Add<Output = Self::Quad> + Mul<Output = Self::Quad>;
    /// The same in memory.
    type QuadArray: Copy + core::fmt::Debug;

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

    /// Four numbers of every lane.
    fn quad(self, parts: [Self::Vector; 4]) -> Self::Quad;
    /// Each of the four.
    fn parts(self, quad: Self::Quad) -> [Self::Vector; 4];
    /// `Σ_j column_j·v_j`, of an upper triangle: below the diagonal there are zeros.
    fn upper_times<const N: usize>(
        self,
        columns: &[[f64; 4]; N],
        vectors: &[Self::Vector; N],
    ) -> Self::Quad;
    /// Their magnitudes.
    fn quad_abs(self, quad: Self::Quad) -> Self::Quad;
    /// The larger of each two, as [`Width::max`].
    fn quad_max(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// A number four times in every lane of memory.
    fn quad_array(value: f64) -> Self::QuadArray;
    /// From memory.
    fn load_quad(self, array: &Self::QuadArray) -> Self::Quad;
    /// To memory.
    fn store_quad(self, quad: Self::Quad, array: &mut Self::QuadArray);

    /// Does something that is seldom done with the width's instructions, but not
    /// in the caller's code: what that keeps in registers stays there.
    fn apart<R>(self, work: impl FnOnce() -> R) -> R;

    /// Four numbers, the same in every lane.
    #[inline(always)]
    fn numbers(self, [a, b, c, d]: &[f64; 4]) -> Self::Quad {
        self.quad([
            self.splat(*a),
            self.splat(*b),
            self.splat(*c),
            self.splat(*d),
        ])
    }

    /// Each of the numbers times what every lane has.
    #[inline(always)]
    fn multiples(self, numbers: &[f64; 4], vector: Self::Vector) -> Self::Quad {
        self.numbers(numbers) * self.quad([vector; 4])
    }

    /// The same four but for one.
    #[inline(always)]
    fn with_part(self, quad: Self::Quad, place: usize, part: Self::Vector) -> Self::Quad {
        let mut parts = self.parts(quad);
        parts[place] = part;
        self.quad(parts)
    }

    /// A copy in memory.
    #[inline(always)]
    fn stored(self, vector: Self::Vector) -> Self::Array {
        let mut array = Self::array(0.0);
        self.store(vector, &mut array);
        array
    }

    /// Copies in memory.
    #[inline(always)]
    fn stored_each<const N: usize>(self, vectors: &[Self::Vector; N]) -> [Self::Array; N] {
        let mut arrays = [Self::array(0.0); N];
        for (vector, array) in vectors.iter().zip(&mut arrays) {
            self.store(*vector, array);
        }
        arrays
    }

    /// Each from memory.
    #[inline(always)]
    fn load_each<const N: usize>(self, arrays: &[Self::Array; N]) -> [Self::Vector; N] {
        arrays.each_ref().map(
            #[inline(always)]
            |array| self.load(array),
        )
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

/// Four vectors.
#[derive(Debug, Clone, Copy)]
pub struct Each<V>([V; 4]);

impl<V: Copy + Add<Output = V>> Add for Each<V> {
    type Output = Self;

    #[inline(always)]
    fn add(self, Self([e, f, g, h]): Self) -> Self {
        let Self([a, b, c, d]) = self;
        Self([a + e, b + f, c + g, d + h])
    }
}

impl<V: Copy + Mul<Output = V>> Mul for Each<V> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, Self([e, f, g, h]): Self) -> Self {
        let Self([a, b, c, d]) = self;
        Self([a * e, b * f, c * g, d * h])
    }
}

/// [`Width::upper_times`] without the terms that are zero.
#[inline(always)]
fn above_zeros<W: Width, const N: usize>(
    w: W,
    columns: &[[f64; 4]; N],
    vectors: &[W::Vector; N],
) -> [W::Vector; 4] {
    let mut sums = [w.splat(0.0); 4];
    for (i, sum) in sums.iter_mut().enumerate() {
        *sum = w.splat(columns[i][i]) * vectors[i];
        for j in i + 1..N {
            *sum = *sum + w.splat(columns[j][i]) * vectors[j];
        }
    }
    sums
}

/// Four numbers of a lane as four vectors.
macro_rules! quad_of_vectors {
    () => {
        type Quad = Each<Self::Vector>;
        type QuadArray = [Self::Array; 4];

        #[inline(always)]
        fn quad(self, parts: [Self::Vector; 4]) -> Self::Quad {
            Each(parts)
        }
        #[inline(always)]
        fn parts(self, Each(parts): Self::Quad) -> [Self::Vector; 4] {
            parts
        }
        #[inline(always)]
        fn upper_times<const N: usize>(
            self,
            columns: &[[f64; 4]; N],
            vectors: &[Self::Vector; N],
        ) -> Self::Quad {
            Each(above_zeros(self, columns, vectors))
        }
        #[inline(always)]
        fn quad_abs(self, Each([a, b, c, d]): Self::Quad) -> Self::Quad {
            Each([self.abs(a), self.abs(b), self.abs(c), self.abs(d)])
        }
        #[inline(always)]
        fn quad_max(self, Each(a): Self::Quad, Each(b): Self::Quad) -> Self::Quad {
            let max = |i: usize| Width::max(self, a[i], b[i]);
            Each([max(0), max(1), max(2), max(3)])
        }
        #[inline(always)]
        fn quad_array(value: f64) -> Self::QuadArray {
            [Self::array(value); 4]
        }
        #[inline(always)]
        fn load_quad(self, [a, b, c, d]: &Self::QuadArray) -> Self::Quad {
            Each([self.load(a), self.load(b), self.load(c), self.load(d)])
        }
        #[inline(always)]
        fn store_quad(self, Each(parts): Self::Quad, array: &mut Self::QuadArray) {
            for (part, array) in parts.into_iter().zip(array) {
                self.store(part, array);
            }
        }
    };
}

/// What one run has in scalars.
macro_rules! one_in_scalars {
    () => {
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
    };
}

/// One run in plain scalars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct One;

impl Width for One {
    one_in_scalars!();
    quad_of_vectors!();

    #[inline(never)]
    fn apart<R>(self, work: impl FnOnce() -> R) -> R {
        work()
    }
}

/// One run, with the instructions that `S` stands for where it has four numbers in common.
#[derive(Debug, Clone, Copy)]
pub struct Single<S: Simd>(
    /// The instruction set, as detected.
    pub S,
);

impl<S: Simd> Width for Single<S> {
    one_in_scalars!();

    type Quad = f64x4<S>;
    type QuadArray = Quartet;

    #[inline(always)]
    fn quad(self, parts: [f64; 4]) -> f64x4<S> {
        f64x4::from_slice(self.0, &parts)
    }
    #[inline(always)]
    fn parts(self, quad: f64x4<S>) -> [f64; 4] {
        quad.into()
    }
    #[inline(always)]
    fn upper_times<const N: usize>(self, columns: &[[f64; 4]; N], vectors: &[f64; N]) -> f64x4<S> {
        let mut sum = self.multiples(&columns[0], vectors[0]);
        for j in 1..N {
            sum += self.multiples(&columns[j], vectors[j]);
        }
        sum
    }
    #[inline(always)]
    fn quad_abs(self, quad: f64x4<S>) -> f64x4<S> {
        quad.abs()
    }
    #[inline(always)]
    fn quad_max(self, a: f64x4<S>, b: f64x4<S>) -> f64x4<S> {
        a.max(b)
    }
    #[inline(always)]
    fn quad_array(value: f64) -> Quartet {
        Quartet([value; 4])
    }
    #[inline(always)]
    fn load_quad(self, array: &Quartet) -> f64x4<S> {
        f64x4::from_slice(self.0, &array.0)
    }
    #[inline(always)]
    fn store_quad(self, quad: f64x4<S>, array: &mut Quartet) {
        quad.store_slice(&mut array.0);
    }

    #[inline(never)]
    fn apart<R>(self, work: impl FnOnce() -> R) -> R {
        self.0.vectorize(work)
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
            quad_of_vectors!();

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
