//! The monitors against plain models: the following error against the demand
//! itself in 128 bits, the others against a list of what they have seen.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use firmware::faults::{FaultCause, Trip};
use firmware::monitor::{
    EncoderLossMonitor, EncoderLossState, FollowingErrorMonitor, FollowingErrorState,
    SaturationMonitor, SaturationState, TickMonitor, TickState,
};
use firmware::refusal::What;
use firmware::{GainWord, Refusal};
use proptest::prelude::*;

/// A number of any magnitude, all lengths alike.
fn word(random: &mut Random) -> i32 {
    let places = random.between(0, 31);
    (random.next() as i32) >> places
}

/// One case of the following error.
#[derive(Debug, Clone, Copy)]
struct Case {
    limit_counts: u32,
    mantissa: i32,
    fraction_bits: u8,
    velocity_fraction_bits: u8,
    error: i32,
    velocity: i32,
}

impl Case {
    fn places(&self) -> u8 {
        self.fraction_bits + self.velocity_fraction_bits
    }

    /// `w·|v|`.
    fn product(&self) -> i128 {
        i128::from(self.mantissa) * i128::from(self.velocity).abs()
    }

    /// `|e|·2^F > a·2^F + w·|v|`
    fn exceeds(&self) -> bool {
        let one = 1_i128 << self.places();
        let (e, a) = (i128::from(self.error).abs(), i128::from(self.limit_counts));
        e * one > a * one + self.product()
    }

    /// Contrast: the velocity cut off to whole counts per sample.
    fn exceeds_with_whole_velocity(&self) -> bool {
        let (e, a) = (i128::from(self.error).abs(), i128::from(self.limit_counts));
        let v = i128::from(self.velocity).abs() >> self.velocity_fraction_bits;
        let one = 1_i128 << self.fraction_bits;
        e * one > a * one + i128::from(self.mantissa) * v
    }

    /// Contrast: the product rounded to the nearest count.
    fn exceeds_with_nearest_count(&self) -> bool {
        let (e, a) = (i128::from(self.error).abs(), i128::from(self.limit_counts));
        let half = (1_i128 << self.places()) >> 1;
        e > a + ((self.product() + half) >> self.places())
    }

    fn check(&self) -> Option<Trip> {
        let word = GainWord::new(self.mantissa, self.fraction_bits);
        let monitor =
            FollowingErrorMonitor::accept(self.limit_counts, word, self.velocity_fraction_bits)
                .expect("in range");
        monitor.check(
            &mut FollowingErrorState::default(),
            self.error,
            self.velocity,
        )
    }

    /// Any accepted words, and an error around the limit in most cases.
    fn random(random: &mut Random) -> Self {
        let places = random.between(0, 62);
        let fraction_bits = random.between(0, places);
        let mut case = Self {
            limit_counts: word(random).unsigned_abs().clamp(1, i32::MAX as u32),
            mantissa: word(random).saturating_abs(),
            fraction_bits: fraction_bits as u8,
            velocity_fraction_bits: (places - fraction_bits) as u8,
            error: word(random),
            velocity: word(random),
        };
        if random.between(0, 3) > 0 {
            let limit = i128::from(case.limit_counts) + (case.product() >> places);
            let beside = limit + i128::from(random.between(-2, 2));
            let error = i32::try_from(beside).unwrap_or(i32::MIN);
            let opposite = random.between(0, 1) == 0;
            case.error = if opposite {
                error.wrapping_neg()
            } else {
                error
            };
        }
        case
    }
}

/// 3 million cases. The contrasts, which cut something off, are wrong in many
/// of them, so the measure can tell.
#[test]
fn the_following_error_trips_exactly_beyond_its_limit() {
    let mut random = Random(1);
    let (mut trips, mut whole_velocity, mut nearest_count) = (0, 0, 0);
    for _ in 0..3_000_000 {
        let case = Case::random(&mut random);
        let trip = case.check();
        assert_eq!(trip.is_some(), case.exceeds(), "{case:?}");
        if let Some(trip) = trip {
            // The limit that is reported is the largest error allowed.
            let allowed = i128::from(case.limit_counts) + (case.product() >> case.places());
            assert_eq!(trip.cause, FaultCause::FollowingError);
            assert_eq!(i128::from(trip.limit), allowed);
            assert_eq!(trip.measured, i64::from(case.error).abs());
        }
        trips += u32::from(trip.is_some());
        whole_velocity += u32::from(case.exceeds_with_whole_velocity() != case.exceeds());
        nearest_count += u32::from(case.exceeds_with_nearest_count() != case.exceeds());
    }
    assert!((1_000_000..2_000_000).contains(&trips), "{trips}");
    assert!(whole_velocity > 100_000, "{whole_velocity}");
    assert!(nearest_count > 30_000, "{nearest_count}");
}

