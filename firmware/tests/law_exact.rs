//! The axis' law and output against their definitions, step by step and
//! bit for bit, over random accepted words and inputs that try to break them.
//!
//! The firmware adds with wrapping operations, so overflow checks are blind to
//! it; the model's 128 bits are the overflow detector. Words near the 62 bits
//! are therefore part of the random ones, and the corners of all declared
//! ranges are met together.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::axis_inputs::{Drive, Samples};
use exact::axis_law::{Model, two};
use exact::axis_words::{accepted, largest, random_output};
use firmware::law::{AntiWindup, Law, LawInput, LawState, LawWords};
use firmware::output::{Output, OutputState, Quantiser, Window};
use firmware::{Dac, GainWord};

/// Firmware and model side by side.
struct Pair {
    law: Law,
    output: Output,
    memory: LawState,
    codes: OutputState,
    model: Model,
}

impl Pair {
    fn new(law: Law, dac: Dac, random: &mut Random) -> Self {
        let (output, slew, quantiser) = random_output(random, dac);
        Self {
            law,
            output,
            memory: LawState::default(),
            codes: output.start(),
            model: Model::new(*law.words(), dac, slew, quantiser),
        }
    }

    /// One sample of both; the sum.
    fn step(&mut self, input: &LawInput) -> i64 {
        let window = self.output.window(&self.codes);
        let given = self.law.step(&mut self.memory, input, window);
        let f = self.law.words().sum_fraction_bits;
        let code = self.output.code(&mut self.codes, given.sum, f, window);
        let before = self.model.clone();
        let wanted = self.model.step(input);
        let limited = [
            given.error_limited,
            given.difference_limited,
            given.integral_limited,
        ];
        let same = i128::from(given.sum) == wanted.sum
            && i128::from(code) == wanted.code
            && limited == wanted.limited
            && i128::from(self.memory.integral()) == self.model.integral;
        assert!(
            same,
            "{given:?}, code {code}, but {wanted:?}\n for {input:?} after {before:?}"
        );
        given.sum
    }
}

#[test]
fn every_sum_and_code_is_the_models() {
    let mut random = Random(41);
    let (mut steps, mut widest) = (0_u64, 0_u64);
    for seed in 0..4_000_u64 {
        let (law, dac) = accepted(&mut random);
        let mut pair = Pair::new(law, dac, &mut random);
        let drive = Drive::ALL[usize::try_from(seed % 5).expect("below 5")];
        let mut samples = Samples::new(drive, seed / 5);
        for _ in 0..1_000 {
            if random.one_in(400) {
                let code = pair.codes.code();
                pair.memory = LawState::take_over(code);
                pair.model.take_over(i128::from(code));
            }
            let input = samples.next(&pair.model);
            widest = widest.max(pair.step(&input).unsigned_abs());
            steps += 1;
        }
    }
    println!("{steps} steps, largest |sum| 2^62·{}/1000", widest >> 52);
    assert!(widest < 1 << 62);
    assert!(widest > 9 << 58, "no sum came near 62 bits");
}

/// Words with hardly a bit to spare: what is left for `Kp` after the others.
fn brim_full(f: u8, anti_windup: AntiWindup) -> (LawWords, Dac) {
    let dac = Dac::with_bits(2).expect("2 bits");
    // In 2^−F codes: Q = 2^52, FF = 2^60 and 2^59, D-term 2^59.
    let mut words = LawWords {
        kp: GainWord::new(0, f),
        ki_dt: GainWord::new(1 << (52 - 8 - 17), f),
        kd_per_dt: GainWord::new(1 << 30, f - 11),
        velocity_ff: GainWord::new(1 << 30, f),
        acceleration_ff: GainWord::new(1 << 29, f),
        friction_ff: GainWord::new(i32::MAX, f),
        error_bits: 17,
        sum_fraction_bits: f,
        integral_bits: 52 - f,
        anti_windup,
        ..LawWords::NONE
    };
    // The largest Kp that leaves the sum below 2^62: by bisection.
    let (mut fits, mut too_much) = (0, i32::MAX);
    while too_much - fits > 1 {
        words.kp = GainWord::new(fits + (too_much - fits) / 2, f - 13);
        if Law::accept(words, dac).is_ok() {
            fits = words.kp.mantissa;
        } else {
            too_much = words.kp.mantissa;
        }
    }
    words.kp.mantissa = fits;
    (words, dac)
}

