//! Words for property tests.

use firmware::{GainWord, Pid, PidWords};
use proptest::prelude::*;

fn mantissa() -> impl Strategy<Value = i32> {
    prop_oneof![6 => 0..=i32::MAX, 2 => Just(i32::MAX), 1 => Just(0), 1 => Just(1)]
}

/// Words over the whole accepted range, its corners included.
pub(crate) fn accepted_words() -> impl Strategy<Value = Pid> {
    (17..=29_u8)
        .prop_flat_map(|error_bits| {
            let word = |min: u8, max: u8| {
                let bits = prop_oneof![3 => min..=max, 1 => Just(min)];
                (mantissa(), bits)
            };
            (
                Just(error_bits),
                word(error_bits + 2, 32),
                word(error_bits + 11, 40),
                word(3, 32),
            )
        })
        .prop_filter_map("the derivative has no word", |(error_bits, p, i, d)| {
            let word = |(mantissa, fraction_bits)| GainWord::new(mantissa, fraction_bits);
            let words = PidWords {
                kp: word(p),
                ki_dt: word(i),
                kd_per_dt: word(d),
                error_bits,
            };
            Pid::accept(words).ok()
        })
}
