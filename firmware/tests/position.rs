//! Counter registers of every width against a position in 128 bits that never
//! wraps, and what becomes of readings that no motion explains.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use firmware::faults::{FaultCause, Trip};
use firmware::refusal::What;
use firmware::{CounterParameters, PositionState, Refusal};
use proptest::prelude::*;

/// Between `−limit` and `limit`, the ends often.
fn step_within(random: &mut Random, limit: i64) -> i64 {
    match random.between(0, 7) {
        0 => limit,
        1 => -limit,
        _ => random.between(-limit, limit),
    }
}

/// Reading of a counter of `bits` bits at `position`, with rubbish above.
fn register(position: i128, bits: u8, rubbish: u32) -> u32 {
    let low = position.rem_euclid(1 << bits) as u32;
    let above = u32::MAX.checked_shl(bits.into()).unwrap_or(0);
    low | (rubbish & above)
}

/// `position` modulo 2^32, in the range of an `i32`.
fn wheel(position: i128) -> i32 {
    position.rem_euclid(1 << 32) as u32 as i32
}

/// Start of a counter for a reading of `position`: sign-extended.
fn sign_extended(position: i128, bits: u8) -> i128 {
    let half = 1_i128 << (bits - 1);
    (position + half).rem_euclid(2 * half) - half
}

/// 2.5 million samples: every width, the largest jumps of either sign among
/// them, across the end of the register and that of the wheel.
#[test]
fn the_position_is_that_of_an_endless_counter() {
    let mut wheel_ends = 0;
    for bits in 8..=32_u8 {
        let mut random = Random(bits.into());
        for jump in [1, (1 << (bits - 1)) / 3, (1 << (bits - 1)) - 1] {
            let largest = u32::try_from(jump).expect("below 2^31");
            let checked = CounterParameters::accept(bits, Some(largest)).expect("in range");
            let unchecked = CounterParameters::accept(bits, None).expect("in range");
            let (mut a, mut b) = (PositionState::default(), PositionState::default());

            let mut truth = i128::from(random.next() as i64);
            let origin = truth - sign_extended(truth, bits);
            let first = register(truth, bits, random.next() as u32);
            let reading = checked.read(&mut a, first);
            assert_eq!(reading, unchecked.read(&mut b, first));
            assert_eq!(reading.position, wheel(truth - origin));
            assert_eq!((reading.difference, reading.glitch), (0, None));

            // A drift makes the path long enough for many wheels.
            let drift = jump / 2;
            for _ in 0..33_334 {
                let step = (step_within(&mut random, jump) + drift).min(jump);
                let before = wheel(truth - origin);
                truth += i128::from(step);
                let shown = register(truth, bits, random.next() as u32);
                let reading = checked.read(&mut a, shown);
                assert_eq!(reading, unchecked.read(&mut b, shown));
                assert_eq!(reading.position, wheel(truth - origin));
                assert_eq!(i64::from(reading.difference), step);
                assert_eq!(reading.glitch, None);
                assert_eq!(a.position(), Some(reading.position));
                let after = wheel(truth - origin);
                wheel_ends += i32::from(step != 0 && (after > before) != (step > 0));
            }
        }
    }
    assert!(wheel_ends > 10_000, "{wheel_ends} ends of the wheel only");
}

/// Contrast: a step of half the register looks like its opposite.
#[test]
fn half_a_register_is_too_far() {
    for bits in 8..=32_u8 {
        let counter = CounterParameters::accept(bits, None).expect("in range");
        let mut state = PositionState::default();
        counter.read(&mut state, 0);
        let reading = counter.read(&mut state, 1 << (bits - 1));
        assert_eq!(i64::from(reading.difference), -(1 << (bits - 1)));
    }
}

#[test]
fn a_register_of_32_bits_is_the_position() {
    let counter = CounterParameters::accept(32, None).expect("in range");
    let mut state = PositionState::default();
    for register in [0x8000_0000, 0x7FFF_FFFF, 0xFFFF_FFFF, 0, 5, 0xDEAD_BEEF] {
        let reading = counter.read(&mut state, register);
        assert_eq!(reading.position, register as i32);
    }
}

#[test]
fn the_limit_itself_is_a_motion_and_one_count_more_is_a_glitch() {
    for bits in 8..=32_u8 {
        let max = (1_u32 << (bits - 1)) - 1;
        for largest in [1, max / 2, max] {
            let counter = CounterParameters::accept(bits, Some(largest)).expect("in range");
            let limit = i64::from(largest);
            for (step, bad) in [
                (limit, false),
                (-limit, false),
                (limit + 1, true),
                (-limit - 1, true),
            ] {
                let mut state = PositionState::default();
                counter.read(&mut state, 0);
                let reading = counter.read(&mut state, register(step.into(), bits, 0));
                // At the largest limit one count more, up or down, is −2^(n−1).
                let seen = sign_extended(step.into(), bits) as i64;
                let trip = Trip {
                    cause: FaultCause::EncoderGlitch,
                    measured: seen,
                    limit,
                };
                assert_eq!(reading.glitch, bad.then_some(trip));
                let moved = if bad { 0 } else { seen };
                assert_eq!(i64::from(reading.position), moved);
                assert_eq!(i64::from(reading.difference), moved);
                assert_eq!(state.missed(), u32::from(bad));
            }
        }
    }
}

