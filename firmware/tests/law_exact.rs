//! The law and its output against their definition, sample by sample and bit
//! for bit, over random accepted words and inputs that try to break them.
//!
//! The firmware adds with wrapping operations, so overflow checks are blind to
//! it; the model's 128 bits are the overflow detector. Words at the 62 bits of
//! the demand are therefore part of the random ones, and the corners of all
//! declared ranges are met together.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::inputs::{Drive, Samples};
use exact::model::{MOST, Model, two};
use exact::words::{accepted, brim_full, random_output, random_words};
use exact::{Random, Sample, sample};
use firmware::law::{AntiWindup, Begin, Derivative, Law, LawInput, LawState, LawWords};
use firmware::output::{Output, Quantiser};
use firmware::{Dac, GainWord};

const BEGINS: [Begin; 3] = [Begin::AtRest, Begin::FromCode, Begin::OtherGains];

/// Firmware and model side by side.
struct Pair {
    law: Law,
    output: Output,
    state: LawState,
    model: Model,
}

impl Pair {
    fn new(law: Law, random: &mut Random) -> Self {
        let (output, slew, quantiser) = random_output(random, law.dac());
        Self {
            law,
            output,
            state: LawState::start(&output),
            model: Model::new(*law.words(), law.dac().bits(), slew, quantiser),
        }
    }

    /// One sample of both.
    fn step(&mut self, input: &LawInput, begin: Option<Begin>) -> Sample {
        let (before, model) = (self.state, self.model.clone());
        let given = sample(&self.law, &self.output, &mut self.state, input, begin);
        let wanted = self.model.step(input, begin);
        let goes_on = matches!(begin, Some(Begin::FromCode | Begin::OtherGains));
        let same = given.code == wanted.code
            && given.told == wanted.told
            && (given.sum == wanted.sum || goes_on)
            && i128::from(self.state.integral().to_bits()) == self.model.integral;
        assert!(
            same,
            "{given:?}, but {wanted:?}\n for {input:?}, {begin:?} after {before:?}\n {model:?}"
        );
        given
    }
}

#[test]
fn every_sum_and_code_is_the_models() {
    let mut random = Random(41);
    let (mut steps, mut widest, mut bumpless) = (0_u64, 0, 0);
    for round in 0..4_000 {
        let mut pair = Pair::new(accepted(&mut random), &mut random);
        let mut samples = Samples::of_round(round);
        let mut begin = Some(Begin::AtRest);
        for _ in 0..1_000 {
            let input = samples.next(&pair.model);
            let before = pair.model.code;
            let code = pair.step(&input, begin).code;
            if matches!(begin, Some(Begin::FromCode | Begin::OtherGains))
                && pair.law.words().ki_dt.mantissa != 0
            {
                assert_eq!(code, before, "a bump");
                bumpless += 1;
            }
            begin = random.one_in(300).then(|| random.one_of(&BEGINS));
            if begin == Some(Begin::OtherGains) {
                // For the same converter, whatever else they are.
                let (words, _) = random_words(&mut random);
                if let Ok(law) = Law::accept(words, pair.law.dac()) {
                    pair.law = law;
                    pair.model.change(words);
                }
            }
            steps += 1;
        }
        widest = widest.max(pair.model.widest);
    }
    println!("{steps} steps, {bumpless} of them go on from the code in force");
    println!("largest sum 2^63·{}/1000", (widest * 1_000) >> 63);
    assert!(widest < two(63) && bumpless > 5_000);
    assert!(widest > two(62), "no sum came near 63 bits");
}

#[test]
fn all_extremes_together_fill_63_bits_and_no_more() {
    let mut random = Random(5);
    for anti_windup in [
        AntiWindup::None,
        AntiWindup::Clamp,
        AntiWindup::BackCalculation { tracking: i32::MAX },
        AntiWindup::BackCalculation { tracking: 1 },
    ] {
        let (words, dac) = brim_full(anti_windup);
        let law = Law::accept(words, dac).expect("not a unit too much");
        let mut widest = 0;
        for round in 0..10 {
            let mut pair = Pair::new(law, &mut random);
            let drive = if round < 6 {
                Drive::Together
            } else {
                Drive::Corners
            };
            let mut samples = Samples::new(drive, round);
            for k in 0..3_000 {
                let input = samples.next(&pair.model);
                let begins = k == 0 || random.one_in(1_000);
                pair.step(&input, begins.then(|| random.one_of(&BEGINS)));
            }
            widest = widest.max(pair.model.widest);
        }
        println!("{anti_windup:?}: 2^63·{}/1000", (widest * 1_000) >> 63);
        assert!(widest < two(63));
        // A clamped integral is at most R + T, and the sum twice that.
        assert!(widest > two(63) * 99 / 100, "{widest}");
    }
}

