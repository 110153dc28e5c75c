//! The three quantisers and the slew limit: what their means promise, and what
//! they do not.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::words::random_output;
use firmware::law::{Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::refusal::What;
use firmware::{Dac, GainWord};

/// One code, in units of the sums here: `Kp` = 2^−13 codes per count, for
/// sums up to 2^16 codes.
const CODE: i64 = 1 << 13;

/// The codes of any sums.
struct Codes {
    law: Law,
    output: Output,
    state: LawState,
}

impl Codes {
    fn new(output: Output) -> Self {
        let words = LawWords {
            kp: GainWord::new(1 << 18, 31),
            error_bits: 29,
            ..LawWords::NONE
        };
        let law = Law::accept(words, output.dac()).expect("accepted");
        Self {
            law,
            output,
            state: LawState::start(&output),
        }
    }

    /// The same for 16 bits and no slew limit.
    fn of(quantiser: Quantiser) -> Self {
        Self::new(Output::unlimited(
            Dac::with_bits(16).expect("16 bits"),
            quantiser,
        ))
    }

    fn give(&mut self, sum: i64) -> i64 {
        let error = i32::try_from(sum).expect("a sum within 2^16 codes");
        let input = LawInput {
            error,
            ..LawInput::default()
        };
        self.law.step(&self.output, &mut self.state, &input).into()
    }
}

/// Sums within the converter: at rest between two codes, slow, or wild.
fn sums(shape: u64, seed: u64) -> impl FnMut(usize) -> i64 + Clone {
    let mut random = Random(seed);
    let rest = random.between(-3 * CODE, 3 * CODE);
    let mut walk = rest;
    move |_| match shape {
        0 => rest,
        1 => CODE / 2,
        2 => {
            walk += random.between(-CODE / 100, CODE / 100);
            walk.clamp(-9 * CODE, 9 * CODE)
        }
        _ => random.between(-32_000 * CODE, 32_000 * CODE),
    }
}

/// Samples per run.
const STEPS: usize = 1_000_000;

#[test]
fn error_feedback_is_never_a_code_off_in_sum_nor_in_symmetry() {
    for shape in 0..4 {
        let mut next = sums(shape, 9 + shape);
        let [mut up, mut down] = [(); 2].map(|()| Codes::of(Quantiser::ErrorFeedback));
        let [mut off, mut apart] = [0; 2];
        for k in 0..STEPS {
            let sum = next(k);
            let [plus, minus] = [up.give(sum), down.give(-sum)];
            // Σcode − Σy = ρ(0) − ρ(N), within (−½, ½]
            off += plus * CODE - sum;
            assert!(2 * off > -CODE && 2 * off <= CODE, "{off}");
            // The means over N samples are opposite to within 1 code/N.
            apart += plus + minus;
            assert!(apart.abs() <= 1, "{apart}");
        }
    }
}

#[test]
fn contrast_the_nearest_codes_of_a_half_are_not_opposite() {
    let steps = i64::try_from(STEPS).expect("a million");
    let total = |quantiser, sum| {
        let mut codes = Codes::of(quantiser);
        (0..STEPS).map(|_| codes.give(sum)).sum::<i64>()
    };
    let add = |quantiser, sum| total(quantiser, sum) + total(quantiser, -sum);
    // floor(½ + ½) = 1, floor(−½ + ½) = 0: the means of +y and −y add up to 1.
    assert_eq!(add(Quantiser::Nearest, CODE / 2), steps);
    assert_eq!(add(Quantiser::ErrorFeedback, CODE / 2), 0);
    // Off the half they are opposite, but half a code from the sum: 0.4 → 0.
    assert_eq!(add(Quantiser::Nearest, CODE * 2 / 5), 0);
    assert_eq!(total(Quantiser::Nearest, CODE * 2 / 5), 0);
}

#[test]
fn at_a_limit_nothing_is_carried_over() {
    let mut codes = Codes::of(Quantiser::ErrorFeedback);
    // 0.33 are kept; a sum far beyond the end throws them away.
    let sums = [CODE / 3, 40_000 * CODE, CODE / 3, CODE / 3];
    assert_eq!(sums.map(|sum| codes.give(sum)), [0, 32_767, 0, 1]);
}

/// Five standard deviations of the mean of `STEPS` independent codes, 0.5 each
/// at most: 5·0.5/√10^6 codes.
const DITHER_BOUND_CODES: f64 = 0.0025;

#[test]
fn the_mean_of_dither_is_the_sum() {
    let mut largest = 0.0;
    for (seed, sum) in [
        (0, CODE / 2),
        (1, -CODE / 2),
        (7, CODE * 2 / 5),
        (7, -CODE * 2 / 5),
        (u32::MAX, 12_345 * CODE + CODE / 1_000),
        (3, -777 * CODE + 1),
        (4, CODE - 1),
    ] {
        let mut codes = Codes::of(Quantiser::Dither { seed });
        let mut off = 0;
        for _ in 0..STEPS {
            let code = codes.give(sum);
            // Never but the two codes beside the sum.
            assert!((code * CODE - sum).abs() < CODE);
            off += code * CODE - sum;
        }
        #[allow(
            clippy::cast_precision_loss,
            reason = "the mean is compared to 3 digits"
        )]
        let mean = off as f64 / STEPS as f64 / CODE as f64;
        println!("seed {seed}, y = {sum}·2^-13: mean {mean:+.6} codes off");
        assert!(mean.abs() <= DITHER_BOUND_CODES, "{mean}");
        largest = f64::max(largest, mean.abs());
    }
    // What does not hold: dither's sum wanders, it is not kept within a code.
    assert!(largest * 1e6 > 1.0);
}

