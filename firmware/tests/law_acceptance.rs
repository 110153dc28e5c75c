//! Words that the law accepts: every demand of `firmware::law::words` from both
//! sides, every refusal with its sentence; and the whole rule over random words.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::Random;
use exact::model::Ranges;
use exact::words::{allowed, brim_full, random_words};
use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawWords, Part};
use firmware::refusal::What;
use firmware::{Dac, GainWord, Refusal};
use proptest::prelude::*;

/// The paper's gains at 1 ms.
const PAPER: LawWords = LawWords {
    kp: GainWord::new(1_717_986_918, 29),
    ki_dt: GainWord::new(21_474_836, 32),
    kd_per_dt: GainWord::new(1_677_721_600, 25),
    error_bits: 18,
    ..LawWords::NONE
};

fn accept(words: LawWords) -> Result<Law, Refusal> {
    Law::accept(words, Dac::with_bits(14).expect("14 bits"))
}

/// Accepts the one and refuses the other, by this refusal and sentence.
fn just(accepted: LawWords, refused: LawWords, (what, value, allowed): Of, sentence: &str) {
    let law = accept(accepted);
    assert!(law.is_ok(), "{law:?}");
    let [least, most] = allowed;
    let refusal = Refusal {
        what,
        value,
        least,
        most,
    };
    assert_eq!(accept(refused), Err(refusal));
    assert_eq!(refusal.to_string(), sentence);
}

type Of = (What, i64, [i64; 2]);

const PARTS: [(Part, &str, u8); 6] = [
    (Part::Proportional, "Kp", 20),
    (Part::Integral, "Ki·Δt", 0),
    (Part::Derivative, "Kd/Δt", 0),
    (Part::Velocity, "the velocity feed-forward", 29),
    (Part::Acceleration, "the acceleration feed-forward", 29),
    (Part::Friction, "the friction feed-forward", 5),
];

/// The gain of a part.
fn gain(words: &mut LawWords, part: Part) -> &mut GainWord {
    match part {
        Part::Proportional => &mut words.kp,
        Part::Integral => &mut words.ki_dt,
        Part::Derivative => &mut words.kd_per_dt,
        Part::Velocity => &mut words.velocity_ff,
        Part::Acceleration => &mut words.acceleration_ff,
        Part::Friction => &mut words.friction_ff,
    }
}

/// The paper's words with one gain replaced.
fn with(part: Part, mantissa: i32, fraction_bits: u8) -> LawWords {
    let mut words = PAPER;
    *gain(&mut words, part) = GainWord::new(mantissa, fraction_bits);
    words
}

#[test]
fn the_papers_words_are_accepted_with_their_ranges() {
    let law = accept(PAPER).expect("accepted");
    assert_eq!(law.words(), &PAPER);
    assert_eq!(law.error_limit(), 1 << 18);
    // Q/(Ki·Δt) = 2^20/0.005
    assert_eq!(law.error_sum_limit(), 209_715_204);
    // (3.2·2^18 + 2^20 + 2·2^13)/50 = 38 076.1 counts
    assert_eq!(law.difference_limit(), 38_077);
    // 3.2·2^18 + 50·38 077 + 0.005·2^18 + 2^13: 22 bits of 31.
    assert_eq!(law.headroom_bits(), 9);
    assert_eq!(
        law.largest_term(Part::Proportional),
        1_717_986_918 << (18 + 3)
    );
    assert_eq!(law.largest_term(Part::Derivative), (50 * 38_077) << 32);
}

#[test]
fn the_exponents_of_error_and_integral_end_where_they_say() {
    let range = |error_bits| LawWords {
        error_bits,
        ..LawWords::NONE
    };
    for (inside, bits) in [(17, 16), (29, 30), (17, 0), (29, 255)] {
        let sentence = format!(
            "an error range of 2^{bits} counts is not supported; \
             the exponent must lie between 17 and 29"
        );
        let what = (What::ErrorBits, bits.into(), [17, 29]);
        just(range(inside), range(bits), what, &sentence);
    }
    let range = |integral_bits| LawWords {
        integral_bits,
        ..LawWords::NONE
    };
    for bits in [31, 255] {
        let sentence = format!(
            "an integral of 2^{bits} codes is not supported; the exponent must be at most 30"
        );
        just(
            range(30),
            range(bits),
            (What::IntegralBits, bits.into(), [0, 30]),
            &sentence,
        );
    }
}

#[test]
fn negative_words_are_refused_by_name() {
    for (part, name, _) in PARTS {
        for mantissa in [-1, i32::MIN] {
            let what = What::Gain(part, GainWord::new(mantissa, 32));
            let what = (what, mantissa.into(), [0, i32::MAX.into()]);
            let sentence = format!(
                "the word {mantissa}·2^-32 of {name} is negative; a gain must be at least 0"
            );
            just(with(part, 1, 32), with(part, mantissa, 32), what, &sentence);
        }
    }
}

