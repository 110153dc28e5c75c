//! Counter registers of every width against a position in 128 bits that never
//! wraps, and what becomes of readings that no motion explains: through an axis
//! without gains, under power and without.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;
mod rig;

use exact::Random;
use firmware::law::LawWords;
use firmware::refusal::What;
use firmware::{AxisState, CounterParameters, Event, FaultCause, State};
use proptest::prelude::*;

/// An axis whose counter is fed.
#[derive(Clone, Copy)]
struct Counter {
    state: AxisState,
    tick: u64,
}

impl Counter {
    fn new(bits: u8, largest_jump: Option<u32>, powered: bool) -> Self {
        let mut axis = rig::axis(LawWords::NONE);
        axis.counter = CounterParameters::accept(bits, largest_jump).expect("in range");
        let mut state = AxisState::start(&axis);
        if powered {
            state.request(Event::Enable).expect("disabled");
        }
        Self { state, tick: 0 }
    }

    /// The position after a sample with this register.
    fn read(&mut self, register: u32) -> i32 {
        let inputs = rig::at(self.tick, register.cast_signed());
        self.state.tick(&inputs, &mut rig::Silent);
        self.tick += 1;
        self.state.position().expect("has been read")
    }

    /// Measured value and limit of the glitch that is latched.
    fn glitch(&self) -> Option<(i64, i64)> {
        self.state.fault().map(|fault| {
            assert_eq!(fault.cause, FaultCause::EncoderGlitch);
            (fault.values.measured, fault.values.limit)
        })
    }
}

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
            let largest = u32::try_from(jump).ok();
            let counters = [(largest, true), (largest, false), (None, true)];
            let mut counters = counters.map(|(jump, on)| Counter::new(bits, jump, on));
            let mut truth = i128::from(random.next() as i64);
            let origin = truth - sign_extended(truth, bits);
            // A drift makes the path long enough for many wheels.
            let drift = jump / 2;
            let mut step = 0;
            for _ in 0..33_334 {
                let before = wheel(truth - origin);
                truth += i128::from(step);
                let after = wheel(truth - origin);
                let shown = register(truth, bits, random.next() as u32);
                for counter in &mut counters {
                    assert_eq!(counter.read(shown), after);
                }
                wheel_ends += i32::from(step != 0 && (after > before) != (step > 0));
                step = (step_within(&mut random, jump) + drift).min(jump);
            }
            assert!(counters.iter().all(|counter| counter.glitch().is_none()));
        }
    }
    assert!(wheel_ends > 10_000, "{wheel_ends} ends of the wheel only");
}

/// Contrast: a step of half the register looks like its opposite.
#[test]
fn half_a_register_is_too_far() {
    for bits in 8..=32_u8 {
        for powered in [false, true] {
            let mut counter = Counter::new(bits, None, powered);
            counter.read(0);
            let half = 1 << (bits - 1);
            assert_eq!(i64::from(counter.read(half)), -i64::from(half));
        }
    }
}

#[test]
fn a_register_of_32_bits_is_the_position() {
    let mut counter = Counter::new(32, None, true);
    for register in [0x8000_0000, 0x7FFF_FFFF, 0xFFFF_FFFF, 0, 5, 0xDEAD_BEEF] {
        assert_eq!(counter.read(register), register as i32);
    }
}

#[test]
fn the_limit_itself_is_a_motion_and_one_count_more_is_a_glitch() {
    for bits in 8..=32_u8 {
        let max = (1_u32 << (bits - 1)) - 1;
        for (largest, powered) in [(1, false), (max / 2, true), (max, false), (max, true)] {
            let limit = i64::from(largest);
            for step in [limit, -limit, limit + 1, -limit - 1] {
                let mut counter = Counter::new(bits, Some(largest), powered);
                counter.read(0);
                let position = counter.read(register(step.into(), bits, 0));
                // At the largest limit one count more, up or down, is −2^(n−1).
                let seen = sign_extended(step.into(), bits) as i64;
                let bad = step.abs() > limit;
                assert_eq!(counter.glitch(), bad.then_some((seen, limit)));
                assert_eq!(i64::from(position), if bad { 0 } else { seen });
                assert_eq!(counter.state.state() == State::Fault, bad);
            }
        }
    }
}