#[test]
fn nothing_wraps_at_the_ends_of_the_ranges() {
    for limit_counts in [1, i32::MAX as u32] {
        for mantissa in [0, 1, i32::MAX] {
            for places in [0, 1, 31, 32, 61, 62] {
                for error in [i32::MIN, i32::MIN + 1, -2, -1, 0, 1, 2, i32::MAX] {
                    for velocity in [i32::MIN, -1, 0, 1, i32::MAX] {
                        let case = Case {
                            limit_counts,
                            mantissa,
                            fraction_bits: places,
                            velocity_fraction_bits: 0,
                            error,
                            velocity,
                        };
                        assert_eq!(case.check().is_some(), case.exceeds(), "{case:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_peak_is_kept_until_it_is_reset() {
    let monitor = FollowingErrorMonitor::accept(50, GainWord::new(0, 0), 0).expect("in range");
    let mut state = FollowingErrorState::default();
    for (error, peak) in [(3, 3), (-7, 7), (5, 7), (i32::MIN, 1 << 31), (0, 1 << 31)] {
        monitor.check(&mut state, error, 0);
        assert_eq!(state.peak(), peak);
    }
    state.reset_peak();
    assert_eq!(state.peak(), 0);
    monitor.check(&mut state, -2, 0);
    assert_eq!(state.peak(), 2);
}

/// Number of the last entries that are true without a gap.
fn run_at_the_end(seen: &[bool]) -> i64 {
    seen.iter().rev().take_while(|yes| **yes).count() as i64
}

proptest! {
    #[test]
    fn an_encoder_is_lost_with_the_last_of_its_samples(
        threshold in 1_u32..=4,
        ticks in 1_u32..=6,
        samples in prop::collection::vec((-5_i32..=5, 0_u8..8), 1..200),
    ) {
        let monitor = EncoderLossMonitor::accept(threshold, ticks).expect("in range");
        let mut state = EncoderLossState::default();
        let mut seen = Vec::new();
        for (code, kind) in samples {
            // A count in one of eight samples, so that long runs occur.
            let difference = if kind == 0 { code.signum() } else { 0 };
            seen.push(code.abs() >= threshold as i32 && difference == 0);
            let measured = run_at_the_end(&seen);
            let trip = Trip { cause: FaultCause::EncoderLoss, measured, limit: ticks.into() };
            let expected = (measured >= i64::from(ticks)).then_some(trip);
            prop_assert_eq!(monitor.check(&mut state, code, difference), expected);
        }
    }

    #[test]
    fn a_saturation_is_too_long_one_sample_after_its_limit(
        ticks in 0_u32..=6,
        samples in prop::collection::vec(0_u8..8, 1..200),
    ) {
        let monitor = SaturationMonitor::accept(ticks).expect("in range");
        let mut state = SaturationState::default();
        let mut seen = Vec::new();
        for kind in samples {
            seen.push(kind > 0);
            let measured = run_at_the_end(&seen);
            let trip = Trip { cause: FaultCause::SaturationTooLong, measured, limit: ticks.into() };
            let expected = (measured > i64::from(ticks)).then_some(trip);
            prop_assert_eq!(monitor.check(&mut state, kind > 0), expected);
        }
    }

    #[test]
    fn a_tick_follows_its_predecessor(
        start in prop_oneof![any::<u64>(), Just(u64::MAX - 3)],
        steps in prop::collection::vec(prop_oneof![4 => Just(1_i64), 1 => -3_i64..100], 1..50),
    ) {
        let mut state = TickState::default();
        let mut tick = start;
        prop_assert_eq!(TickMonitor.check(&mut state, tick), None);
        for step in steps {
            tick = tick.wrapping_add_signed(step);
            let trip = Trip { cause: FaultCause::MissedTick, measured: step - 1, limit: 0 };
            let expected = (step != 1).then_some(trip);
            prop_assert_eq!(TickMonitor.check(&mut state, tick), expected);
        }
    }
}

#[test]
fn the_smallest_driving_code_counts_on_both_sides() {
    let monitor = EncoderLossMonitor::accept(300, 1).expect("in range");
    for (code, lost) in [(299, false), (300, true), (-299, false), (-300, true)] {
        let mut state = EncoderLossState::default();
        assert_eq!(monitor.check(&mut state, code, 0).is_some(), lost);
        for difference in [-1, 1, i32::MIN] {
            assert_eq!(monitor.check(&mut state, code, difference), None);
        }
    }
    assert!(
        monitor
            .check(&mut EncoderLossState::default(), i32::MIN, 0)
            .is_some()
    );
}

#[test]
fn what_is_not_accepted_says_what_would_be() {
    let lag = GainWord::new(5, 30);
    let following = |limit, word, bits| {
        let refused = FollowingErrorMonitor::accept(limit, word, bits).err();
        refused.map(|error| (error, error.to_string()))
    };
    assert_eq!(following(1, lag, 32), None);
    assert_eq!(
        following(i32::MAX as u32, GainWord::new(i32::MAX, 62), 0),
        None
    );
    for limit_counts in [0, 1 << 31, u32::MAX] {
        let (error, text) = following(limit_counts, lag, 16).expect("no use");
        let allowed = [1, i32::MAX.into()];
        assert_eq!(
            error,
            refusal(What::FollowingError, limit_counts.into(), allowed)
        );
        assert_eq!(
            text,
            format!(
                "a following error limit of {limit_counts} counts is of no use; \
                 it must lie between 1 and 2147483647"
            )
        );
    }
    let (error, text) = following(1, GainWord::new(-5, 30), 16).expect("negative");
    let what = What::Lag(GainWord::new(-5, 30));
    assert_eq!(error, refusal(what, -5, [0, i32::MAX.into()]));
    assert_eq!(
        text,
        "the following error's share per speed -5·2^-30 is negative; it must be at least 0"
    );
    for (word, velocity_fraction_bits) in [(lag, 33), (GainWord::new(1, 255), 255)] {
        let (error, text) = following(1, word, velocity_fraction_bits).expect("too fine");
        let left = 62_u8.saturating_sub(word.fraction_bits);
        let what = What::LagFractionBits(word);
        let allowed = [0, left.into()];
        assert_eq!(error, refusal(what, velocity_fraction_bits.into(), allowed));
        assert!(
            text.ends_with("have more than 62 of them together"),
            "{text}"
        );
    }

    for (code_threshold, fits) in [(0, false), (1, true), (8_388_607, true), (8_388_608, false)] {
        let refused = EncoderLossMonitor::accept(code_threshold, 1).err();
        let error = refusal(What::EncoderLossCode, code_threshold.into(), [1, 8_388_607]);
        assert_eq!(refused, (!fits).then_some(error));
        assert_eq!(
            error.to_string(),
            format!(
                "a code threshold of {code_threshold} cannot tell a lost encoder; \
                 it must lie between 1 and 8388607"
            )
        );
    }
    let error = EncoderLossMonitor::accept(1, 0).expect_err("at once");
    let most = u32::MAX.into();
    assert_eq!(error, refusal(What::EncoderLossSamples, 0, [1, most]));
    assert_eq!(
        error.to_string(),
        "an encoder cannot be lost after 0 samples; it must be at least 1 sample"
    );

    assert!(SaturationMonitor::accept(u32::MAX - 1).is_ok());
    let error = SaturationMonitor::accept(u32::MAX).expect_err("never");
    let ticks = u32::MAX.into();
    assert_eq!(
        error,
        refusal(What::SaturationSamples, ticks, [0, ticks - 1])
    );
    assert_eq!(
        error.to_string(),
        "4294967295 samples at a limit are never passed; the number must be below 4294967295"
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
