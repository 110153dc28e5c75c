//! The three quantisers and the slew limit: what their means promise, and what
//! they do not.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::axis_words::random_output;
use firmware::Dac;
use firmware::output::{Output, Quantiser, Window};
use firmware::refusal::What;

fn output(quantiser: Quantiser) -> Output {
    Output::new(Dac::with_bits(16).expect("16 bits"), None, quantiser).expect("no limit")
}

/// The codes of the sums that `next` gives \[2^−F codes\].
fn codes(
    output: Output,
    f: u8,
    mut next: impl FnMut(usize) -> i64,
) -> impl Iterator<Item = (i64, i64)> {
    let mut state = output.start();
    (0..).map(move |k| {
        let (sum, window) = (next(k), output.window(&state));
        (sum, i64::from(output.code(&mut state, sum, f, window)))
    })
}

/// Sums within the converter: at rest between two codes, slow, or wild.
fn sums(shape: u64, f: u8, seed: u64) -> impl FnMut(usize) -> i64 + Clone {
    let mut random = Random(seed);
    let unit = 1_i64 << f;
    let rest = random.between(-3 * unit, 3 * unit);
    let mut walk = rest;
    move |_| match shape {
        0 => rest,
        1 => unit / 2,
        2 => {
            walk += random.between(-unit / 100, unit / 100);
            walk.clamp(-9 * unit, 9 * unit)
        }
        _ => random.between(-32_000 * unit, 32_000 * unit),
    }
}

/// Samples per run.
const STEPS: usize = 1_000_000;

#[test]
fn error_feedback_is_never_a_code_off_in_sum_nor_in_symmetry() {
    for shape in 0..4 {
        let f = 33 + 2 * u8::try_from(shape).expect("small");
        let next = sums(shape, f, 9 + shape);
        let mut mirrored = next.clone();
        let up = codes(output(Quantiser::ErrorFeedback), f, next);
        let down = codes(output(Quantiser::ErrorFeedback), f, move |k| -mirrored(k));
        let [mut off, mut apart] = [0_i128, 0];
        for ((sum, plus), (_, minus)) in up.zip(down).take(STEPS) {
            // Σcode − Σy = ρ(0) − ρ(N), within (−½, ½]
            off += (i128::from(plus) << f) - i128::from(sum);
            assert!(2 * off > -(1 << f) && 2 * off <= 1 << f, "{off}");
            // The means over N samples are opposite to within 1 code/N.
            apart += i128::from(plus + minus);
            assert!(apart.abs() <= 1, "{apart}");
        }
    }
}

#[test]
fn contrast_the_nearest_codes_of_a_half_are_not_opposite() {
    // floor(½ + ½) = 1, floor(−½ + ½) = 0: the means of +y and −y add up to 1.
    let add = |quantiser, size: fn(i64) -> i64| {
        let [up, down] = [1, -1].map(|sign| {
            let codes = codes(output(quantiser), 38, move |_| sign * size(1 << 38));
            codes.take(STEPS).map(|(_, code)| code).sum::<i64>()
        });
        up + down
    };
    let steps = i64::try_from(STEPS).expect("a million");
    assert_eq!(add(Quantiser::Nearest, |unit| unit / 2), steps);
    assert_eq!(add(Quantiser::ErrorFeedback, |unit| unit / 2).abs(), 0);
    // Off the half they are opposite, but half a code from the sum: 0.4 → 0.
    assert_eq!(add(Quantiser::Nearest, |unit| unit * 2 / 5), 0);
    let nearest = codes(output(Quantiser::Nearest), 38, |_| (1 << 38) * 2 / 5);
    assert_eq!(nearest.take(STEPS).map(|(_, code)| code).sum::<i64>(), 0);
}

#[test]
fn at_a_limit_nothing_is_carried_over() {
    let output = output(Quantiser::ErrorFeedback);
    let mut state = output.start();
    let mut give = |sum: i64, window| output.code(&mut state, sum, 38, window);
    let whole = Window::of(Dac::with_bits(16).expect("16 bits"));
    let third = (1_i64 << 38) / 3;
    assert_eq!(give(third, whole), 0);
    // 0.33 are kept; a sum far beyond the end throws them away.
    assert_eq!(give(1 << 60, whole), 32_767);
    assert_eq!(give(third, whole), 0);
    assert_eq!(give(third, whole), 1);
}

