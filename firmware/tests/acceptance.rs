//! Acceptance of words: every bound from both sides, every error, and no
//! panic for any word at all.

mod exact;

use exact::words::accepted_words;
use firmware::gains::DERIVATIVE_OUTWEIGHS;
use firmware::refusal::What;
use firmware::{
    Controller, ControllerState, Dac, Gain, GainWord, Pid, PidState, PidWords, Refusal,
    SetpointTable,
};
use proptest::prelude::*;

/// The paper's gains at 1 ms.
const PAPER: PidWords = PidWords {
    kp: GainWord::new(1_717_986_918, 29),
    ki_dt: GainWord::new(1_374_389_535, 38),
    kd_per_dt: GainWord::new(1_677_721_600, 25),
    error_bits: 18,
};

/// `PAPER` with one gain replaced.
fn with(gain: Gain, mantissa: i32, fraction_bits: u8) -> PidWords {
    let word = GainWord::new(mantissa, fraction_bits);
    match gain {
        Gain::Proportional => PidWords { kp: word, ..PAPER },
        Gain::Integral => PidWords {
            ki_dt: word,
            ..PAPER
        },
        Gain::Derivative => PidWords {
            kd_per_dt: word,
            ..PAPER
        },
    }
}

const GAINS: [Gain; 3] = [Gain::Proportional, Gain::Integral, Gain::Derivative];

/// Refusal with setting, value, and the range that is accepted.
fn refusal(what: What, value: i64, [least, most]: [i64; 2]) -> Refusal {
    Refusal {
        what,
        value,
        least,
        most,
    }
}

#[test]
fn the_papers_words_are_accepted_with_their_ranges() {
    let pid = Pid::accept(PAPER).expect("accepted");
    assert_eq!(pid.words(), &PAPER);
    assert_eq!(pid.error_limit(), 1 << 18);
    assert_eq!(pid.error_sum_limit(), 1 << 35);
    // 50 codes per count never outweigh the rest within 2·E.
    assert_eq!(pid.slope_limit(), 1 << 19);
}

#[test]
fn error_ranges_from_17_to_29_bits_are_accepted() {
    for error_bits in 0..=u8::MAX {
        let words = PidWords {
            kp: GainWord::new(1, 32),
            ki_dt: GainWord::new(1, 40),
            kd_per_dt: GainWord::new(1, 32),
            error_bits,
        };
        let result = Pid::accept(words);
        if (17..=29).contains(&error_bits) {
            assert_eq!(result.map(|pid| pid.error_limit()), Ok(1 << error_bits));
        } else {
            assert_eq!(
                result,
                Err(refusal(What::ErrorBits, error_bits.into(), [17, 29]))
            );
        }
    }
}

#[test]
fn negative_words_are_rejected_by_name() {
    for gain in GAINS {
        for mantissa in [-1, i32::MIN] {
            let what = What::Gain(gain.part(), GainWord::new(mantissa, 30));
            assert_eq!(
                Pid::accept(with(gain, mantissa, 30)),
                Err(refusal(what, mantissa.into(), [0, i32::MAX.into()]))
            );
        }
    }
}

#[test]
fn fraction_bits_are_bounded_on_both_sides() {
    // E = 2^18; a mantissa of 1 gives no derivative a free exponent.
    for (gain, min, max) in [
        (Gain::Proportional, 20, 32),
        (Gain::Integral, 29, 40),
        (Gain::Derivative, 19, 32),
    ] {
        for mantissa in [0, 1, DERIVATIVE_OUTWEIGHS - 1] {
            for fraction_bits in 0..=u8::MAX {
                let result = Pid::accept(with(gain, mantissa, fraction_bits));
                if (min..=max).contains(&fraction_bits) {
                    assert!(result.is_ok(), "{result:?}");
                } else {
                    let word = GainWord::new(mantissa, fraction_bits);
                    let what = What::PidFractionBits(gain.part(), word);
                    let error = refusal(what, fraction_bits.into(), [min, max].map(i64::from));
                    assert_eq!(result, Err(error));
                }
            }
        }
    }
}

#[test]
fn a_full_mantissa_frees_the_derivative_up_to_2_to_the_27() {
    for fraction_bits in 0..=32 {
        let most = i32::try_from(1_i64 << (27 + fraction_bits)).unwrap_or(i32::MAX);
        for mantissa in [DERIVATIVE_OUTWEIGHS, 1 << 30, (1 << 30) + 1, i32::MAX] {
            let result = Pid::accept(with(Gain::Derivative, mantissa, fraction_bits));
            if mantissa <= most {
                let pid = result.expect("at most 2^27 codes per count");
                // D is the first difference that outweighs the rest, or 2·E.
                let gain = f64::from(mantissa) / f64::from(fraction_bits).exp2();
                let first = (f64::from(DERIVATIVE_OUTWEIGHS) / gain).ceil();
                assert_eq!(f64::from(pid.slope_limit()), first.min(524_288.0));
            } else {
                let word = GainWord::new(mantissa, fraction_bits);
                let what = What::PidDerivative(word);
                let error = refusal(what, mantissa.into(), [0, most.into()]);
                assert_eq!(result, Err(error));
            }
        }
    }
}

