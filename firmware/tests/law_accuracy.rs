//! The codes against the law of decimal gains in exact rationals, at every
//! sample.
//!
//! Theory (`firmware::law::words`): with gains up to half a unit beside their
//! words the sum before rounding is off by at most 63/64 of a code over the
//! declared ranges, so the code by at most 1. A difference beyond `D` is held;
//! firmware and exact law then stand at the same end of the converter.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use std::collections::BTreeMap;

use exact::model::Model;
use exact::rational::{
    Exact, ExactLaw, Gains, Shape, Within, beside, decimal, exact_code, finest_word,
    millionths_apart, ratio, word_with,
};
use exact::words::{accepted, gains};
use exact::{Random, Sample, sample};
use firmware::law::{
    AntiWindup, Begin, Derivative, FilterWords, Law, LawInput, LawState, LawWords,
};
use firmware::output::{Output, Quantiser};
use firmware::{Dac, GainWord};

/// 63/64 of a code, rounded up with what was measured.
const SUM_BOUND_MILLIONTHS: i64 = 984_375 + 1;

/// Just inside half a unit, in its billionths.
const HALF: i64 = 499_999_999;

/// Largest deviations from the exact law.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Deviation {
    samples: u32,
    /// Of the code.
    code: i128,
    /// Of the sum where the difference is not beyond `D` \[codes/10^6\].
    sum_millionths: i64,
    /// Number of samples that gave another code than the exact law.
    other_codes: u32,
    /// Number of samples beyond `D`.
    held: u32,
}

impl Deviation {
    fn and(self, other: Self) -> Self {
        Self {
            samples: self.samples + other.samples,
            code: self.code.max(other.code),
            sum_millionths: self.sum_millionths.max(other.sum_millionths),
            other_codes: self.other_codes + other.other_codes,
            held: self.held + other.held,
        }
    }

    fn assert_promise(self, what: &dyn core::fmt::Debug) {
        assert!(self.code <= 1, "{self:?} for {what:?}");
        assert!(
            self.sum_millionths <= SUM_BOUND_MILLIONTHS,
            "{self:?} for {what:?}"
        );
    }
}

/// Runs `law` of a converter and limit `D` beside the exact law.
fn deviation(
    mut exact: ExactLaw,
    (dac, limit): (Dac, i64),
    samples: u32,
    mut law: impl FnMut(&LawInput) -> Sample,
    mut next: impl FnMut(&ExactLaw, i128) -> LawInput,
) -> Deviation {
    let mut worst = Deviation {
        samples,
        ..Deviation::default()
    };
    let mut last_code = 0;
    for _ in 0..samples {
        let input = next(&exact, last_code);
        let given = law(&input);
        assert!(!given.told, "{input:?}, {exact:?}, {given:?}");
        let y = exact.step(&input);
        let code = exact_code(&y, dac);
        if exact.difference.abs() > limit {
            worst.held += 1;
            assert_eq!(given.code, code);
            assert!(dac.is_limit(i32::try_from(code).expect("24 bits")));
        } else {
            worst.sum_millionths = worst.sum_millionths.max(millionths_apart(&y, given.sum));
        }
        worst.code = worst.code.max((given.code - code).abs());
        worst.other_codes += u32::from(given.code != code);
        last_code = given.code;
    }
    worst
}

/// The firmware beside the exact law of `gains`.
fn firmware_deviation(
    law: Law,
    gains: &Gains,
    samples: u32,
    next: impl FnMut(&ExactLaw, i128) -> LawInput,
) -> Deviation {
    let output = Output::unlimited(law.dac(), Quantiser::Nearest);
    let (mut state, mut begin) = (LawState::start(&output), Some(Begin::AtRest));
    let step = |input: &LawInput| sample(&law, &output, &mut state, input, begin.take());
    let exact = ExactLaw::new(gains, law.words());
    let limit = law.difference_limit().into();
    deviation(exact, (law.dac(), limit), samples, step, next)
}

