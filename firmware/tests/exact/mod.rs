//! The law in exact rationals, words from decimals, and error sequences: what
//! the firmware is measured against.
#![allow(
    dead_code,
    reason = "every test file takes the part of this module that it needs"
)]
#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

pub(crate) mod axis_inputs;
pub(crate) mod axis_law;
pub(crate) mod axis_words;
pub(crate) mod decimal_law;
pub(crate) mod errors;
pub(crate) mod just;
pub(crate) mod words;

use firmware::{CodeSum, GainWord, PidWords};
use num_bigint::BigInt;
use num_rational::Ratio;

/// An exact number.
pub(crate) type Exact = Ratio<BigInt>;

/// `numerator/denominator`.
pub(crate) fn ratio(numerator: i64, denominator: i64) -> Exact {
    Exact::new(BigInt::from(numerator), BigInt::from(denominator))
}

/// `2^exponent`, for exponents of either sign.
pub(crate) fn power_of_two(exponent: i32) -> Exact {
    let power = Exact::from_integer(BigInt::from(1) << exponent.unsigned_abs());
    if exponent < 0 { power.recip() } else { power }
}

/// The number that a decimal such as `3.2`, `5e-4` or `1.25e+3` writes down.
pub(crate) fn decimal(text: &str) -> Exact {
    let (digits, exponent) = match text.split_once(['e', 'E']) {
        Some((digits, exponent)) => (digits, exponent.parse().expect("a decimal exponent")),
        None => (text, 0_i32),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let mantissa: BigInt = format!("{whole}{fraction}").parse().expect("digits");
    let exponent = exponent - i32::try_from(fraction.len()).expect("a short fraction");
    let scale = Exact::from_integer(BigInt::from(10).pow(exponent.unsigned_abs()));
    let mantissa = Exact::from_integer(mantissa);
    if exponent < 0 {
        mantissa / scale
    } else {
        mantissa * scale
    }
}

/// `gain·2^fraction_bits` to the nearest integer, as a word; `None` where the
/// mantissa needs more than 31 bits.
pub(crate) fn word_with(gain: &Exact, fraction_bits: u8) -> Option<GainWord> {
    let scaled = gain * power_of_two(i32::from(fraction_bits)) + ratio(1, 2);
    let mantissa = i32::try_from(scaled.floor().to_integer()).ok()?;
    Some(GainWord::new(mantissa, fraction_bits))
}

/// The word of `gain` with the most fraction bits, at most `max`.
pub(crate) fn finest_word(gain: &Exact, max: u8) -> Option<GainWord> {
    (0..=max).rev().find_map(|bits| word_with(gain, bits))
}

/// The value of a word.
pub(crate) fn value(word: GainWord) -> Exact {
    Exact::from_integer(BigInt::from(word.mantissa)) / power_of_two(i32::from(word.fraction_bits))
}

/// The value of a sum \[codes\].
pub(crate) fn sum_value(sum: CodeSum) -> Exact {
    Exact::new_raw(BigInt::from(sum.to_bits()), BigInt::from(1_u64 << 40))
}

/// Decimal gains per sample: `Kp`, `Ki·Δt`, `Kd/Δt`, exactly.
#[derive(Debug, Clone)]
pub(crate) struct Gains {
    pub(crate) kp: Exact,
    pub(crate) ki_dt: Exact,
    pub(crate) kd_per_dt: Exact,
}

impl Gains {
    /// From the decimals of a run file and a sample time.
    pub(crate) fn of(kp: &str, ki_per_s: &str, kd_s: &str, sample_time_ns: i64) -> Self {
        let sample_time_s = ratio(sample_time_ns, 1_000_000_000);
        Self {
            kp: decimal(kp),
            ki_dt: decimal(ki_per_s) * &sample_time_s,
            kd_per_dt: decimal(kd_s) / &sample_time_s,
        }
    }

    /// The values that words stand for.
    pub(crate) fn of_words(words: &PidWords) -> Self {
        Self {
            kp: value(words.kp),
            ki_dt: value(words.ki_dt),
            kd_per_dt: value(words.kd_per_dt),
        }
    }

    /// The finest words, or `None` where a mantissa does not fit.
    pub(crate) fn words(&self, error_bits: u8) -> Option<PidWords> {
        Some(PidWords {
            kp: finest_word(&self.kp, 32)?,
            ki_dt: finest_word(&self.ki_dt, 40)?,
            kd_per_dt: finest_word(&self.kd_per_dt, 32)?,
            error_bits,
        })
    }
}

/// Gains that lie half a unit beside their words: the largest roundings.
pub(crate) fn half_a_unit_beside(words: &PidWords) -> Gains {
    let beside = |word: GainWord, sign: i64| {
        // Just inside the half: 499 999 999 / 10^9 of a unit.
        let unit = power_of_two(-i32::from(word.fraction_bits));
        value(word) + ratio(sign * 499_999_999, 1_000_000_000) * unit
    };
    Gains {
        kp: beside(words.kp, 1),
        ki_dt: beside(words.ki_dt, 1),
        kd_per_dt: beside(words.kd_per_dt, 1),
    }
}

/// The law of the design page in exact rationals, over one common denominator.
#[derive(Debug, Clone)]
pub(crate) struct ExactLaw {
    kp: BigInt,
    ki_dt: BigInt,
    kd_per_dt: BigInt,
    denominator: BigInt,
    error_sum: i128,
    previous_error: Option<i64>,
}

impl ExactLaw {
    pub(crate) fn new(gains: &Gains) -> Self {
        let denominator = gains.kp.denom() * gains.ki_dt.denom() * gains.kd_per_dt.denom();
        let over = |gain: &Exact| gain.numer() * (&denominator / gain.denom());
        Self {
            kp: over(&gains.kp),
            ki_dt: over(&gains.ki_dt),
            kd_per_dt: over(&gains.kd_per_dt),
            denominator,
            error_sum: 0,
            previous_error: None,
        }
    }

    /// `y` for the next error, not reduced.
    pub(crate) fn step(&mut self, error: i64) -> Exact {
        self.error_sum += i128::from(error);
        let slope = error - self.previous_error.replace(error).unwrap_or(error);
        let numerator = &self.kp * error + &self.ki_dt * self.error_sum + &self.kd_per_dt * slope;
        Exact::new_raw(numerator, self.denominator.clone())
    }

    pub(crate) fn error_sum(&self) -> i128 {
        self.error_sum
    }
}

/// `clamp(floor(y + ½), −2^(n−1), 2^(n−1)−1)`.
pub(crate) fn exact_code(y: &Exact, bits: u32) -> i64 {
    // floor(y + ½) = floor((2·numerator + denominator)/(2·denominator))
    let doubled = Exact::new_raw((y.numer() << 1) + y.denom(), y.denom() << 1);
    let half = 1_i64 << (bits - 1);
    let nearest = doubled.floor().to_integer();
    let saturated = if nearest < BigInt::from(0) {
        -half
    } else {
        half - 1
    };
    i64::try_from(nearest).map_or(saturated, |code| code.clamp(-half, half - 1))
}

/// Millionths of the difference of two numbers, rounded up.
pub(crate) fn millionths_apart(a: &Exact, b: &Exact) -> i64 {
    let numerator = a.numer() * b.denom() - b.numer() * a.denom();
    let apart = Exact::new_raw(
        BigInt::from(numerator.magnitude().clone()) * 1_000_000,
        a.denom() * b.denom(),
    );
    i64::try_from(apart.ceil().to_integer()).unwrap_or(i64::MAX)
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

    /// Uniform in [0, 1).
    pub(crate) fn fraction(&mut self) -> f64 {
        #[allow(clippy::cast_precision_loss, reason = "53 bits are kept exactly")]
        let mantissa = (self.next() >> 11) as f64;
        mantissa / 9_007_199_254_740_992.0
    }

    /// The decimal of a number spread log-uniformly from `2^low` to `2^high`,
    /// with a random number of digits.
    pub(crate) fn decimal_between(&mut self, low: f64, high: f64) -> String {
        let number = (low + (high - low) * self.fraction()).exp2();
        let digits = usize::try_from(self.between(0, 16)).expect("a small number");
        format!("{number:.digits$e}")
    }
}