#[test]
fn the_declared_sum_shrinks_with_the_mantissa() {
    for (mantissa, bits) in [
        (0, 37),
        ((1 << 29) - 1, 37),
        (1 << 29, 36),
        ((1 << 30) - 1, 36),
        (1 << 30, 35),
        (i32::MAX, 35),
    ] {
        let pid = Pid::accept(with(Gain::Integral, mantissa, 38)).expect("accepted");
        assert_eq!(pid.error_sum_limit(), 1 << bits);
        // Never more than 2^28 codes.
        assert!((i128::from(mantissa) << bits) < 1 << (28 + 38));
    }
}

#[test]
fn every_message_names_gain_word_and_what_is_allowed() {
    for (words, message) in [
        (
            PidWords {
                error_bits: 30,
                ..PAPER
            },
            "an error range of 2^30 counts is not supported; \
             the exponent must lie between 17 and 29",
        ),
        (
            with(Gain::Proportional, -7, 25),
            "the word -7·2^-25 of Kp is negative; a gain must be at least 0",
        ),
        (
            with(Gain::Integral, 5, 28),
            "the word 5·2^-28 of Ki·Δt has 28 fraction bits; \
             it must have between 29 and 40 of them",
        ),
        (
            with(Gain::Derivative, i32::MAX, 2),
            "the word 2147483647·2^-2 of Kd/Δt is larger than 2^27 codes per count; \
             with 2 fraction bits the mantissa must be at most 536870912",
        ),
    ] {
        let error = Pid::accept(words).expect_err("rejected");
        assert_eq!(error.to_string(), message);
    }
}

fn any_word() -> impl Strategy<Value = GainWord> {
    let mantissa = prop_oneof![
        3 => any::<i32>(),
        1 => Just(i32::MIN),
        1 => Just(i32::MAX),
        1 => Just(0),
        1 => Just(1),
    ];
    let fraction_bits = prop_oneof![1 => any::<u8>(), 4 => 0..=41_u8];
    (mantissa, fraction_bits).prop_map(|(mantissa, bits)| GainWord::new(mantissa, bits))
}

fn any_words() -> impl Strategy<Value = PidWords> {
    let error_bits = prop_oneof![1 => any::<u8>(), 6 => 17..=29_u8];
    (any_word(), any_word(), any_word(), error_bits).prop_map(
        |(kp, ki_dt, kd_per_dt, error_bits)| PidWords {
            kp,
            ki_dt,
            kd_per_dt,
            error_bits,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn no_word_panics(words in any_words(), counts in prop::collection::vec(any::<i32>(), 1..8)) {
        let Ok(pid) = Pid::accept(words) else { return Ok(()) };
        let controller = Controller::new(
            pid,
            Dac::with_bits(24).unwrap(),
            SetpointTable::<1>::resting_at(0),
        );
        let mut state = ControllerState::default();
        for count in counts {
            let output = controller.tick(&mut state, count);
            prop_assert_eq!(output.error_counts, count.wrapping_neg());
            prop_assert!((-(1 << 23)..1 << 23).contains(&output.code));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    /// The firmware's 64-bit products and sums against the same in 128 bits
    /// with 40 fraction bits, where nothing can wrap.
    #[test]
    fn no_accepted_word_overflows(
        pid in accepted_words(),
        errors in prop::collection::vec(
            prop_oneof![2 => any::<i32>(), 1 => -1_000_000..1_000_000, 1 => Just(i32::MIN)],
            1..50,
        ),
    ) {
        let words = pid.words();
        let (e_limit, d) = (i128::from(pid.error_limit()), i128::from(pid.slope_limit()));
        prop_assert!(d >= 1 && d <= 2 * e_limit);
        prop_assert!(i128::from(pid.error_sum_limit()) >= 256 * e_limit);

        let product = |word: GainWord, counts: i128| {
            (i128::from(word.mantissa) * counts) << (40 - word.fraction_bits)
        };
        let (mut state, mut sum_of_errors, mut previous) = (PidState::default(), 0, None);
        for error in errors {
            let e = i128::from(error).clamp(-e_limit, e_limit);
            let slope = e - previous.replace(e).unwrap_or(e);
            sum_of_errors += e;
            let y = product(words.kp, e)
                + product(words.ki_dt, sum_of_errors)
                + product(words.kd_per_dt, slope.clamp(-d, d));
            prop_assert_eq!(pid.step(&mut state, error).sum.to_bits(), y);
        }
    }
}