/// Five standard deviations of the mean of `STEPS` independent codes, 0.5 each
/// at most: 5·0.5/√10^6 codes.
const DITHER_BOUND_CODES: f64 = 0.0025;

#[test]
fn the_mean_of_dither_is_the_sum() {
    let unit = 1_i64 << 38;
    let mut largest = 0.0;
    for (seed, sum) in [
        (0, unit / 2),
        (1, -unit / 2),
        (7, unit * 2 / 5),
        (7, -unit * 2 / 5),
        (u32::MAX, 12_345 * unit + unit / 1_000),
        (3, -777 * unit + 1),
        (4, unit - 1),
    ] {
        let codes = codes(output(Quantiser::Dither { seed }), 38, move |_| sum);
        let (mut off, mut extremes) = (0_i128, [i64::MAX, i64::MIN]);
        for (_, code) in codes.take(STEPS) {
            off += (i128::from(code) << 38) - i128::from(sum);
            extremes = [extremes[0].min(code), extremes[1].max(code)];
        }
        // Never but the two codes beside the sum.
        let floor = sum.div_euclid(unit);
        assert!(extremes[0] >= floor && extremes[1] <= floor + 1);
        #[allow(
            clippy::cast_precision_loss,
            reason = "the mean is compared to 3 digits"
        )]
        let mean = off as f64 / STEPS as f64 / unit as f64;
        println!("seed {seed}, y = {sum}·2^-38: mean {mean:+.6} codes off");
        assert!(mean.abs() <= DITHER_BOUND_CODES, "{mean}");
        largest = f64::max(largest, mean.abs());
    }
    // What does not hold: dither's sum wanders, it is not kept within a code.
    assert!(largest * 1e6 > 1.0);
}

#[test]
fn whole_sums_pass_dither_untouched() {
    let mut random = Random(4);
    for f in 33..=40 {
        for _ in 0..20_000 {
            let seed = u32::try_from(random.next() >> 32).expect("32 bits");
            let whole = random.between(-32_768, 32_767);
            let mut codes = codes(output(Quantiser::Dither { seed }), f, |_| whole << f);
            assert_eq!(codes.next().map(|(_, code)| code), Some(whole));
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_codes() {
    let run = |seed| {
        let codes = codes(output(Quantiser::Dither { seed }), 40, sums(2, 40, 8));
        codes.take(10_000).map(|(_, code)| code).collect::<Vec<_>>()
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

#[test]
fn no_code_leaves_the_window_or_steps_further_than_the_limit() {
    let mut random = Random(12);
    for _ in 0..300 {
        let dac_bits = u32::from(random.bits(2, 24));
        let dac = Dac::with_bits(dac_bits).expect("2 to 24 bits");
        let (output, slew, _) = random_output(&mut random, dac);
        let f = random.bits(33, 40);
        let step = i32::try_from(slew.unwrap_or(1 << 24)).expect("25 bits");
        let mut state = output.start();
        for _ in 0..1_000 {
            let before = state.code();
            let size = 1 << random.between(20, 61);
            let sum = random.between(-size, size);
            let window = output.window(&state);
            assert!(window.low() >= dac.min_code() && window.high() <= dac.max_code());
            let code = output.code(&mut state, sum, f, window);
            assert_eq!(code, state.code());
            assert!((code - before).abs() <= step);
            assert!((dac.min_code()..=dac.max_code()).contains(&code));
        }
        // And off: ceil(|code|/s) steps, none longer than s, never past 0.
        let mut left = state.code();
        let steps = (left.abs() + step - 1) / step;
        for _ in 0..steps {
            let code = output.towards_zero(&mut state);
            assert!((code - left).abs() <= step && code.abs() <= left.abs());
            assert!(code == 0 || code.signum() == left.signum());
            left = code;
        }
        assert_eq!(
            [
                left,
                output.towards_zero(&mut state),
                output.safe(&mut state)
            ],
            [0; 3]
        );
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
