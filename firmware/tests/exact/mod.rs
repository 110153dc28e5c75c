//! References that the law is measured against: [`model`], its definition in
//! integers of 128 bits, and [`rational`], the law of decimal gains; with the
//! random words and inputs of an adversary.
#![allow(
    dead_code,
    reason = "every test file takes the part of this module that it needs"
)]
#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

pub(crate) mod inputs;
pub(crate) mod model;
pub(crate) mod rational;
pub(crate) mod words;

pub(crate) use model::Sample;

use firmware::law::{Begin, Law, LawInput, LawState};
use firmware::output::Output;

/// One sample of the firmware.
pub(crate) fn sample(
    law: &Law,
    output: &Output,
    state: &mut LawState,
    input: &LawInput,
    begin: Option<Begin>,
) -> Sample {
    let before = *state;
    let code = match begin {
        None => law.step(output, state, input),
        Some(begin) => law.begin(output, state, input, begin),
    };
    let told = state.take_left_range();
    // After a first sample its own error is the one before: no difference.
    let mut copy = if begin.is_some() { *state } else { before };
    let terms = law.terms(&mut copy, input);
    let integral = match begin {
        None | Some(Begin::GoingOn) => bits(before.integral()) + bits(terms.step),
        Some(Begin::AtRest) => bits(terms.step),
        Some(Begin::FromCode | Begin::OtherGains) => bits(state.integral()),
    };
    let sum = bits(terms.direct) + integral;
    let code = code.into();
    Sample { code, sum, told }
}

fn bits(codes: firmware::Codes) -> i128 {
    codes.to_bits().into()
}

/// SplitMix64: seeded, the same on every machine.
#[derive(Debug, Clone)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform between `low` and `high`, both included.
    pub(crate) fn between(&mut self, low: i64, high: i64) -> i64 {
        let span = (high - low).unsigned_abs() + 1;
        low + i64::try_from(self.next() % span).expect("a span below 2^63")
    }

    /// The same for small numbers; `low` where `high` lies below.
    pub(crate) fn bits(&mut self, low: u8, high: u8) -> u8 {
        let bits = self.between(i64::from(low), i64::from(high.max(low)));
        u8::try_from(bits).expect("a small number")
    }

    /// Any word.
    pub(crate) fn word(&mut self) -> i32 {
        let word = self.between(i32::MIN.into(), i32::MAX.into());
        i32::try_from(word).expect("32 bits")
    }

    /// True once in `n`.
    pub(crate) fn one_in(&mut self, n: i64) -> bool {
        self.between(1, n) == 1
    }

    pub(crate) fn one_of<T: Copy>(&mut self, of: &[T]) -> T {
        let last = i64::try_from(of.len()).expect("short") - 1;
        of[usize::try_from(self.between(0, last)).expect("short")]
    }
}
