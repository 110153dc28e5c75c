//! Bumpless transfer: after `LawState::take_over` the first code is the one that the
//! converter already has.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::axis_inputs::{Drive, Samples};
use exact::axis_law::{Model, two};
use exact::axis_words::{accepted, random_output};
use firmware::law::{Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Dac, GainWord};

#[test]
fn the_first_code_is_the_last_one_whatever_comes() {
    let mut random = Random(81);
    let [mut steps, mut out_of_range, mut jumps] = [0_u32; 3];
    for seed in 0..6_000_u64 {
        let (law, dac) = accepted(&mut random);
        if law.words().ki_dt.mantissa == 0 {
            continue;
        }
        let f = law.words().sum_fraction_bits;
        let (output, slew, quantiser) = random_output(&mut random, dac);
        let model = Model::new(*law.words(), dac, slew, quantiser);
        let drive = Drive::ALL[usize::try_from(seed % 5).expect("below 5")];
        let mut samples = Samples::new(drive, seed / 5);
        for _ in 0..100 {
            let input = samples.next(&model);
            // The converter stands at some code that it could reach.
            let mut codes = output.start();
            let wish = random.between(i64::from(dac.min_code()), i64::from(dac.max_code()));
            let window = output.window(&codes);
            let last = output.code(&mut codes, wish << f, f, window);
            // Nothing of the old sum's rounding is left.
            let window = output.window(&codes);

            let mut state = LawState::take_over(last);
            let first = law.step(&mut state, &input, window);
            let code = output.code(&mut codes.clone(), first.sum, f, window);
            if first.integral_limited {
                // The other terms alone are more than Q from the code.
                assert_eq!(i128::from(state.integral()).abs(), model.ranges.integral);
                out_of_range += 1;
            } else {
                assert_eq!(first.sum, i64::from(last) << f);
                assert_eq!(code, last, "{:?}", law.words());
            }

            // Contrast: the same sample without it.
            let jump = law.step(&mut LawState::default(), &input, window);
            let code = output.code(&mut codes.clone(), jump.sum, f, window);
            jumps += u32::from(code != last);
            steps += 1;
        }
    }
    println!("{steps} first samples, {out_of_range} beyond Q; {jumps} jump without");
    assert!(steps - out_of_range > 100_000);
    assert!(jumps > steps / 2);
}

#[test]
fn an_integral_of_q_reaches_every_code_that_q_allows() {
    // Kp·e = 2^20 codes = Q: code 0 is just reached, code −1 is not.
    let words = LawWords {
        kp: GainWord::new(1 << 30, 27),
        ki_dt: GainWord::new(1, 38),
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(14).expect("14 bits");
    let law = Law::accept(words, dac).expect("accepted");
    let input = LawInput {
        error: 1 << 17,
        ..LawInput::default()
    };
    let window = firmware::output::Window::of(dac);
    let first = |code| law.step(&mut LawState::take_over(code), &input, window);
    assert_eq!((first(0).sum, first(0).integral_limited), (0, false));
    assert_eq!((first(-1).sum, first(-1).integral_limited), (0, true));
}

#[test]
fn without_an_integral_gain_the_integral_stays_at_zero() {
    let words = LawWords {
        kp: GainWord::new(1 << 30, 30),
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(14).expect("14 bits");
    let law = Law::accept(words, dac).expect("accepted");
    let mut state = LawState::take_over(5_000);
    let input = LawInput {
        error: 3,
        ..LawInput::default()
    };
    let first = law.step(&mut state, &input, firmware::output::Window::of(dac));
    assert_eq!((first.sum, state.integral()), (3 << 38, 0));
}

/// An axis whose speed is the code, driven by one law and then by another.
fn largest_step(goes_on: bool) -> i32 {
    let dac = Dac::with_bits(14).expect("14 bits");
    let output = Output::new(dac, None, Quantiser::ErrorFeedback).expect("no limit");
    let law = |kp, kd_per_dt| {
        let words = LawWords {
            kp: GainWord::new(kp, 30),
            ki_dt: GainWord::new(1 << 24, 38),
            kd_per_dt: GainWord::new(kd_per_dt, 30),
            ..LawWords::NONE
        };
        Law::accept(words, dac).expect("accepted")
    };
    let (soft, stiff) = (law(1 << 28, 1 << 30), law(1 << 30, 1 << 29));
    let (mut state, mut codes) = (LawState::default(), output.start());
    let (mut position, mut largest) = (0_i32, 0);
    for k in 0..4_000 {
        let law = if k < 2_000 { soft } else { stiff };
        if k == 2_000 && goes_on {
            state = LawState::take_over(codes.code());
        }
        // A ramp of 8 counts a sample; 32 codes are a count a sample.
        let input = LawInput {
            error: 8 * k - (position >> 5),
            ..LawInput::default()
        };
        let (before, window) = (codes.code(), output.window(&codes));
        let sum = law.step(&mut state, &input, window).sum;
        let code = output.code(&mut codes, sum, 38, window);
        if k >= 2_000 {
            largest = largest.max((code - before).abs());
        }
        position += code;
    }
    largest
}

#[test]
fn other_gains_in_motion_give_no_kick() {
    let (with, without) = (largest_step(true), largest_step(false));
    println!("largest step of the code: {with}, without taking over {without}");
    assert!(with <= 2, "{with}");
    assert!(without > 10 * with, "{without}");
}

#[test]
fn the_contrast_is_a_jump_of_the_whole_difference() {
    // 2^F codes are one code: what the default state leaves out is the code.
    let unit = two(38);
    let words = LawWords {
        kp: GainWord::new(1 << 30, 30),
        ki_dt: GainWord::new(1 << 20, 38),
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(14).expect("14 bits");
    let law = Law::accept(words, dac).expect("accepted");
    let window = firmware::output::Window::of(dac);
    let start = |mut state| i128::from(law.step(&mut state, &LawInput::default(), window).sum);
    assert_eq!(start(LawState::take_over(4_000)), 4_000 * unit);
    assert_eq!(start(LawState::default()), 0);
}
