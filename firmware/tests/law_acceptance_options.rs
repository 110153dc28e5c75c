//! Filters and treatments of wind-up that the axis' law accepts: every
//! demand from both sides, every error with its sentence.

mod exact;

use exact::just::{PAPER, accept, just, refusal, with};
use firmware::GainWord;
use firmware::law::{AntiWindup, FilterWords, LawWords, Part};
use firmware::refusal::What;

#[test]
fn a_filter_has_a_word_and_bits_for_the_accuracy() {
    let filtered = |mantissa, fd, smoothing, fraction_bits| LawWords {
        filter: Some(FilterWords {
            smoothing,
            fraction_bits,
        }),
        ..with(PAPER, Part::Derivative, mantissa, fd)
    };
    let fine = filtered(1 << 20, 20, 1, 10);
    assert!(accept(filtered(1 << 20, 20, i32::MAX, 10)).is_ok());
    for smoothing in [0, -1, i32::MIN] {
        let error = just(fine, filtered(1 << 20, 20, smoothing, 10));
        let wanted = refusal(What::FilterSmoothing, smoothing.into(), 1, i32::MAX.into());
        assert_eq!(error, wanted);
        assert_eq!(
            error.to_string(),
            format!(
                "the filter's word is {smoothing}; Δt/(T_f + Δt)·2^31 must be between 1 and 2^31 − 1"
            )
        );
    }
    // Kd/Δt = 1: h ≥ 4, and a hair above 1: h ≥ 5. Differences to 2^19: h ≤ 10.
    let error = just(
        filtered(1 << 20, 20, 1, 4),
        filtered((1 << 20) + 1, 20, 1, 4),
    );
    assert_eq!(error, refusal(What::FilterFractionBits, 4, 5, 10));
    assert_eq!(
        error.to_string(),
        "the filtered difference has 4 fraction bits; the accuracy needs at least 5, \
         and its range and the sum leave at most 10"
    );
    let error = just(fine, filtered(1 << 20, 20, 1, 11));
    assert_eq!(error, refusal(What::FilterFractionBits, 11, 4, 10));
    // A product no finer than the sum: h ≤ 38 − 30. No gain needs none.
    let error = just(filtered(1 << 20, 30, 1, 8), filtered(1 << 20, 30, 1, 9));
    assert_eq!(error, refusal(What::FilterFractionBits, 9, 0, 8));
    let error = just(filtered(0, 30, 1, 8), filtered(0, 30, 1, 9));
    assert_eq!(error, refusal(What::FilterFractionBits, 9, 0, 8));
}

#[test]
fn a_filter_takes_no_more_than_2_to_the_29_counts() {
    // Errors to 2^29 differ by 2^30, and two such differences by 2^31.
    let words = |filter| LawWords {
        kd_per_dt: GainWord::new(1, 32),
        error_bits: 29,
        sum_fraction_bits: 34,
        filter,
        ..LawWords::NONE
    };
    let filter = FilterWords {
        smoothing: 1,
        fraction_bits: 0,
    };
    let limit = |filter| accept(words(filter)).expect("accepted").slope_limit();
    assert_eq!(limit(None), 1 << 30);
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
        let error = just(tracked(1), tracked(tracking));
        let wanted = refusal(What::Tracking, tracking.into(), 1, i32::MAX.into());
        assert_eq!(error, wanted);
        assert_eq!(
            error.to_string(),
            format!("the tracking word is {tracking}; Δt/T_t·2^31 must be between 1 and 2^31 − 1")
        );
    }
}