/// `law` without treatment of wind-up, which the exact law does not have.
fn untreated(law: Law) -> Law {
    let anti_windup = AntiWindup::None;
    Law::accept(
        LawWords {
            anti_windup,
            ..*law.words()
        },
        law.dac(),
    )
    .expect("the same gains")
}

/// Features of a law, for the table.
fn features(words: &LawWords) -> impl Iterator<Item = &'static str> {
    let measured = words.derivative == Derivative::Measurement;
    let forward = gains(words)[3..].iter().any(|word| word.mantissa != 0);
    [
        ("all", true),
        ("difference of errors", !measured && words.filter.is_none()),
        ("measured difference", measured && words.filter.is_none()),
        ("filtered, of errors", !measured && words.filter.is_some()),
        ("filtered, measured", measured && words.filter.is_some()),
        ("feed-forward", forward),
        (
            "neither filter nor feed-forward",
            !forward && words.filter.is_none(),
        ),
    ]
    .into_iter()
    .filter_map(|(name, has)| has.then_some(name))
}

#[test]
fn random_gains_keep_the_promise_over_the_declared_ranges() {
    let mut random = Random(91);
    let mut table = BTreeMap::new();
    for round in 0..3_600 {
        let law = untreated(accepted(&mut random));
        let gains = beside(law.words(), || match random.between(0, 2) {
            0 => HALF,
            1 => -HALF,
            _ => random.between(-HALF, HALF),
        });
        let shape = Shape::ALL[usize::try_from(round % 6).expect("below 6")];
        let mut inputs = Within::new(law, shape, round);
        let run = firmware_deviation(law, &gains, 700, |exact, code| inputs.next(exact, code));
        run.assert_promise(&(shape, law.words(), law.dac()));
        for feature in features(law.words()) {
            let so_far = table.entry(feature).or_insert(Deviation::default());
            *so_far = so_far.and(run);
        }
    }
    for (feature, worst) in &table {
        println!("{feature}: {worst:?}");
        assert_eq!(worst.code, 1, "some roundings must show: {feature}");
        assert!(worst.sum_millionths > 400_000, "{feature}");
    }
    assert!(table["all"].held > 10_000);
}

/// Decimal gains `Kp`, `Ki`, `Kd` at a sample time, with their finest words.
fn of_decimals(gains: [&str; 3], sample_time_ns: i64, error_bits: u8) -> (Gains, LawWords) {
    let dt = ratio(sample_time_ns, 1_000_000_000);
    let [kp, ki, kd] = gains.map(decimal);
    let (ki_dt, kd_per_dt) = (ki * &dt, kd / dt);
    let words = LawWords {
        kp: finest_word(&kp),
        ki_dt: finest_word(&ki_dt),
        kd_per_dt: finest_word(&kd_per_dt),
        error_bits,
        ..LawWords::NONE
    };
    let none = || ratio(0, 1);
    ([kp, ki_dt, kd_per_dt, none(), none(), none()], words)
}

fn accept(words: LawWords, dac_bits: u32) -> Law {
    Law::accept(words, Dac::with_bits(dac_bits).expect("2 to 24 bits")).expect("accepted")
}

#[test]
fn named_gains_keep_the_promise_over_long_runs() {
    let paper = ["3.2", "5", "0.05"];
    for (name, gains, sample_time_ns, dac_bits, error_bits) in [
        ("the paper's at 1 ms", paper, 1_000_000, 14, 18),
        ("the paper's at 0.1 ms", paper, 100_000, 12, 18),
        ("the paper's at 10 µs", paper, 10_000, 24, 18),
        (
            "Kp = 20, Kd/Δt = 300",
            ["20", "5", "0.3"],
            1_000_000,
            16,
            17,
        ),
        ("Ki·Δt alone", ["0", "0.7", "0"], 1_000_000, 24, 22),
    ] {
        let (gains, words) = of_decimals(gains, sample_time_ns, error_bits);
        let law = accept(words, dac_bits);
        let mut worst = Deviation::default();
        for shape in Shape::ALL {
            // The long run is the one that looks like an axis.
            let samples = if shape == Shape::ClosedLoop {
                500_000
            } else {
                50_000
            };
            let mut inputs = Within::new(law, shape, 7);
            let run =
                firmware_deviation(law, &gains, samples, |exact, code| inputs.next(exact, code));
            run.assert_promise(&(name, shape));
            worst = worst.and(run);
        }
        println!("{name}: {worst:?}");
    }
}