#[test]
fn whole_sums_pass_dither_untouched_and_a_seed_gives_its_codes() {
    let mut random = Random(4);
    let mut codes = Codes::of(Quantiser::Dither { seed: 9 });
    for _ in 0..20_000 {
        let whole = random.between(-32_768, 32_767);
        assert_eq!(codes.give(whole * CODE), whole);
    }
    let run = |seed| {
        let (mut codes, mut next) = (Codes::of(Quantiser::Dither { seed }), sums(2, 8));
        (0..10_000).map(|k| codes.give(next(k))).collect::<Vec<_>>()
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

#[test]
fn no_code_leaves_the_range_or_steps_further_than_the_limit() {
    let mut random = Random(12);
    for _ in 0..300 {
        let dac = Dac::with_bits(random.bits(2, 24).into()).expect("2 to 24 bits");
        let (output, slew, _) = random_output(&mut random, dac);
        let step = i64::from(slew.unwrap_or(1 << 24));
        let range = 1_i64 << (dac.bits() - 1);
        let mut codes = Codes::new(output);
        let mut before = 0;
        for _ in 0..1_000 {
            let size = 1 << random.between(0, 29);
            let code = codes.give(random.between(-size, size));
            assert_eq!(code, i64::from(codes.state.code()));
            assert!((code - before).abs() <= step);
            assert!((-range..range).contains(&code));
            before = code;
        }
        // And off: ceil(|code|/s) steps, none longer than s, never past 0.
        for _ in 0..(before.abs() + step - 1) / step {
            let code = i64::from(codes.state.towards_zero(&output));
            assert!((code - before).abs() <= step && code.abs() < before.abs());
            assert!(code == 0 || code.signum() == before.signum());
            before = code;
        }
        let ends = [codes.state.towards_zero(&output), codes.state.safe()];
        assert_eq!((before, ends), (0, [0; 2]));
    }
}

#[test]
fn slew_limits_that_cannot_be_kept_are_refused() {
    let dac = Dac::with_bits(12).expect("12 bits");
    let limit = |codes| Output::new(dac, Some(codes), Quantiser::Nearest);
    assert!(limit(1).is_ok() && limit(Output::SLEW_MOST).is_ok());
    for codes in [0, Output::SLEW_MOST + 1, u32::MAX] {
        let error = limit(codes).expect_err("out of range");
        assert_eq!((error.what, error.value), (What::SlewCodes, codes.into()));
        assert_eq!((error.least, error.most), (1, 1 << 24));
        let sentence = format!(
            "a slew limit of {codes} codes per sample is not supported; it must be 1 to 16777216"
        );
        assert_eq!(error.to_string(), sentence);
    }
}