#[test]
fn all_extremes_together_fill_62_bits_and_no_more() {
    let mut random = Random(5);
    for f in 35..=40 {
        for anti_windup in [
            AntiWindup::None,
            AntiWindup::Clamp,
            AntiWindup::BackCalculation { tracking: i32::MAX },
            AntiWindup::BackCalculation { tracking: 1 },
        ] {
            let (words, dac) = brim_full(f, anti_windup);
            let law = Law::accept(words, dac).expect("found by bisection");
            let mut pair = Pair::new(law, dac, &mut random);
            assert!(largest(&words, &pair.model.ranges) > two(62) - two(46));
            let mut widest = 0;
            for seed in 0..2 {
                let mut samples = Samples::new(Drive::Together, seed);
                for _ in 0..3_000 {
                    let input = samples.next(&pair.model);
                    widest = widest.max(pair.step(&input).unsigned_abs());
                }
            }
            println!(
                "F = {f}, {anti_windup:?}: 2^62·{}/1000",
                ((widest >> 50) * 1_000) >> 12
            );
            assert!(widest < 1 << 62);
            assert!(widest > 99 * ((1 << 62) / 100), "{widest}");
        }
    }
}

#[test]
fn rates_beyond_their_range_are_exact_all_the_same() {
    // Twice the declared velocity and acceleration: twice their terms at most,
    // and the 63rd bit is there for that. Nothing wraps.
    let corners = [i32::MIN, i32::MIN + 1, i32::MAX, 1 << 30, -(1 << 30), 0];
    let mut random = Random(6);
    for round in 0..600 {
        let (law, dac) = if round % 3 == 0 {
            let (words, dac) = brim_full(35 + random.bits(0, 5), AntiWindup::Clamp);
            (Law::accept(words, dac).expect("found by bisection"), dac)
        } else {
            accepted(&mut random)
        };
        let mut pair = Pair::new(law, dac, &mut random);
        for _ in 0..300 {
            let mut corner = || corners[usize::from(random.bits(0, 5))];
            let input = LawInput {
                error: corner(),
                difference: corner(),
                velocity: corner(),
                acceleration: corner(),
                within_dead_band: false,
                hold_integral: false,
            };
            pair.step(&input);
        }
    }
}

#[test]
fn contrast_words_that_are_refused_pass_62_bits() {
    // The same brim-full words, one bit more of everything: what the firmware
    // refuses does not fit. The model shows it, since i64 would hide it.
    let (words, dac) = brim_full(38, AntiWindup::None);
    let doubled = |word: GainWord| GainWord::new(word.mantissa, word.fraction_bits - 1);
    let words = LawWords {
        kp: doubled(words.kp),
        kd_per_dt: doubled(doubled(words.kd_per_dt)),
        velocity_ff: doubled(words.velocity_ff),
        ..words
    };
    assert!(Law::accept(words, dac).is_err());
    let mut model = Model::new(words, dac, None, Quantiser::Nearest);
    let mut samples = Samples::new(Drive::Together, 0);
    let widest = (0..1_000).fold(0, |widest: i128, _| {
        let input = samples.next(&model);
        widest.max(model.step(&input).sum.abs())
    });
    assert!(widest > two(62), "{widest}");
}

#[test]
fn a_code_to_go_on_from_is_held_within_the_window() {
    // A code that no converter has would be shifted out of 64 bits.
    let (words, dac) = brim_full(40, AntiWindup::None);
    let law = Law::accept(words, dac).expect("found by bisection");
    for (code, held) in [(i32::MAX, 1_i64), (i32::MIN, -2)] {
        let mut state = LawState::take_over(code);
        let y = law.step(&mut state, &LawInput::default(), Window::of(dac));
        assert_eq!(y.sum, held << 40);
    }
}