#[test]
fn the_promise_holds_up_to_the_declared_sum_of_errors() {
    // Up to the limit and back to 0 with the largest errors.
    for (gains, sample_time_ns, error_bits) in [
        (["3.2", "5", "0.05"], 10_000, 18),
        (["20", "5", "0.3"], 1_000_000, 17),
        (["0.4", "1.9", "0.001"], 10_000, 22),
    ] {
        let (gains, words) = of_decimals(gains, sample_time_ns, error_bits);
        let law = accept(words, 24);
        let stretch = law.error_sum_limit() >> error_bits;
        for sign in [1, -1] {
            let mut k = 0;
            let samples = u32::try_from(2 * stretch).expect("at most 2^15");
            let run = firmware_deviation(law, &gains, samples, |_, _| {
                k += 1;
                let up = if k <= stretch { sign } else { -sign };
                LawInput {
                    error: up << error_bits,
                    ..LawInput::default()
                }
            });
            println!("Σe to {stretch}·2^{error_bits}: {run:?}");
            run.assert_promise(&words);
        }
    }
}

#[test]
fn held_differences_end_where_the_exact_law_ends() {
    // The integral goes to its limit; then come jumps of D or a little more
    // against it and against the proportional term.
    let mut random = Random(92);
    let mut worst = Deviation::default();
    for _ in 0..6_000 {
        let law = untreated(accepted(&mut random));
        let (limit, difference) = (law.error_limit(), law.difference_limit());
        if law.words().filter.is_some() || difference >= limit {
            continue;
        }
        let gains = beside(law.words(), || random.one_of(&[HALF, -HALF]));
        let mut k = 0;
        let run = firmware_deviation(law, &gains, 120, |_, _| {
            k += 1;
            let jump = difference + i32::from(random.bits(0, 2)) - 1;
            LawInput {
                error: if k < 80 || k % 2 == 0 {
                    limit
                } else {
                    limit - jump
                },
                difference: random.one_of(&[jump, -jump]),
                velocity: 1 - (1 << 24),
                acceleration: (1 << 24) - 1,
                ..LawInput::default()
            }
        });
        run.assert_promise(law.words());
        worst = worst.and(run);
    }
    println!("around D: {worst:?}");
    assert!(worst.held > 10_000);
}

/// The coarsest words of E = 2^23 with every term on; the filter is slow enough
/// to reach its largest rounding.
const COARSEST: LawWords = LawWords {
    kp: GainWord::new(1, 25),
    // Σe to 2^31, 2^8 errors.
    ki_dt: GainWord::new(1, 32),
    // Kd/Δt = 1, differences to 2^24 with h = 4: 1/16 code a unit.
    kd_per_dt: GainWord::new(1 << 24, 24),
    velocity_ff: GainWord::new(1, 29),
    acceleration_ff: GainWord::new(1, 29),
    friction_ff: GainWord::new(1, 5),
    error_bits: 23,
    integral_bits: 24,
    derivative: Derivative::Measurement,
    filter: Some(FilterWords {
        smoothing: 1 << 21,
        fraction_bits: 4,
    }),
    anti_windup: AntiWindup::None,
};

/// Everything to its end with one sign: the filter first, with errors that
/// cancel; then 2^8 errors, which fill the sum, and differences that keep the
/// filter beside its end.
fn all_to_the_end() -> impl FnMut(&ExactLaw, i128) -> LawInput {
    let mut k = 0_i32;
    move |_, _| {
        k += 1;
        let up = k > 24_000 && (k <= 24_256 || k % 2 == 1);
        let idle = k <= 24_000 && k % 2 == 0;
        LawInput {
            error: if up || idle { 1 << 23 } else { -1 << 23 },
            difference: -((1 << 24) - i32::from(k % 3 == 0)),
            velocity: (1 << 24) - 1,
            acceleration: (1 << 24) - 1,
            ..LawInput::default()
        }
    }
}

