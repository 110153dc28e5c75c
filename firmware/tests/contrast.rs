//! The measure of `accuracy.rs` on words that the firmware rejects: each kind of
//! shortness must show as more than one code.
//!
//! Such words cannot be run, so the exact law of their values stands for them;
//! that firmware and law of the values are the same is a test of
//! `accuracy.rs`, `the_sum_is_the_law_of_the_words_exactly`.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

mod exact;

use exact::{ExactLaw, Gains, exact_code, finest_word, half_a_unit_beside, word_with};
use firmware::{GainWord, PidWords};

/// Largest difference of the codes of two exact laws.
fn codes_apart(one: &Gains, other: &Gains, samples: u32, mut next: impl FnMut(i64) -> i64) -> i64 {
    let (mut one, mut other) = (ExactLaw::new(one), ExactLaw::new(other));
    (0..samples).fold(0, |worst, _| {
        let error = next(0);
        let codes = [&mut one, &mut other].map(|law| exact_code(&law.step(error), 24));
        worst.max((codes[0] - codes[1]).abs())
    })
}

#[test]
fn words_that_are_too_short_miss_by_more_than_one_code() {
    // The coarsest words that are accepted for E = 2^24, and each of them three
    // bits shorter.
    let coarsest = [26_u8, 40, 25];
    let run = |bits: [u8; 3]| {
        let [kp, ki_dt, kd_per_dt] = bits.map(|bits| GainWord::new(1, bits));
        let words = PidWords {
            kp,
            ki_dt,
            kd_per_dt,
            error_bits: 24,
        };
        let gains = half_a_unit_beside(&words);
        let (mut k, limit, stretch) = (0, 1_i64 << 24, 1_i64 << 15);
        codes_apart(&gains, &Gains::of_words(&words), 32_868, |_| {
            k += 1;
            if k <= stretch || k % 2 == 0 {
                limit
            } else {
                -limit
            }
        })
    };
    assert_eq!(run(coarsest), 1);
    for short in 0..3 {
        let mut bits = coarsest;
        bits[short] -= 3;
        let apart = run(bits);
        println!("fraction bits {bits:?}: {apart} codes");
        assert!(apart > 1, "{bits:?}: {apart}");
    }
}

#[test]
fn a_common_format_of_24_bits_loses_the_integral_gain() {
    // Kd/Δt = 500 leaves 14 fraction bits, in which Ki·Δt = 0.0005 is 8/2^14.
    let gains = Gains::of("3.2", "5", "0.05", 100_000);
    let common = Gains {
        kp: exact::value(word_with(&gains.kp, 14).expect("fits")),
        ki_dt: exact::value(word_with(&gains.ki_dt, 14).expect("fits")),
        kd_per_dt: exact::value(word_with(&gains.kd_per_dt, 14).expect("fits")),
    };
    let own = Gains::of_words(&gains.words(18).expect("words"));
    let constant = |_| 1_000;
    assert!(codes_apart(&gains, &own, 10_000, constant) <= 1);
    let apart = codes_apart(&gains, &common, 10_000, constant);
    println!("common format: {apart} codes after 1 s at 1000 counts");
    assert!(apart > 100, "{apart}");
}

#[test]
fn thirty_two_fraction_bits_would_not_do_for_the_integral() {
    // |e| = 2^17 at 10 µs for 2 s, then back to a sum of zero.
    let gains = Gains::of("0.001", "5", "0", 10_000);
    let own = Gains::of_words(&gains.words(18).expect("words"));
    let coarse = Gains {
        ki_dt: exact::value(finest_word(&gains.ki_dt, 32).expect("fits")),
        ..own.clone()
    };
    let constant = |_| 1 << 17;
    assert!(codes_apart(&gains, &own, 200_000, constant) <= 1);
    let apart = codes_apart(&gains, &coarse, 200_000, constant);
    println!("32 fraction bits: {apart} codes");
    assert!(apart > 1, "{apart}");
}
