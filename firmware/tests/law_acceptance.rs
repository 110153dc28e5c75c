//! Words that the axis' law accepts: every demand of
//! `firmware::law::words` from both sides, and every error with its sentence;
//! filter and treatment of wind-up are in `law_acceptance_options.rs`.
//! The whole rule over random words is measured in `law_rule.rs`.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::axis_law::{Ranges, two};
use exact::axis_words::largest;
use exact::just::{PAPER, PARTS, accept, just, refusal, with};
use firmware::law::{Law, LawWords, Part};
use firmware::refusal::What;
use firmware::{Dac, GainWord};

#[test]
fn the_papers_words_are_accepted_with_their_ranges() {
    let law = accept(PAPER).expect("accepted");
    assert_eq!(law.words(), &PAPER);
    assert_eq!(law.error_limit(), 1 << 18);
    // Q/(Ki·Δt) = 2^20/0.005
    assert_eq!(law.error_sum_limit(), 209_715_199);
    // (3.2·2^18 + 2^20 + 2·2^13)/50 codes, rounded up
    assert_eq!(law.slope_limit(), 38_077);
    // 3·2^20 + 3·2^13 + 2·3.2·2^18 + 2^20 + 2^14: 23 bits of 62 − 38 = 24.
    assert_eq!(law.headroom_bits(), 1);
}

#[test]
fn the_exponents_of_sum_and_error_end_where_they_say() {
    let sum = |sum_fraction_bits| LawWords {
        sum_fraction_bits,
        ..LawWords::NONE
    };
    assert_eq!(
        just(sum(33), sum(32)),
        refusal(What::SumFractionBits, 32, 33, 40)
    );
    let error = just(sum(40), sum(41));
    assert_eq!(
        error.to_string(),
        "a sum with 41 fraction bits is not supported; it must have 33 to 40"
    );
    let range = |error_bits| LawWords {
        error_bits,
        ..LawWords::NONE
    };
    assert_eq!(
        just(range(17), range(16)),
        refusal(What::ErrorBits, 16, 17, 29)
    );
    assert_eq!(
        just(range(29), range(30)).to_string(),
        "an error range of 2^30 counts is not supported; the exponent must lie between 17 and 29"
    );
}

#[test]
fn negative_words_are_refused_by_name() {
    for (part, name) in PARTS {
        for mantissa in [-1, i32::MIN] {
            let refused = with(PAPER, part, mantissa, 36);
            let error = just(with(PAPER, part, 1, 36), refused);
            let word = GainWord::new(mantissa, 36);
            let most = i64::from(i32::MAX);
            let wanted = refusal(What::Gain(part, word), i64::from(mantissa), 0, most);
            assert_eq!(error, wanted);
            assert_eq!(
                error.to_string(),
                format!(
                    "the word {mantissa}·2^-36 of {name} is negative; a gain must be at least 0"
                )
            );
        }
    }
}

#[test]
fn fraction_bits_are_bounded_on_both_sides() {
    for (part, name) in PARTS {
        // No finer than the sum, not even a 0.
        for mantissa in [0, 1] {
            let error = just(
                with(PAPER, part, mantissa, 38),
                with(PAPER, part, mantissa, 39),
            );
            assert!(matches!(error.what, What::LawFractionBits(..)));
            assert_eq!(error.most, 38);
        }
        let least = match part {
            Part::Proportional => 20,
            Part::Velocity | Part::Acceleration => 35,
            Part::Friction => 5,
            Part::Integral | Part::Derivative => continue,
        };
        let error = just(with(PAPER, part, 1, least), with(PAPER, part, 1, least - 1));
        let wanted = format!(
            "the word 1·2^-{0} of {name} has {0} fraction bits; it must have at least {least} of \
             them, and at most the 38 of the sum",
            least - 1
        );
        assert_eq!(error.to_string(), wanted);
        assert!(accept(with(PAPER, part, 0, 0)).is_ok(), "a 0 is exact");
    }
}

