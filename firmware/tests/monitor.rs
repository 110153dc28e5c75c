//! The monitors of an axis against plain models: the following error against the
//! demand itself in 128 bits, the others against a list of what they have seen.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;
mod rig;

use exact::Random;
use firmware::axis::Monitors;
use firmware::law::{Law, LawWords};
use firmware::monitor::{
    EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor,
};
use firmware::output::{Output, Quantiser};
use firmware::refusal::What;
use firmware::{Axis, AxisState, Event, FaultCause, GainWord, Inputs, Next, Setpoint};
use proptest::prelude::*;
use rig::{Script, at, position};

/// Cause, measured value and limit.
type Trip = (FaultCause, i64, i64);

/// An axis that moves under monitors, and its counter.
struct Guarded {
    state: AxisState,
    tick: u64,
    register: i32,
}

impl Guarded {
    /// Without gains, or with one code per count behind 24 bits.
    fn new(gain: bool, guard: impl FnOnce(&mut Monitors)) -> Self {
        let words = LawWords {
            kp: GainWord::new(i32::from(gain) << 29, 29),
            error_bits: 24,
            ..LawWords::NONE
        };
        let law = Law::accept(words, rig::dac(24)).expect("accepted words");
        let mut axis = Axis::new(law, Output::unlimited(law.dac(), Quantiser::Nearest));
        guard(&mut axis.monitors);
        Self {
            state: rig::started(&axis),
            tick: 0,
            register: 0,
        }
    }

    /// A sample that is `error` away from its setpoint; the trip in it, after
    /// which the axis goes on.
    fn sample(&mut self, error: i32, velocity: i32) -> Option<Trip> {
        let setpoint = Setpoint {
            velocity,
            ..position(self.register.wrapping_add(error))
        };
        let mut source = Script::new(|_| Next::Setpoint(setpoint));
        self.state.tick(&at(self.tick, self.register), &mut source);
        self.tick += 1;
        self.latched()
    }

    fn latched(&mut self) -> Option<Trip> {
        let fault = *self.state.fault()?;
        self.state.request(Event::Reset).expect("a fault");
        rig::start(&mut self.state);
        Some((fault.cause, fault.values.measured, fault.values.limit))
    }
}

/// A number of any magnitude, all lengths alike.
fn word(random: &mut Random) -> i32 {
    let places = random.between(0, 31);
    random.word() >> places
}

/// One case of the following error.
#[derive(Debug, Clone, Copy)]
struct Case {
    limit_counts: u32,
    lag: GainWord,
    velocity_fraction_bits: u8,
    error: i32,
    velocity: i32,
}

impl Case {
    /// `a + w·V·2^−(f+16)`, in 2^−62 counts, with a speed in 2^−16 counts.
    fn limit(&self, speed: i128) -> i128 {
        let product = i128::from(self.lag.mantissa) * speed;
        (i128::from(self.limit_counts) << 62) + (product << (46 - self.lag.fraction_bits))
    }

    /// `V`: cut off to 2^−16 counts per sample, 32 bits at most.
    fn speed(&self) -> i128 {
        let speed = i128::from(self.velocity).abs() << 16 >> self.velocity_fraction_bits;
        speed.min((1 << 32) - 1)
    }

    fn exceeds(&self, limit: i128) -> bool {
        i128::from(self.error).abs() << 62 > limit
    }

    /// The trip of an axis in the sample of this case.
    fn check(&self) -> Option<Trip> {
        let (limit, bits) = (self.limit_counts, self.velocity_fraction_bits);
        let monitor = FollowingErrorMonitor::accept(limit, self.lag, bits).expect("in range");
        Guarded::new(false, |on| on.following_error = Some(monitor))
            .sample(self.error, self.velocity)
    }

    /// Any accepted words, and an error around the limit in most cases.
    fn random(random: &mut Random) -> Self {
        let mut case = Self {
            limit_counts: word(random).unsigned_abs().clamp(1, i32::MAX as u32),
            lag: GainWord::new(word(random).saturating_abs(), random.bits(0, 46)),
            velocity_fraction_bits: random.bits(0, 60),
            error: word(random),
            velocity: word(random),
        };
        if random.between(0, 3) > 0 {
            let beside = (case.limit(case.speed()) >> 62) + i128::from(random.between(-2, 2));
            let error = i32::try_from(beside).unwrap_or(i32::MIN);
            case.error = random.one_of(&[error, error.wrapping_neg()]);
        }
        case
    }
}