#[test]
fn fraction_bits_are_bounded_on_both_sides() {
    for (part, name, least) in PARTS {
        let refused = |accepted, mantissa, bits: u8| {
            let word = GainWord::new(mantissa, bits);
            let what = (
                What::FractionBits(part, word),
                bits.into(),
                [least.into(), 32],
            );
            let sentence = format!(
                "the word {word} of {name} has {bits} fraction bits; \
                 it must have between {least} and 32 of them"
            );
            just(accepted, with(part, mantissa, bits), what, &sentence);
        };
        // No finer than the sum, not even a 0.
        for mantissa in [0, 1] {
            refused(with(part, mantissa, 32), mantissa, 33);
            refused(with(part, mantissa, 32), mantissa, 255);
        }
        if least > 0 {
            refused(with(part, 1, least), 1, least - 1);
        }
        assert!(accept(with(part, 0, 0)).is_ok(), "a 0 is exact");
    }
}

#[test]
fn a_term_has_two_factors_of_31_bits() {
    // Differences to 2^19 and 12 bits of shift, of which a mantissa below 2^30
    // takes one.
    let words = |mantissa| LawWords {
        integral_bits: 29,
        ..with(Part::Derivative, mantissa, 20)
    };
    just(
        words((1 << 30) - 1),
        words(1 << 30),
        (
            What::Term(Part::Derivative, GainWord::new(1 << 30, 20)),
            1 << 19,
            [0, (1 << 19) - 1],
        ),
        "the word 1073741824·2^-20 of Kd/Δt times 524288 needs more than 62 bits; \
         a smaller gain or a smaller range fits",
    );
}

#[test]
fn a_coarse_derivative_serves_no_large_differences() {
    let word = GainWord::new(1, 18);
    just(
        with(Part::Derivative, 1, 19),
        with(Part::Derivative, 1, 18),
        (What::Difference(word), 1 << 19, [0, 1 << 18]),
        "the word 1·2^-18 of Kd/Δt is too coarse for differences up to 524288 counts: \
         they must be at most 2^18",
    );
}

#[test]
fn the_terms_end_exactly_at_2_to_the_30_codes() {
    let (words, dac) = brim_full(AntiWindup::None);
    assert_eq!(Law::accept(words, dac).expect("fits").headroom_bits(), 0);
    let mut more = words;
    more.friction_ff.mantissa += 1;
    let refusal = Law::accept(more, dac).expect_err("a unit more");
    let (value, most) = ((1 << 30) + 1, 1 << 30);
    assert_eq!(
        refusal,
        Refusal {
            what: What::Terms,
            value,
            least: 0,
            most
        }
    );
    assert_eq!(
        refusal.to_string(),
        "the terms of the law add up to 1073741825 codes; they must stay within 1073741824: \
         smaller gains or smaller ranges fit"
    );
}

#[test]
fn the_sum_of_errors_holds_256_of_the_largest() {
    let refused = |reached: i64| {
        let sentence = format!(
            "the words let the sum of errors reach {reached} counts; \
             it must reach 67108864: 2^8 errors of the largest size"
        );
        ((What::ErrorSum, reached, [1 << 26, i64::MAX]), sentence)
    };
    // By its word: 2^(fi−1) = 2^(18+8).
    let (what, sentence) = refused(1 << 25);
    just(
        with(Part::Integral, 1, 27),
        with(Part::Integral, 1, 26),
        what,
        &sentence,
    );
    // By its range: Ki·Δt = 2^−6 gives 2^20·2^6 counts; a hair more does not.
    let (what, sentence) = refused((1 << 26) - 1);
    let word = |more| with(Part::Integral, (1 << 26) + more, 32);
    just(word(0), word(1), what, &sentence);
}

#[test]
fn a_filter_has_a_word_and_bits_for_the_accuracy() {
    let filtered = |mantissa, fd, smoothing, fraction_bits| LawWords {
        filter: Some(FilterWords {
            smoothing,
            fraction_bits,
        }),
        ..with(Part::Derivative, mantissa, fd)
    };
    let fine = filtered(1 << 20, 20, 1, 10);
    assert!(accept(filtered(1 << 20, 20, i32::MAX, 10)).is_ok());
    for smoothing in [0, -1, i32::MIN] {
        let what = (
            What::FilterSmoothing,
            smoothing.into(),
            [1, i32::MAX.into()],
        );
        let sentence = format!(
            "the filter's word is {smoothing}; Δt/(T_f + Δt)·2^31 must be between 1 and 2^31 − 1"
        );
        just(fine, filtered(1 << 20, 20, smoothing, 10), what, &sentence);
    }
    let bits = |accepted, refused, bits: i64, [least, most]: [i64; 2]| {
        let sentence = format!(
            "the filtered difference has {bits} fraction bits; the accuracy needs at least \
             {least}, and its range and the sum leave at most {most}"
        );
        just(
            accepted,
            refused,
            (What::FilterFractionBits, bits, [least, most]),
            &sentence,
        );
    };
    // Kd/Δt = 1: h ≥ 4, and a hair above 1: h ≥ 5. Differences to 2^19: h ≤ 10.
    bits(
        filtered(1 << 20, 20, 1, 4),
        filtered((1 << 20) + 1, 20, 1, 4),
        4,
        [5, 10],
    );
    bits(fine, filtered(1 << 20, 20, 1, 11), 11, [4, 10]);
    // A product no finer than the sum: h ≤ 32 − 24. No gain needs none.
    bits(
        filtered(1 << 20, 24, 1, 8),
        filtered(1 << 20, 24, 1, 9),
        9,
        [0, 8],
    );
    bits(filtered(0, 24, 1, 8), filtered(0, 24, 1, 9), 9, [0, 8]);
}