#[test]
fn contrast_words_that_are_refused_pass_63_bits() {
    // The same brim-full words, one bit more of three: what the firmware
    // refuses does not fit. The model shows it, since i64 would hide it.
    let (words, dac) = brim_full(AntiWindup::None);
    let doubled = |word: GainWord| GainWord::new(word.mantissa, word.fraction_bits - 1);
    let words = LawWords {
        kp: doubled(words.kp),
        kd_per_dt: doubled(words.kd_per_dt),
        velocity_ff: doubled(words.velocity_ff),
        ..words
    };
    assert!(Law::accept(words, dac).is_err());
    let mut model = Model::new(words, dac.bits(), None, Quantiser::Nearest);
    let mut samples = Samples::new(Drive::Together, 0);
    for _ in 0..1_000 {
        let input = samples.next(&model);
        model.step(&input, None);
    }
    assert!(model.widest > two(63) && MOST < two(63), "{}", model.widest);
}

/// Number of codes that a model of other words or another output gets wrong.
fn other_codes(change: fn(&mut LawWords), slew: Option<u32>, quantiser: Quantiser) -> usize {
    // Kp = ½, Ki·Δt = 2^−6, Kd/Δt = 2 codes per count.
    let words = LawWords {
        kp: GainWord::new(1 << 30, 31),
        ki_dt: GainWord::new(1 << 24, 30),
        kd_per_dt: GainWord::new(1 << 30, 29),
        velocity_ff: GainWord::new(1 << 10, 32),
        anti_windup: AntiWindup::Clamp,
        ..LawWords::NONE
    };
    let dac = Dac::with_bits(10).expect("10 bits");
    let law = Law::accept(words, dac).expect("accepted");
    let output = Output::new(dac, Some(40), Quantiser::Nearest).expect("a slew limit");
    let (mut state, mut other) = (LawState::start(&output), words);
    change(&mut other);
    let mut model = Model::new(other, dac.bits(), slew, quantiser);
    let differ = (0..2_000_i32).filter(|k| {
        let input = LawInput {
            error: (k % 500 - 250) * (k % 7),
            difference: 3 * k % 40,
            velocity: k << 10,
            within_dead_band: k % 50 == 0,
            ..LawInput::default()
        };
        let begin = (*k == 0).then_some(Begin::AtRest);
        let given = sample(&law, &output, &mut state, &input, begin).code;
        given != model.step(&input, begin).code
    });
    differ.count()
}

#[test]
fn contrast_every_option_shows() {
    let nearest = Quantiser::Nearest;
    assert_eq!(other_codes(|_| (), Some(40), nearest), 0);
    let changes: [fn(&mut LawWords); 7] = [
        |words| words.kp.mantissa += 1 << 22,
        |words| words.ki_dt.mantissa += 1 << 22,
        |words| words.kd_per_dt.mantissa += 1 << 22,
        |words| words.velocity_ff.mantissa = 0,
        |words| words.derivative = Derivative::Measurement,
        |words| words.anti_windup = AntiWindup::None,
        |words| words.anti_windup = AntiWindup::BackCalculation { tracking: 1 << 26 },
    ];
    for (k, change) in changes.into_iter().enumerate() {
        assert!(other_codes(change, Some(40), nearest) > 0, "change {k}");
    }
    for (slew, quantiser) in [
        (None, nearest),
        (Some(41), nearest),
        (Some(40), Quantiser::ErrorFeedback),
        (Some(40), Quantiser::Dither { seed: 0 }),
    ] {
        assert!(
            other_codes(|_| (), slew, quantiser) > 0,
            "{slew:?}, {quantiser:?}"
        );
    }
}