/// 3 million cases. The contrasts, which cut something else off, are wrong in
/// many of them, so the measure can tell.
#[test]
fn the_following_error_trips_exactly_beyond_its_limit() {
    let mut random = Random(1);
    let (mut trips, mut whole_velocity, mut nearest_count) = (0, 0, 0);
    for _ in 0..3_000_000 {
        let case = Case::random(&mut random);
        let limit = case.limit(case.speed());
        let exceeds = case.exceeds(limit);
        let measured = i64::from(case.error).abs();
        // The limit that is reported is the largest error allowed.
        let allowed = i64::try_from(limit >> 62).expect("at most 2^63");
        let expected = (FaultCause::FollowingError, measured, allowed);
        assert_eq!(case.check(), exceeds.then_some(expected), "{case:?}");

        trips += u32::from(exceeds);
        let whole = case.limit(case.speed() >> 16 << 16);
        whole_velocity += u32::from(case.exceeds(whole) != exceeds);
        let nearest = (limit + (1 << 61)) >> 62 << 62;
        nearest_count += u32::from(case.exceeds(nearest) != exceeds);
    }
    println!("{trips} trips, {whole_velocity} and {nearest_count} otherwise");
    assert!((1_000_000..2_000_000).contains(&trips), "{trips}");
    assert!(whole_velocity > 100_000, "{whole_velocity}");
    assert!(nearest_count > 30_000, "{nearest_count}");
}

#[test]
fn nothing_wraps_at_the_ends_of_the_ranges() {
    let corners = [1, i32::MAX as u32].map(|limit| {
        [(0, 0), (1, 0), (1, 46), (i32::MAX, 0), (i32::MAX, 46)].map(|word| (limit, word))
    });
    let mut cases = 0;
    for (limit_counts, (mantissa, bits)) in corners.into_iter().flatten() {
        for velocity_fraction_bits in [0, 15, 16, 17, 32, 60] {
            for error in [i32::MIN, i32::MIN + 1, -2, -1, 0, 1, 2, i32::MAX] {
                for velocity in [i32::MIN, -1, 0, 1, i32::MAX] {
                    let case = Case {
                        limit_counts,
                        lag: GainWord::new(mantissa, bits),
                        velocity_fraction_bits,
                        error,
                        velocity,
                    };
                    let exceeds = case.exceeds(case.limit(case.speed()));
                    assert_eq!(case.check().is_some(), exceeds, "{case:?}");
                    cases += 1;
                }
            }
        }
    }
    assert_eq!(cases, 10 * 6 * 8 * 5);
}

/// Without a monitor too.
#[test]
fn the_peak_is_kept_until_it_is_reset() {
    let mut axis = Guarded::new(false, |_| ());
    for (error, peak) in [(3, 3), (-7, 7), (5, 7), (i32::MIN, 1 << 31), (0, 1 << 31)] {
        axis.sample(error, 0);
        assert_eq!(axis.state.peak_error_counts(), peak);
    }
    axis.state.reset_peak_error();
    assert_eq!(axis.state.peak_error_counts(), 0);
    axis.sample(-2, 0);
    assert_eq!(axis.state.peak_error_counts(), 2);
}

/// Number of the last entries that are true without a gap. A trip forgets them.
fn run_at_the_end(seen: &mut Vec<bool>, limit: u32) -> (i64, bool) {
    let run = seen.iter().rev().take_while(|yes| **yes).count() as i64;
    let beyond = run >= i64::from(limit);
    if beyond {
        seen.clear();
    }
    (run, beyond)
}

