//! Two symmetries that no word length may break: the sum is exactly odd as long
//! as the output is at no limit, and a shift of the wheel of 2^32 counts changes
//! nothing.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::inputs::Samples;
use exact::model::{CODE, Model};
use exact::words::accepted;
use exact::{Random, sample};
use firmware::law::{AntiWindup, Begin, Derivative, Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Controller, ControllerState, Dac, GainWord, SetpointTable};

/// The input with the other signs; the one integer and the one rate that have
/// no opposite are held first.
fn pair(input: LawInput) -> [LawInput; 2] {
    [1, -1].map(|sign| {
        let mirrored = |x: i32, most: i32| sign * x.clamp(-most, most);
        LawInput {
            error: mirrored(input.error, i32::MAX),
            difference: mirrored(input.difference, i32::MAX),
            velocity: mirrored(input.velocity, (1 << 24) - 1),
            acceleration: mirrored(input.acceleration, (1 << 24) - 1),
            ..input
        }
    })
}

#[test]
fn the_sum_is_exactly_odd_with_every_option() {
    let mut random = Random(71);
    let [mut steps, mut limited, mut derivatives, mut treatments] = [0, 0, 0, 0];
    for round in 0..2_500_u64 {
        let law = accepted(&mut random);
        let words = law.words();
        derivatives |= match (words.derivative, words.filter.is_some()) {
            (Derivative::Error, false) => 1,
            (Derivative::Error, true) => 2,
            (Derivative::Measurement, false) => 4,
            (Derivative::Measurement, true) => 8,
        };
        treatments |= match words.anti_windup {
            AntiWindup::None => 1,
            AntiWindup::Clamp => 2,
            AntiWindup::BackCalculation { .. } => 4,
        };
        let output = Output::unlimited(law.dac(), Quantiser::Nearest);
        let mut model = Model::new(*words, law.dac().bits(), None, Quantiser::Nearest);
        let mut samples = Samples::of_round(round);
        let mut states = [LawState::start(&output); 2];
        let mut begin = Some(Begin::AtRest);
        for _ in 0..600 {
            let inputs = pair(samples.next(&model));
            let [plus, minus] =
                [0, 1].map(|k| sample(&law, &output, &mut states[k], &inputs[k], begin));
            assert_eq!(plus.sum, -minus.sum, "{words:?}");
            model.step(&inputs[0], begin);
            let at_limit = [plus, minus]
                .iter()
                .any(|given| given.code != (given.sum + CODE / 2).div_euclid(CODE));
            begin = None;
            if at_limit && words.anti_windup != AntiWindup::None {
                // −2^(n−1) has no opposite code: wind-up is treated otherwise.
                begin = Some(Begin::AtRest);
            } else {
                assert_eq!(states[0].integral(), -states[1].integral(), "{words:?}");
            }
            limited += u32::from(at_limit);
            steps += 1;
        }
    }
    println!("{steps} pairs of samples, {limited} at a limit");
    assert_eq!([derivatives, treatments], [15, 7], "every option was met");
    assert!(steps - limited > 400_000 && limited > 400_000);
}

/// `Ki·Δt` = 2^−10 alone, at the given converter.
fn integral_alone(anti_windup: AntiWindup, dac_bits: u32) -> (Law, Output) {
    let words = LawWords {
        ki_dt: GainWord::new(1 << 20, 30),
        anti_windup,
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(dac_bits).expect("2 to 24 bits");
    let law = Law::accept(words, dac).expect("accepted");
    (law, Output::unlimited(dac, Quantiser::Nearest))
}

/// The integral after these errors \[codes\].
fn integral((law, output): &(Law, Output), errors: impl Iterator<Item = i32>) -> f64 {
    let mut state = LawState::start(output);
    for error in errors {
        let input = LawInput {
            error,
            ..LawInput::default()
        };
        sample(law, output, &mut state, &input, None);
    }
    state.integral().to_num()
}

#[test]
fn contrast_a_truncating_shift_is_not_odd_and_creeps() {
    // The same law with a product shifted to whole codes: floor(Ki·Δt·e).
    let truncating = |error: i64| (error * (1 << 20)) >> 30;
    assert_ne!(truncating(-511), -truncating(511));
    let creep: i64 = (0..1_000).map(|_| truncating(511) + truncating(-511)).sum();
    assert_eq!(creep, -1_000);
    let errors = (0..2_000).map(|k| if k % 2 == 0 { 511 } else { -511 });
    assert_eq!(integral(&integral_alone(AntiWindup::None, 12), errors), 0.0);
}

#[test]
fn contrast_the_whole_range_has_a_code_more_below() {
    // 2 bits: codes −2 to 1. Beyond 1 the clamp refuses, and the mirror image
    // goes on to −2: asymmetry of the converter, not of the law.
    let law = integral_alone(AntiWindup::Clamp, 2);
    let [up, down] = [1024, -1024].map(|error| integral(&law, [error; 5].into_iter()));
    assert_eq!([up, down], [1.0, -2.0]);
}

#[test]
fn the_integral_goes_on_exactly_beyond_its_declared_range_and_says_so() {
    // S = 2^29 counts are 2^12 of the largest errors, 128 codes each.
    let (law, output) = integral_alone(AntiWindup::None, 12);
    let mut state = LawState::start(&output);
    for k in 1..=(1 << 12) + 3 {
        let input = LawInput {
            error: -1 << 17,
            ..LawInput::default()
        };
        let given = sample(&law, &output, &mut state, &input, None);
        assert_eq!(given.told, k > 1 << 12, "sample {k}");
    }
    assert_eq!(state.integral(), -((1 << 19) + 3 * 128));
    // And back: the way out and the way in end at zero exactly.
    let errors = [-1 << 17; (1 << 12) + 3].into_iter();
    let there_and_back = errors.clone().chain(errors.map(|e: i32| -e));
    assert_eq!(integral(&(law, output), there_and_back), 0.0);
}

#[test]
fn shifting_setpoints_and_counts_alike_changes_nothing() {
    let mut random = Random(72);
    for _ in 0..300 {
        let law = accepted(&mut random);
        let samples = [[(); 64]; 2].map(|row| row.map(|()| random.word()));
        let shift = random.word();
        let run = |shift: i32| {
            let setpoints = samples[0].map(|r| r.wrapping_add(shift));
            let table = SetpointTable::<64>::from_counts(&setpoints).expect("there is room");
            let controller = Controller::new(law, table);
            let mut state = ControllerState::start(&controller);
            // Some samples more than setpoints: the last one is held.
            let counts = samples[1].into_iter().chain([0; 9]);
            let ticks = counts.map(|c| controller.tick(&mut state, c.wrapping_add(shift)));
            ticks.collect::<Vec<_>>()
        };
        assert_eq!(run(0), run(shift));
    }
}