#[test]
fn the_bound_is_nearly_reached_by_the_coarsest_words() {
    let law = accept(COARSEST, 24);
    assert_eq!(law.difference_limit(), 1 << 24);
    let runs = [HALF, -HALF].map(|half| {
        let gains = beside(&COARSEST, || half);
        let run = firmware_deviation(law, &gains, 25_000, all_to_the_end());
        println!("coarsest words, {half:+} billionths beside: {run:?}");
        run.assert_promise(&COARSEST);
        run.sum_millionths
    });
    // 59/64 come from the words alone; the filter gives more than a half of
    // the other 4.
    assert!(runs.iter().all(|&apart| apart > 59 * 1_000_000 / 64));
    assert!(runs.iter().any(|&apart| apart > 61 * 1_000_000 / 64));
}

/// The model, which runs words that are refused, beside the exact law.
fn model_deviation(
    words: LawWords,
    gains: &Gains,
    samples: u32,
    next: impl FnMut(&ExactLaw, i128) -> LawInput,
) -> Deviation {
    let dac = Dac::with_bits(24).expect("24 bits");
    let mut model = Model::new(words, dac.bits(), None, Quantiser::Nearest);
    let mut begin = Some(Begin::AtRest);
    let limit = i64::try_from(model.ranges.difference).expect("at most 2^30");
    // Coarser words declare less; the ranges here are those of the finer ones.
    let law = |input: &LawInput| Sample {
        told: false,
        ..model.step(input, begin.take())
    };
    deviation(
        ExactLaw::new(gains, &words),
        (dac, limit),
        samples,
        law,
        next,
    )
}

#[test]
fn contrast_words_one_bit_coarser_break_the_bound() {
    let fine = COARSEST;
    let coarser = [
        LawWords {
            kp: GainWord::new(1, 24),
            ..fine
        },
        // By a rule of S ≤ 2^fi, which leaves it 2^31.
        LawWords {
            ki_dt: GainWord::new(1, 31),
            ..fine
        },
        LawWords {
            kd_per_dt: GainWord::new(1 << 23, 23),
            ..fine
        },
        // Two bits: one is what the filter leaves of its 1/16.
        LawWords {
            friction_ff: GainWord::new(1, 3),
            ..fine
        },
        LawWords {
            velocity_ff: GainWord::new(1, 28),
            acceleration_ff: GainWord::new(1, 28),
            ..fine
        },
    ];
    for words in coarser {
        assert!(Law::accept(words, Dac::with_bits(24).expect("24 bits")).is_err());
        let run = model_deviation(words, &beside(&words, || HALF), 25_000, all_to_the_end());
        println!(
            "{:?}: {run:?}",
            gains(&words).map(|word| word.fraction_bits)
        );
        assert!(run.sum_millionths > SUM_BOUND_MILLIONTHS, "{run:?}");
    }
}

#[test]
fn contrast_words_that_are_too_coarse_miss_by_codes() {
    // At 0.1 ms Kd/Δt = 500 leaves a common format of 24 bits 14 fraction
    // bits, in which Ki·Δt = 0.0005 is 8/2^14.
    let (gains, own) = of_decimals(["3.2", "5", "0.05"], 100_000, 18);
    let word = |gain: &Exact| word_with(gain, 14).expect("24 bits");
    let common = LawWords {
        kp: word(&gains[0]),
        ki_dt: word(&gains[1]),
        kd_per_dt: word(&gains[2]),
        ..own
    };
    let constant = |_: &ExactLaw, _| LawInput {
        error: 1_000,
        ..LawInput::default()
    };
    assert!(model_deviation(own, &gains, 10_000, constant).code <= 1);
    let apart = model_deviation(common, &gains, 10_000, constant).code;
    println!("common format: {apart} codes after 1 s at 1000 counts");
    assert!(apart > 100, "{apart}");
}