proptest! {
    #[test]
    fn an_encoder_is_lost_with_the_last_of_its_samples(
        threshold in 1_u32..=4,
        ticks in 1_u32..=6,
        samples in prop::collection::vec((-5_i32..=5, 0_u8..8), 1..200),
    ) {
        let monitor = EncoderLossMonitor::accept(threshold, ticks).expect("in range");
        let mut axis = Guarded::new(true, |on| on.encoder_loss = Some(monitor));
        let (mut seen, mut code) = (Vec::new(), 0);
        for (next, kind) in samples {
            // A count in one of eight samples, so that long runs occur.
            let difference = if kind == 0 { i32::signum(code) } else { 0 };
            axis.register += difference;
            seen.push(code.unsigned_abs() >= threshold && difference == 0);
            let (measured, lost) = run_at_the_end(&mut seen, ticks);
            let expected = (FaultCause::EncoderLoss, measured, ticks.into());
            prop_assert_eq!(axis.sample(next, 0), lost.then_some(expected));
            code = if lost { 0 } else { next };
        }
    }

    #[test]
    fn a_saturation_is_too_long_one_sample_after_its_limit(
        ticks in 0_u32..=6,
        samples in prop::collection::vec((0_u8..8, any::<bool>()), 1..200),
    ) {
        let monitor = SaturationMonitor::accept(ticks).expect("in range");
        let mut axis = Guarded::new(true, |on| on.saturation = Some(monitor));
        let mut seen = Vec::new();
        for (kind, up) in samples {
            // At the last code of either side, or one before it.
            let last = if up { (1 << 23) - 1 } else { -1 << 23 };
            seen.push(kind > 0);
            let (measured, long) = run_at_the_end(&mut seen, ticks + 1);
            let expected = (FaultCause::SaturationTooLong, measured, ticks.into());
            let error = if kind > 0 { last } else { last - i32::signum(last) };
            prop_assert_eq!(axis.sample(error, 0), long.then_some(expected));
        }
    }

    /// Under power and without.
    #[test]
    fn a_tick_follows_its_predecessor(
        start in prop_oneof![any::<u64>(), Just(u64::MAX - 3)],
        steps in prop::collection::vec(prop_oneof![4 => Just(1_i64), 1 => -3_i64..100], 1..50),
        powered in any::<bool>(),
    ) {
        let mut axis = Guarded::new(false, |on| on.ticks = Some(TickMonitor));
        let mut tick = start;
        for (k, step) in core::iter::once(1).chain(steps).enumerate() {
            tick = tick.wrapping_add_signed(i64::from(k != 0) * step);
            if !powered {
                axis.state.request(Event::Disable).expect("no fault");
            }
            let mut source = Script::new(|_| Next::Setpoint(position(0)));
            axis.state.tick(&Inputs { tick, ..Inputs::default() }, &mut source);
            let expected = (FaultCause::MissedTick, step - 1, 0);
            let fault = axis.state.fault().is_some();
            let latched = axis.latched();
            prop_assert_eq!(latched, (step != 1).then_some(expected));
            if !fault && !powered {
                rig::start(&mut axis.state);
            }
        }
    }
}

#[test]
fn the_smallest_driving_code_counts_on_both_sides() {
    let loses = |threshold, code, moved| {
        let monitor = EncoderLossMonitor::accept(threshold, 1).expect("in range");
        let mut axis = Guarded::new(true, |on| on.encoder_loss = Some(monitor));
        assert_eq!(axis.sample(code, 0), None);
        axis.register = moved;
        axis.sample(0, 0).is_some()
    };
    for (code, lost) in [(299, false), (300, true), (-299, false), (-300, true)] {
        assert_eq!(loses(300, code, 0), lost);
        for difference in [-1, 1, i32::MIN] {
            assert!(!loses(300, code, difference));
        }
    }
    assert!(loses(EncoderLossMonitor::MAX_CODE_THRESHOLD, -1 << 23, 0));
}

#[test]
fn what_is_not_accepted_says_what_would_be() {
    let following = |limit, mantissa, bits| {
        let word = GainWord::new(mantissa, bits);
        FollowingErrorMonitor::accept(limit, word, 16).err()
    };
    let loss = |code, samples| EncoderLossMonitor::accept(code, samples).err();
    let saturation = |samples| SaturationMonitor::accept(samples).err();
    assert_eq!(following(1, 0, 0), None);
    assert_eq!(following(i32::MAX as u32, i32::MAX, 46), None);
    assert_eq!([loss(1, 1), loss(8_388_607, u32::MAX)], [None; 2]);
    assert_eq!([saturation(0), saturation(u32::MAX - 1)], [None; 2]);

    let (most, ticks) = (i64::from(i32::MAX), i64::from(u32::MAX));
    let fine = following(1, 5, 47).expect("too fine");
    let what = What::LagFractionBits(GainWord::new(5, 47));
    assert_eq!((fine.what, fine.value, fine.most), (what, 47, 46));
    let sentences = [
        (following(1, -5, 30), -5, [0, most]),
        (following(0, 5, 30), 0, [1, most]),
        (following(1 << 31, 5, 30), 1 << 31, [1, most]),
        (loss(0, 1), 0, [1, 8_388_607]),
        (loss(8_388_608, 1), 8_388_608, [1, 8_388_607]),
        (loss(1, 0), 0, [1, ticks]),
        (saturation(u32::MAX), ticks, [0, ticks - 1]),
    ];
    let sentences = sentences.map(|(error, value, allowed)| {
        let error = error.expect("no use");
        assert_eq!((error.value, [error.least, error.most]), (value, allowed));
        error.to_string()
    });
    let expected = [
        "the following error's share per speed -5·2^-30 is negative; it must be at least 0",
        "a following error limit of 0 counts is of no use; it must lie between 1 and 2147483647",
        "a following error limit of 2147483648 counts is of no use; \
         it must lie between 1 and 2147483647",
        "a code threshold of 0 cannot tell a lost encoder; it must lie between 1 and 8388607",
        "a code threshold of 8388608 cannot tell a lost encoder; \
         it must lie between 1 and 8388607",
        "an encoder cannot be lost after 0 samples; it must be at least 1 sample",
        "4294967295 samples at a limit are never passed; the number must be below 4294967295",
    ];
    assert_eq!(sentences, expected);
}
