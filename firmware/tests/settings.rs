//! Settings as flat words: the same axis as the one that they were made of, and
//! nothing that was not checked.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod any;
mod rig;

use any::{Sample, axes, samples};
use firmware::{AxisState, Inputs, Settings};
use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use rig::Script;

/// Words with another one at a place.
fn with(settings: &Settings, place: usize, word: u32) -> Settings {
    let mut words = settings.to_words();
    words[place] = word;
    Settings::from_words(words)
}

/// The name of the word that is refused, by either way in.
fn refused(settings: &Settings, running: &AxisState) -> Option<&'static str> {
    let unfit = settings.check().err();
    assert_eq!(AxisState::start_with(settings).err(), unfit);
    let mut changed = *running;
    assert_eq!(changed.change_to(settings).err(), unfit);
    assert!(
        unfit.is_none() || changed == *running,
        "changed all the same"
    );
    unfit.map(|unfit| unfit.name())
}

/// `T + R` \[2^−32 codes\], by the ranges and gains of the words.
fn sum(s: &Settings) -> i128 {
    let unit = i128::from(s.filter_smoothing != 0);
    let term =
        |mantissa: u32, scale: u32, most: i128| i128::from(mantissa) * i128::from(scale) * most;
    let [error, difference, filter] = [
        s.error_limit_counts,
        s.difference_limit_counts,
        s.filter_scale,
    ]
    .map(i128::from);
    term(s.kp_mantissa, s.kp_scale, error)
        + term(s.ki_dt_mantissa, s.ki_dt_scale, error)
        + term(
            s.kd_per_dt_mantissa,
            s.kd_per_dt_scale,
            difference * filter + unit,
        )
        + term(s.velocity_ff_mantissa, s.velocity_ff_scale, 1 << 24)
        + term(s.acceleration_ff_mantissa, s.acceleration_ff_scale, 1 << 24)
        + term(s.friction_ff_mantissa, s.friction_ff_scale, 1)
        + (1 << (s.dac_bits + 31))
}

/// The same settings with a friction that leaves less than its last bit to the
/// largest sum.
fn filled(settings: &Settings) -> Settings {
    let mut s = Settings {
        friction_ff_mantissa: 0,
        ahead_limit_codes: 0,
        ..*settings
    };
    if sum(&s) <= 1 << 61 {
        // The largest term of one gain.
        s.kp_mantissa = i32::MAX.unsigned_abs();
        s.kp_scale = 1 << (30 - s.error_limit_counts.ilog2());
    }
    let room = (1 << 62) - sum(&s);
    let bits = room.checked_ilog2().unwrap_or(0).saturating_sub(30);
    s.friction_ff_mantissa = u32::try_from(room >> bits).expect("31 bits");
    s.friction_ff_scale = 1 << bits;
    s
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn they_make_the_axis_that_they_were_made_of(axis in axes()) {
        let settings = Settings::of(&axis);
        let started = AxisState::start(&axis);
        prop_assert_eq!(AxisState::start_with(&settings), Ok(started));
        prop_assert_eq!(Settings::from_words(settings.to_words()), settings);
        prop_assert_eq!(refused(&settings, &started), None);
        let mut changed = [started, started];
        changed[0].change(&axis);
        prop_assert_eq!(changed[1].change_to(&settings), Ok(()));
        prop_assert_eq!(changed[0], changed[1]);
    }

    #[test]
    fn a_word_out_of_its_range_is_refused_by_its_name(axis in axes()) {
        let (settings, running) = (Settings::of(&axis), AxisState::start(&axis));
        for (place, [least, most]) in Settings::RANGES.into_iter().enumerate() {
            let name = Settings::NAMES[place];
            let below = least.checked_sub(1).into_iter().chain((least > 0).then_some(0));
            let above = most.checked_add(1).into_iter().flat_map(|word| [word, u32::MAX]);
            for word in below.chain(above) {
                let unfit = refused(&with(&settings, place, word), &running);
                prop_assert_eq!(unfit, Some(name), "{}", word);
            }
        }
    }

    #[test]
    fn a_sum_beyond_its_largest_is_refused(axis in axes()) {
        let (settings, running) = (Settings::of(&axis), AxisState::start(&axis));
        prop_assert!(sum(&settings) <= 1 << 62);
        let full = filled(&settings);
        let one_bit = i128::from(full.friction_ff_scale);
        prop_assert!(((1 << 62) - one_bit + 1..=1 << 62).contains(&sum(&full)));
        // Contrast: the last that is accepted.
        prop_assert_eq!(refused(&full, &running), None);
        let beyond = Settings { friction_ff_mantissa: full.friction_ff_mantissa + 1, ..full };
        prop_assert!(sum(&beyond) > 1 << 62);
        prop_assert_eq!(refused(&beyond, &running), Some("friction_ff_mantissa"));
    }
}

/// A word of a range: anywhere, of any length, or at an end.
fn word([least, most]: [u32; 2]) -> impl Strategy<Value = u32> {
    let small = (least..=most, 0..32_u32).prop_map(move |(word, by)| (word >> by).max(least));
    prop_oneof![2 => least..=most, 4 => small, 1 => Just(least), 1 => Just(most)]
}

/// Any words: none of them in its range on purpose, all of them, or those of an
/// axis but for some.
fn anything() -> impl Strategy<Value = Settings> {
    let words = prop::collection::vec(any::<u32>(), Settings::WORDS);
    let places = Settings::RANGES.map(word).into_iter().collect::<Vec<_>>();
    let within = (places, 0..=8_u32, axes()).prop_perturb(|(words, others, axis), mut random| {
        let mut settings = Settings::of(&axis);
        for (place, word) in words.into_iter().enumerate() {
            if random.random_range(0..8) < others {
                settings = with(&settings, place, word);
            }
        }
        settings
    });
    let any = words.prop_map(|words| Settings::from_words(words.try_into().expect("all words")));
    prop_oneof![1 => any, 7 => within]
}

/// Runs settings that are accepted; whether they are.
fn survives(
    settings: &Settings,
    other: &Settings,
    samples: &[Sample],
) -> Result<bool, TestCaseError> {
    let Ok(mut state) = AxisState::start_with(settings) else {
        return Ok(false);
    };
    let (mut tick, mut bits) = (0_u64, settings.dac_bits);
    for sample in samples {
        if let Some(event) = sample.request {
            let _ = state.request(event);
        }
        if sample.gains_changed && state.change_to(other).is_ok() {
            bits = other.dac_bits;
        }
        tick = tick.wrapping_add(sample.inputs.tick);
        let inputs = Inputs {
            tick,
            ..sample.inputs
        };
        let output = state.tick(&inputs, &mut Script::new(|_| sample.next));
        let most = 1 << (bits - 1);
        prop_assert!((-most..most).contains(&output.code), "{}", output.code);
        prop_assert!(output.power || output.code == 0);
    }
    Ok(true)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_200))]

    #[test]
    fn any_words_are_refused_or_run(
        settings in anything(),
        other in anything(),
        samples in prop::collection::vec(samples(), 200),
    ) {
        survives(&settings, &other, &samples)?;
    }
}

/// Words that were never accepted would show nothing, nor would those that always are.
#[test]
fn the_random_words_are_of_both_kinds() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut accepted = 0;
    for _ in 0..1_000 {
        let settings = anything().new_tree(&mut runner).expect("words").current();
        accepted += i32::from(settings.check().is_ok());
    }
    println!("of 1000 words: {accepted} accepted");
    assert!((100..900).contains(&accepted), "{accepted}");
}