proptest! {
    /// Bad readings in between cost nothing, as long as the axis cannot have
    /// moved by half the register meanwhile: each allows the jump once more.
    #[test]
    fn disturbed_readings_leave_no_trace(
        bits in 12_u8..=32,
        largest in 1_u32..=100,
        start in any::<i64>(),
        powered in any::<bool>(),
        samples in prop::collection::vec((-100_i128..=100, any::<u32>(), 0_u8..4), 1..200),
    ) {
        let mut counter = Counter::new(bits, Some(largest), powered);
        let mut truth = i128::from(start);
        let origin = truth - sign_extended(truth, bits);
        let mut last = counter.read(register(truth, bits, 0));
        let (mut since, mut first) = (0_u32, None);
        for (step, rubbish, kind) in samples {
            truth += step.clamp(-i128::from(largest), i128::from(largest));
            let allowed = i128::from(largest * (since + 1));
            for (by, seen) in [(allowed, true), (allowed + 1, false)] {
                let shown = register(i128::from(last) + by, bits, 0);
                prop_assert_eq!({ counter }.read(shown) != last, seen, "by {}", by);
            }
            // One of four transfers is disturbed; five in a row at most, so
            // that 600 counts stay below the half of 12 bits.
            let jump = sign_extended(i128::from(rubbish) - i128::from(last), bits);
            if kind == 0 && since < 5 && jump.abs() > allowed {
                prop_assert_eq!(counter.read(rubbish), last);
                first = first.or(Some((jump as i64, allowed as i64)));
                since += 1;
            } else {
                last = counter.read(register(truth, bits, 0));
                prop_assert_eq!(last, wheel(truth - origin));
                since = 0;
            }
            prop_assert_eq!(counter.glitch(), first);
        }
    }
}

/// 100 counts a sample in 8 bits: after one bad reading 200 would be allowed,
/// which 8 bits cannot tell from −56. The reset of the fault starts anew.
#[test]
fn a_counter_that_was_away_too_long_has_to_start_anew() {
    for powered in [false, true] {
        let mut counter = Counter::new(8, Some(100), powered);
        counter.read(10);
        counter.read(111);
        for register in (0..=255).filter(|register| *register != 10) {
            assert_eq!(counter.read(register), 10);
        }
        assert_eq!(counter.glitch(), Some((101, 100)));
        // The very register of before is one to go on from.
        let mut back = counter;
        assert_eq!([10, 11].map(|register| back.read(register)), [10, 11]);

        counter.state.request(Event::Reset).expect("a fault");
        assert_eq!(counter.state.position(), None);
        assert_eq!((counter.read(0xFE), counter.glitch()), (-2, None));
        // Contrast: a glitch that came back leaves the position at its reset.
        back.state.request(Event::Reset).expect("a fault");
        assert_eq!(back.state.position(), Some(11));
    }
}

/// In 8 bits two samples of 63 counts are still told apart, two of 64 are not:
/// 128 is its own complement.
#[test]
fn a_missed_sample_allows_its_jump_below_half_the_register() {
    for (largest, limit) in [(63, 126), (64, 0)] {
        for step in [-128_i64, -127, -126, 126, 127] {
            let mut counter = Counter::new(8, Some(largest), true);
            assert_eq!([0, 100].map(|register| counter.read(register)), [0, 0]);
            let position = counter.read(register(step.into(), 8, 0));
            let taken = step.abs() <= limit;
            assert_eq!(i64::from(position), if taken { step } else { 0 });
        }
    }
}

#[test]
fn what_is_not_accepted_says_what_would_be() {
    let refused = |bits, jump| {
        let refusal = CounterParameters::accept(bits, jump).err();
        refusal.map(|no| (no.what, no.value, [no.least, no.most]))
    };
    for bits in 0..=u8::MAX {
        let error = (What::CounterBits, bits.into(), [8, 32]);
        if !(8..=32).contains(&bits) {
            assert_eq!(refused(bits, None), Some(error));
            continue;
        }
        let accepted = CounterParameters::accept(bits, None);
        assert_eq!(accepted.map(|counter| counter.bits()), Ok(bits));
        let max = (1_u32 << (bits - 1)) - 1;
        for (largest_jump, fits) in [(0, false), (1, true), (max, true), (max + 1, false)] {
            let what = What::LargestJump(bits);
            let error = (what, largest_jump.into(), [1, max.into()]);
            assert_eq!(refused(bits, Some(largest_jump)), (!fits).then_some(error));
        }
    }
    let sentence = |bits, jump| {
        let refusal = CounterParameters::accept(bits, jump).expect_err("refused");
        refusal.to_string()
    };
    assert_eq!(
        sentence(16, Some(32_768)),
        "a largest jump of 32768 counts cannot be told from a wrap of 16 bits \
         or lets no axis move; it must lie between 1 and 32767"
    );
    assert_eq!(
        sentence(33, None),
        "a counter of 33 bits is not supported; it must have between 8 and 32"
    );
}