#[test]
fn a_sum_too_coarse_for_feed_forward_takes_none() {
    // At F = 34 a feed-forward of 2^30 could be off by 2^30·2^−35, 1/32 each.
    for part in [Part::Velocity, Part::Acceleration] {
        let [fine, coarse] = [35, 34].map(|sum_fraction_bits| {
            let words = LawWords {
                sum_fraction_bits,
                ..LawWords::NONE
            };
            with(words, part, 1, sum_fraction_bits)
        });
        let error = just(fine, coarse);
        assert!(matches!(error.what, What::LawFractionBits(..)), "{error:?}");
        assert_eq!((error.least, error.most), (35, 34));
        assert!(accept(with(coarse, part, 0, 0)).is_ok());
    }
}

#[test]
fn a_term_has_two_factors_of_31_bits() {
    // 2^18 counts leave 12 bits of shift to the error.
    let error = just(
        with(PAPER, Part::Proportional, 1 << 30, 26),
        with(PAPER, Part::Proportional, 1 << 30, 25),
    );
    assert_eq!(
        error.to_string(),
        "the word 1073741824·2^-25 of Kp times 262144 needs more than 62 bits; \
         a smaller gain or a smaller range fits"
    );
    assert!(matches!(error.what, What::Term(Part::Proportional, _)));
}

#[test]
fn a_coarse_derivative_serves_no_large_differences() {
    let error = just(
        with(PAPER, Part::Derivative, 1, 19),
        with(PAPER, Part::Derivative, 1, 18),
    );
    let word = GainWord::new(1, 18);
    assert_eq!(error, refusal(What::Difference(word), 1 << 19, 0, 1 << 18));
    assert_eq!(
        error.to_string(),
        "the word 1·2^-18 of Kd/Δt is too coarse for differences up to 524288 counts: \
         they must be at most 2^18"
    );
}

#[test]
fn the_sum_ends_exactly_below_62_bits() {
    // Filled to the last unit: the friction's word is one of 2^−F codes.
    for f in [35_u8, 38, 40] {
        let dac = Dac::with_bits(2).expect("2 bits");
        let mut words = LawWords {
            velocity_ff: GainWord::new(1 << 30, f),
            acceleration_ff: GainWord::new(1 << 30, f),
            sum_fraction_bits: f,
            integral_bits: 50 - f,
            ..LawWords::NONE
        };
        let left = two(62) - 1 - largest(&words, &Ranges::of(&words, dac));
        let word = |x: i128, bits| GainWord::new(i32::try_from(x).expect("31 bits"), bits);
        words.kp = word(left.div_euclid(two(30)), f - 13);
        words.friction_ff = word(left.rem_euclid(two(30)), f);
        assert_eq!(largest(&words, &Ranges::of(&words, dac)), two(62) - 1);
        assert_eq!(Law::accept(words, dac).expect("fits").headroom_bits(), 0);
        words.friction_ff.mantissa += 1;
        let error = Law::accept(words, dac).expect_err("2^62");
        let bits = i64::from(f);
        assert_eq!(error, refusal(What::Terms, bits, 0, bits - 1));
        let codes = 62 - f;
        let sentence = format!(
            "the terms of the law add up to more than 2^{codes} codes; \
             a sum with fewer than {f} fraction bits or smaller gains fit"
        );
        assert_eq!(error.to_string(), sentence);
    }
}

#[test]
fn the_sum_of_errors_holds_256_of_the_largest() {
    // By its word: 2^(fi−1) = 2^(18+8).
    let error = just(
        with(PAPER, Part::Integral, 1, 27),
        with(PAPER, Part::Integral, 1, 26),
    );
    assert_eq!(
        error.to_string(),
        "the words let the sum of errors reach 33554432 counts; \
         it must reach 67108864: 2^8 errors of the largest size"
    );
    // By its range: Ki·Δt = 2^−6 gives 2^20·2^6 counts; a hair more does not.
    let error = just(
        with(PAPER, Part::Integral, 1 << 30, 36),
        with(PAPER, Part::Integral, (1 << 30) + 1, 36),
    );
    let (reached, wanted) = ((1 << 26) - 1, 1 << 26);
    assert_eq!(error, refusal(What::ErrorSum, reached, wanted, i64::MAX));
}
