//! The paper's gains as words of the axis' law, and what lies just beside
//! the limits of acceptance.

use firmware::law::{Law, LawWords, Part};
use firmware::refusal::What;
use firmware::{Dac, GainWord, Refusal};

/// The paper's gains at 1 ms.
pub(crate) const PAPER: LawWords = LawWords {
    kp: GainWord::new(1_717_986_918, 29),
    ki_dt: GainWord::new(1_374_389_535, 38),
    kd_per_dt: GainWord::new(1_677_721_600, 25),
    error_bits: 18,
    ..LawWords::NONE
};

pub(crate) fn accept(words: LawWords) -> Result<Law, Refusal> {
    Law::accept(words, Dac::with_bits(14).expect("14 bits"))
}

/// Accepts the one, and gives the error of the other.
pub(crate) fn just(accepted: LawWords, refused: LawWords) -> Refusal {
    let law = accept(accepted);
    assert!(law.is_ok(), "{law:?}");
    accept(refused).expect_err("just beyond the limit")
}

pub(crate) const PARTS: [(Part, &str); 6] = [
    (Part::Proportional, "Kp"),
    (Part::Integral, "Ki·Δt"),
    (Part::Derivative, "Kd/Δt"),
    (Part::Velocity, "the velocity feed-forward"),
    (Part::Acceleration, "the acceleration feed-forward"),
    (Part::Friction, "the friction feed-forward"),
];

/// `words` with one gain replaced.
pub(crate) fn with(words: LawWords, part: Part, mantissa: i32, fraction_bits: u8) -> LawWords {
    let mut words = words;
    *match part {
        Part::Proportional => &mut words.kp,
        Part::Integral => &mut words.ki_dt,
        Part::Derivative => &mut words.kd_per_dt,
        Part::Velocity => &mut words.velocity_ff,
        Part::Acceleration => &mut words.acceleration_ff,
        Part::Friction => &mut words.friction_ff,
    } = GainWord::new(mantissa, fraction_bits);
    words
}

/// Refusal with setting, value, and the range that is accepted.
pub(crate) fn refusal(what: What, value: i64, least: i64, most: i64) -> Refusal {
    Refusal {
        what,
        value,
        least,
        most,
    }
}
