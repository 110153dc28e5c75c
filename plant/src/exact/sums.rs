//! Sums of columns, each times a number: what a table is made of. Four rows stand side by
//! side, and each is summed in the order of the columns.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};

use super::system::{Column, Matrix};

/// `Σ_j w_j·c_j`; of none it is zero.
#[inline(always)]
pub(super) fn weighted<S: Simd, const D: usize>(
    simd: S,
    columns: &[[f64; D]],
    weights: &[f64],
) -> [f64; D] {
    let mut sums = [0.0; D];
    let Some((first, rest)) = columns.split_first() else {
        return sums;
    };
    let weight = |j: usize| weights.get(j).copied().unwrap_or(0.0);
    let (fours, singles) = sums.as_chunks_mut::<4>();
    for (i, four) in fours.iter_mut().enumerate() {
        let of = |column: &[f64; D], j: usize| {
            f64x4::from_slice(simd, &column[4 * i..4 * i + 4]) * f64x4::splat(simd, weight(j))
        };
        let mut sum = of(first, 0);
        for (j, column) in (1..).zip(rest) {
            sum += of(column, j);
        }
        sum.store_slice(four);
    }
    for (i, single) in (D - D % 4..).zip(singles) {
        *single = first[i] * weight(0);
        for (j, column) in (1..).zip(rest) {
            *single += column[i] * weight(j);
        }
    }
    sums
}

/// `m·x`.
#[inline(always)]
pub(super) fn times<const D: usize>(simd: impl Simd, m: &Matrix<D>, x: &Column<D>) -> Column<D> {
    weighted(simd, &m.data.0, x.as_slice()).into()
}

/// Adds a column times a number.
#[inline(always)]
pub(super) fn add_times<S: Simd, const D: usize>(
    simd: S,
    sums: &mut [f64; D],
    column: &[f64; D],
    factor: f64,
) {
    let (fours, singles) = sums.as_chunks_mut::<4>();
    for (i, four) in fours.iter_mut().enumerate() {
        let column = f64x4::from_slice(simd, &column[4 * i..4 * i + 4]);
        (f64x4::from_slice(simd, four) + column * f64x4::splat(simd, factor)).store_slice(four);
    }
    for (single, column) in singles.iter_mut().zip(&column[D - D % 4..]) {
        *single += column * factor;
    }
}