#[test]
fn a_filter_takes_no_more_than_2_to_the_29_counts() {
    // Errors to 2^29 differ by 2^30, and two such differences by 2^31.
    let limit = |filter| {
        let words = LawWords {
            kd_per_dt: GainWord::new(0, 32),
            error_bits: 29,
            filter,
            ..LawWords::NONE
        };
        accept(words).expect("accepted").difference_limit()
    };
    assert_eq!(limit(None), 1 << 30);
    let filter = FilterWords {
        smoothing: 1,
        fraction_bits: 0,
    };
    assert_eq!(limit(Some(filter)), 1 << 29);
}

#[test]
fn back_calculation_has_a_word() {
    let tracked = |tracking| LawWords {
        anti_windup: AntiWindup::BackCalculation { tracking },
        ..PAPER
    };
    assert!(accept(tracked(i32::MAX)).is_ok());
    for tracking in [0, -1, i32::MIN] {
        let what = (What::Tracking, tracking.into(), [1, i32::MAX.into()]);
        let sentence =
            format!("the tracking word is {tracking}; Δt/T_t·2^31 must be between 1 and 2^31 − 1");
        just(tracked(1), tracked(tracking), what, &sentence);
    }
}

#[test]
fn the_rule_is_that_of_its_tables() {
    let mut random = Random(17);
    let [mut accepted, mut refused] = [0, 0];
    for round in 0..400_000_u32 {
        let (mut words, dac) = random_words(&mut random);
        if round % 2 == 1 {
            // One thing moved a little: beside a limit more often than not.
            let (part, _, _) = random.one_of(&PARTS);
            let any = random.bits(0, 34);
            match random.between(0, 3) {
                0 => words.integral_bits += 1,
                1 => words.error_bits += 1,
                2 => *gain(&mut words, part) = GainWord::new(1, any),
                _ => *gain(&mut words, part) = GainWord::new(i32::MAX, any),
            }
        }
        let law = Law::accept(words, dac);
        assert_eq!(
            law.is_ok(),
            allowed(&words, dac),
            "{law:?} for {words:?}, {dac:?}"
        );
        let Ok(law) = law else {
            refused += 1;
            continue;
        };
        accepted += 1;
        let ranges = Ranges::of(&words, dac.bits());
        assert_eq!(i128::from(law.difference_limit()), ranges.difference);
        assert_eq!(i128::from(law.error_limit()), ranges.error);
        assert_eq!(law.headroom_bits(), 62 - ranges.largest.ilog2());
    }
    println!("{accepted} accepted, {refused} refused");
    assert!(accepted > 40_000 && refused > 40_000);
}

fn any_word() -> impl Strategy<Value = GainWord> {
    let mantissa = prop_oneof![any::<i32>(), 0..=1000_i32, Just(i32::MAX), Just(i32::MIN)];
    let bits = prop_oneof![any::<u8>(), 0..=33_u8];
    (mantissa, bits).prop_map(|(mantissa, bits)| GainWord::new(mantissa, bits))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn no_words_at_all_panic_or_pass_their_limits(
        gains in prop::array::uniform6(any_word()),
        error_bits in prop_oneof![any::<u8>(), 17..=29_u8],
        integral_bits in prop_oneof![any::<u8>(), 0..=32_u8],
        filter in any::<Option<(i32, u8)>>(),
        tracking in any::<Option<i32>>(),
        measured in any::<bool>(),
        dac_bits in 2..=24_u32,
    ) {
        let [kp, ki_dt, kd_per_dt, velocity_ff, acceleration_ff, friction_ff] = gains;
        let words = LawWords {
            kp, ki_dt, kd_per_dt, velocity_ff, acceleration_ff, friction_ff,
            error_bits, integral_bits,
            derivative: if measured { Derivative::Measurement } else { Derivative::Error },
            filter: filter.map(|(smoothing, fraction_bits)| FilterWords { smoothing, fraction_bits }),
            anti_windup: tracking.map_or(AntiWindup::Clamp, |tracking| AntiWindup::BackCalculation { tracking }),
        };
        let dac = Dac::with_bits(dac_bits).expect("2 to 24 bits");
        let law = Law::accept(words, dac);
        prop_assert_eq!(law.is_ok(), allowed(&words, dac));
        if let Err(refusal) = law {
            prop_assert!(!refusal.to_string().is_empty());
        }
    }
}
