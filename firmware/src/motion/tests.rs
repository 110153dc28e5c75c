//! Samples made from each other against samples computed alone.

#![allow(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    clippy::integer_division_remainder_used,
    reason = "a test fails by panicking"
)]

extern crate std;

use heapless::Vec;

use super::interval::{Interval, chain};
use super::piece::{Piece, Point, Shape};
use super::real::Real;

/// Worst distance \[2^−30 counts\] of an interval's samples, one made from
/// the other by `advance`, from each computed by itself, where `every`-th
/// is looked at; and the bound.
fn drift(
    interval: &Interval,
    samples: u64,
    every: usize,
    advance: impl Fn(&Piece, &mut Point),
) -> (i64, i64) {
    let interval = Interval {
        samples,
        ..*interval
    };
    let shift = |piece: &Piece| match piece.shape {
        Shape::Straight { .. } => 0,
        Shape::Sine { shift, .. } => u32::from(shift),
    };
    let piece = interval.piece(0, 0).expect("the motion has a plan");
    let mut point = piece.entry;
    let mut worst = 0;
    for k in 1..samples {
        advance(&piece, &mut point);
        if !usize::try_from(samples - k).is_ok_and(|left| left % every == 1 % every) {
            continue;
        }
        let alone = Interval {
            samples: 1,
            first: interval.first.plus(Real::from_integer(k)),
            ..interval
        };
        let alone = alone.piece(0, 0).expect("one sample has a plan");
        let position = point.line.grid() - (point.sine >> shift(&piece));
        worst = worst.max((position - alone.entry.line.grid()).abs());
    }
    let n = i64::try_from(samples).expect("few");
    let bound = match piece.shape {
        // (N + N²/2)·2^−62
        Shape::Straight { .. } => (n + n * n / 2) >> 32,
        // 6·N·2^−Fy
        Shape::Sine { .. } => (6 * n) >> shift(&piece),
    };
    // Three units for grid and planning.
    (worst, bound + 3)
}

const SAMPLES: u64 = 20_000;

/// 2^31 counts (almost) in quarter waves and constant parts, 80 000
/// samples each and none at a whole sample.
fn intervals() -> Vec<Interval, 7> {
    let each = 80_000_333_777_777;
    chain(i64::MAX.unsigned_abs(), [each; 7], 1_000_000_000)
        .expect("a motion")
        .1
}

#[test]
fn samples_made_from_each_other_stay_with_those_computed_alone() {
    for interval in intervals() {
        let (worst, bound) = drift(&interval, SAMPLES, 1, Piece::advance);
        std::println!(
            "interval {}: {worst}·2^-30 counts after {SAMPLES} samples, bound {bound}",
            interval.number
        );
        assert!(worst <= bound, "interval {}", interval.number);
    }
}

/// As long as an interval can be at this amplitude.
#[test]
fn the_longest_intervals_stay_too() {
    let each = 16_700_000_333_777_777;
    let (_, intervals) =
        chain(1 << 62, [each, 0, 0, 0, 0, 0, each], 1_000_000_000).expect("a motion");
    for interval in [intervals[0], intervals[6]] {
        let samples = interval.samples;
        assert!(samples > 16_000_000, "{samples}");
        let (worst, bound) = drift(&interval, samples, 1 << 16, Piece::advance);
        std::println!(
            "interval {}: {worst}·2^-30 counts after {samples} samples, bound {bound}",
            interval.number
        );
        assert!(worst <= bound && bound < 1 << 28);
    }
}

/// The measure is worth something: shorter words fail it, and by more
/// than the quarter of a count that is promised.
#[test]
fn shorter_words_drift_away() {
    let sines = [0, 2, 4, 6];
    for interval in sines.map(|index| intervals()[index]) {
        let quarter = 1 << 28;
        // A factor of 32 bits.
        let short_factor = |piece: &Piece, point: &mut Point| {
            let mut piece = *piece;
            if let Shape::Sine { turn, .. } = &mut piece.shape {
                (turn.low, turn.centre) = (0, 1 << 29);
            }
            piece.advance(point);
        };
        let (worst, _) = drift(&interval, SAMPLES, 1, short_factor);
        assert!(worst > quarter, "factor: {worst}");
        // A sine of 32 bits.
        let short_sine = |piece: &Piece, point: &mut Point| {
            piece.advance(point);
            point.sine &= !0xFFFF_FFFF;
        };
        let (worst, _) = drift(&interval, SAMPLES, 1, short_sine);
        assert!(worst > quarter, "sine: {worst}");
    }
    // A step of 32 fraction bits.
    for interval in [1, 3, 5].map(|index| intervals()[index]) {
        let short_step = |piece: &Piece, point: &mut Point| {
            let mut piece = *piece;
            if let Shape::Straight { growth, .. } = &mut piece.shape {
                growth.low = 0;
            }
            point.step.low = 0;
            piece.advance(point);
        };
        let (worst, bound) = drift(&interval, SAMPLES, 1, short_step);
        assert!(worst > 1_000 * bound, "step: {worst}");
    }
}