proptest! {
    /// Bad readings in between cost nothing, as long as the axis cannot have
    /// moved by half the register meanwhile.
    #[test]
    fn disturbed_readings_leave_no_trace(
        bits in 12_u8..=32,
        largest in 1_u32..=100,
        start in any::<i64>(),
        samples in prop::collection::vec((-100_i128..=100, any::<u32>(), 0_u8..4), 1..200),
    ) {
        let counter = CounterParameters::accept(bits, Some(largest)).expect("in range");
        let mut state = PositionState::default();
        let mut truth = i128::from(start);
        let origin = truth - sign_extended(truth, bits);
        counter.read(&mut state, register(truth, bits, 0));

        let mut since = 0_u32;
        for (step, rubbish, kind) in samples {
            truth += step.clamp(-i128::from(largest), i128::from(largest));
            let last = state.position().expect("has begun");
            let allowed = largest * (since + 1);
            // One of four transfers is disturbed; five in a row at most, so
            // that 600 counts stay below the half of 12 bits.
            let jump = sign_extended(i128::from(rubbish) - i128::from(last), bits);
            if kind == 0 && since < 5 && jump.abs() > i128::from(allowed) {
                let reading = counter.read(&mut state, rubbish);
                let trip = reading.glitch.expect("no motion explains it");
                prop_assert_eq!(i128::from(trip.measured), jump);
                prop_assert_eq!(trip.limit, i64::from(allowed));
                prop_assert_eq!((reading.position, reading.difference), (last, 0));
                since += 1;
            } else {
                let reading = counter.read(&mut state, register(truth, bits, 0));
                prop_assert_eq!(reading.glitch, None);
                prop_assert_eq!(reading.position, wheel(truth - origin));
                prop_assert_eq!(reading.difference, reading.position.wrapping_sub(last));
                since = 0;
            }
            prop_assert_eq!(state.missed(), since);
        }
    }
}

/// 100 counts a sample in 8 bits: after one bad reading 200 would be allowed,
/// which 8 bits cannot tell from −56.
#[test]
fn a_counter_that_was_away_too_long_has_to_start_anew() {
    let counter = CounterParameters::accept(8, Some(100)).expect("in range");
    let mut state = PositionState::default();
    counter.read(&mut state, 10);
    assert!(counter.read(&mut state, 111).glitch.is_some());
    for register in (0..=255).filter(|register| *register != 10) {
        let trip = counter.read(&mut state, register).glitch;
        assert_eq!(trip.map(|trip| trip.limit), Some(0));
    }
    assert_eq!(state.missed(), 256);
    assert_eq!(state.position(), Some(10));

    state = PositionState::default();
    let reading = counter.read(&mut state, 0xFE);
    assert_eq!((reading.position, reading.glitch), (-2, None));
    assert_eq!(state.missed(), 0);
}

/// In 8 bits two samples of 63 counts are still told apart, two of 64 are not:
/// 128 is its own complement.
#[test]
fn a_missed_sample_allows_its_jump_below_half_the_register() {
    for (largest, limit) in [(63, 126), (64, 0)] {
        let counter = CounterParameters::accept(8, Some(largest)).expect("in range");
        for step in [-128_i64, -127, -126, 126, 127] {
            let mut state = PositionState::default();
            counter.read(&mut state, 0);
            assert!(counter.read(&mut state, 100).glitch.is_some());
            let reading = counter.read(&mut state, register(step.into(), 8, 0));
            let trip = reading.glitch.map(|trip| (trip.measured, trip.limit));
            assert_eq!(trip, (step.abs() > limit).then_some((step, limit)));
        }
    }
}

#[test]
fn what_is_not_accepted_says_what_would_be() {
    for bits in 0..=u8::MAX {
        let supported = (8..=32).contains(&bits);
        let accepted = CounterParameters::accept(bits, None);
        let bits_of = accepted.map(|counter| counter.bits());
        let expected =
            supported
                .then_some(bits)
                .ok_or(refusal(What::CounterBits, bits.into(), [8, 32]));
        assert_eq!(bits_of, expected);
        if !supported {
            continue;
        }
        let max = (1_u32 << (bits - 1)) - 1;
        for (largest_jump, fits) in [(0, false), (1, true), (max, true), (max + 1, false)] {
            let what = What::LargestJump(bits);
            let error = refusal(what, largest_jump.into(), [1, max.into()]);
            let accepted = CounterParameters::accept(bits, Some(largest_jump));
            assert_eq!(accepted.err(), (!fits).then_some(error));
        }
    }
    let error = CounterParameters::accept(16, Some(32_768)).expect_err("half of 16 bits");
    assert_eq!(
        error.to_string(),
        "a largest jump of 32768 counts cannot be told from a wrap of 16 bits \
         or lets no axis move; it must lie between 1 and 32767"
    );
    assert_eq!(
        CounterParameters::accept(33, None)
            .expect_err("too wide")
            .to_string(),
        "a counter of 33 bits is not supported; it must have between 8 and 32"
    );
}

/// Refusal with setting, value, and the range that is accepted.
fn refusal(what: What, value: i64, [least, most]: [i64; 2]) -> Refusal {
    Refusal {
        what,
        value,
        least,
        most,
    }
}
