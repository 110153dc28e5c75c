//! The axis' law mirrored: the opposite errors, differences and rates give
//! exactly the opposite sums, with every option.
//!
//! Wind-up is treated against the window of the converter, and −2^(n−1) has no
//! opposite code; so each sample is given a window that a slew limit cuts out
//! around some code, and its mirror image. That is also where the asymmetry of
//! the whole range is shown.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::axis_inputs::{Drive, Samples};
use exact::axis_law::Model;
use exact::axis_words::accepted;
use firmware::law::{AntiWindup, Derivative, Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser, Window};
use firmware::{Dac, GainWord};

fn mirrored(input: &LawInput) -> LawInput {
    LawInput {
        error: -input.error,
        difference: -input.difference,
        velocity: -input.velocity,
        acceleration: -input.acceleration,
        ..*input
    }
}

/// The window around `code` of a converter with a slew limit.
fn window_around(code: i32, slew: i32, dac: Dac) -> Window {
    let slew = Some(slew.unsigned_abs());
    let output = Output::new(dac, slew, Quantiser::Nearest).expect("1 to 2^24 codes");
    let mut state = output.start();
    output.code(&mut state, i64::from(code) << 33, 33, Window::of(dac));
    assert_eq!(state.code(), code);
    output.window(&state)
}

#[test]
fn the_sum_is_exactly_odd_with_every_option() {
    let mut random = Random(71);
    let [mut steps, mut beyond, mut derivatives, mut treatments] = [0, 0, 0, 0];
    for seed in 0..2_500_u64 {
        let (law, dac) = accepted(&mut random);
        if dac.max_code() < 7 {
            continue;
        }
        derivatives |= match (law.words().derivative, law.words().filter.is_some()) {
            (Derivative::Error, false) => 1,
            (Derivative::Error, true) => 2,
            (Derivative::Measurement, false) => 4,
            (Derivative::Measurement, true) => 8,
        };
        treatments |= match law.words().anti_windup {
            AntiWindup::None => 1,
            AntiWindup::Clamp => 2,
            AntiWindup::BackCalculation { .. } => 4,
        };
        let quarter = i64::from(dac.max_code() / 4);
        let model = Model::new(*law.words(), dac, None, Quantiser::Nearest);
        let drive = Drive::ALL[usize::try_from(seed % 5).expect("below 5")];
        let mut samples = Samples::new(drive, seed / 5);
        let (mut up, mut down) = (LawState::default(), LawState::default());
        for _ in 0..600 {
            let small = |x: i64| i32::try_from(x).expect("24 bits");
            let code = small(random.between(-quarter, quarter));
            let slew = small(random.between(1, quarter));
            let mut input = samples.next(&model);
            // The one integer that has no opposite.
            input.error = input.error.max(-i32::MAX);
            input.difference = input.difference.max(-i32::MAX);
            if random.one_in(200) {
                (up, down) = (LawState::take_over(code), LawState::take_over(-code));
            }
            let here = window_around(code, slew, dac);
            let plus = law.step(&mut up, &input, here);
            let minus = law.step(
                &mut down,
                &mirrored(&input),
                window_around(-code, slew, dac),
            );
            assert_eq!(plus.sum, -minus.sum, "{:?}", law.words());
            assert_eq!(up.integral(), -down.integral(), "{:?}", law.words());
            assert_eq!(
                [
                    plus.error_limited,
                    plus.difference_limited,
                    plus.integral_limited
                ],
                [
                    minus.error_limited,
                    minus.difference_limited,
                    minus.integral_limited
                ]
            );
            beyond += u32::from(here.excess(plus.sum, law.words().sum_fraction_bits) != 0);
            steps += 1;
        }
    }
    println!("{steps} pairs of samples, {beyond} beyond their window");
    assert_eq!([derivatives, treatments], [15, 7], "every option was met");
    assert!(steps > 1_000_000 && beyond > steps / 10);
}

#[test]
fn contrast_the_whole_range_has_a_code_more_below() {
    // Ki·Δt = 1, 2 bits: codes −2 to 1. Beyond 1 the clamp refuses, and the
    // mirror image goes on to −2: asymmetry of the converter, not of the law.
    let words = LawWords {
        ki_dt: GainWord::new(1 << 30, 38),
        anti_windup: AntiWindup::Clamp,
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(2).expect("2 bits");
    let law = Law::accept(words, dac).expect("accepted");
    let [up, down] = [1, -1].map(|sign| {
        let mut state = LawState::default();
        let input = LawInput {
            error: sign * (1 << 8),
            ..LawInput::default()
        };
        (0..3).for_each(|_| _ = law.step(&mut state, &input, Window::of(dac)));
        state.integral()
    });
    assert_eq!([up, down], [1 << 38, -2 << 38]);
}
