//! The law of decimal gains in exact rationals, and inputs within the declared
//! ranges that try to drive code and exact law apart.

use firmware::law::{Derivative, FilterWords, Law, LawInput, LawWords};
use firmware::{Dac, GainWord};
use num_bigint::BigInt;
use num_rational::Ratio;

use super::Random;
use super::words::gains;

/// An exact number.
pub(crate) type Exact = Ratio<BigInt>;

/// Gains in the order of the law's equation.
pub(crate) type Gains = [Exact; 6];

/// `numerator/denominator`.
pub(crate) fn ratio(numerator: i64, denominator: i64) -> Exact {
    Exact::new(BigInt::from(numerator), BigInt::from(denominator))
}

/// The number that a decimal such as `3.2` writes down.
pub(crate) fn decimal(text: &str) -> Exact {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits: BigInt = format!("{whole}{fraction}").parse().expect("digits");
    let places = u32::try_from(fraction.len()).expect("a short fraction");
    Exact::new(digits, BigInt::from(10).pow(places))
}

/// `gain·2^fraction_bits` to the nearest integer, as a word; `None` where the
/// mantissa needs more than 31 bits.
pub(crate) fn word_with(gain: &Exact, fraction_bits: u8) -> Option<GainWord> {
    let scaled = gain * Exact::from(BigInt::from(1_u64 << fraction_bits)) + ratio(1, 2);
    let mantissa = i32::try_from(scaled.floor().to_integer()).ok()?;
    Some(GainWord::new(mantissa, fraction_bits))
}

/// The word with the most fraction bits.
pub(crate) fn finest_word(gain: &Exact) -> GainWord {
    let mut finest = (0..=32).rev().filter_map(|bits| word_with(gain, bits));
    finest.next().expect("a gain below 2^31")
}

/// Gains that lie `billionths` of a unit beside their words; a 0 is one.
pub(crate) fn beside(words: &LawWords, mut billionths: impl FnMut() -> i64) -> Gains {
    gains(words).map(|word| {
        let beside = if word.mantissa == 0 { 0 } else { billionths() };
        let mantissa = i64::from(word.mantissa) * 1_000_000_000 + beside;
        ratio(mantissa, 1_000_000_000) / Exact::from(BigInt::from(1_u64 << word.fraction_bits))
    })
}

/// Fraction bits of the exact filter below one unit of 2^−h. What cutting off
/// below them adds up to is at most 2^−60/a ≤ 2^−29 units.
const FINE: u8 = 60;

/// Law of gains over one common denominator, with the exact filter.
#[derive(Debug, Clone)]
pub(crate) struct ExactLaw {
    gains: [BigInt; 6],
    denominator: BigInt,
    derivative: Derivative,
    filter: Option<FilterWords>,
    /// `h` + 60 with a filter.
    places: u8,
    pub(crate) error_sum: i128,
    pub(crate) previous_error: Option<i64>,
    /// `δ` of the last sample, unfiltered.
    pub(crate) difference: i64,
    filtered: i128,
}

impl ExactLaw {
    /// The law of `gains` with the options of `words`.
    pub(crate) fn new(gains: &Gains, words: &LawWords) -> Self {
        let denominator = gains
            .iter()
            .fold(BigInt::from(1), |all, gain| all * gain.denom());
        let places = words.filter.map_or(0, |filter| filter.fraction_bits + FINE);
        Self {
            gains: gains
                .each_ref()
                .map(|gain| gain.numer() * (&denominator / gain.denom())),
            denominator: denominator << places,
            derivative: words.derivative,
            filter: words.filter,
            places,
            error_sum: 0,
            previous_error: None,
            difference: 0,
            filtered: 0,
        }
    }

    /// `y`, not reduced.
    pub(crate) fn step(&mut self, input: &LawInput) -> Exact {
        let e = i64::from(input.error);
        self.error_sum += i128::from(e);
        let first = self.previous_error.is_none();
        let before = self.previous_error.replace(e).unwrap_or(e);
        self.difference = match self.derivative {
            Derivative::Error => e - before,
            Derivative::Measurement => -i64::from(input.difference),
        };
        let mut delta = i128::from(self.difference) << self.places;
        if let Some(filter) = self.filter {
            let v = if first { delta } else { self.filtered };
            delta = v + ((i128::from(filter.smoothing) * (delta - v)) >> 31);
            self.filtered = delta;
        }
        let [kp, ki, kd, kv, ka, kf] = &self.gains;
        let (v, a) = (input.velocity, input.acceleration);
        let rest = kp * e + ki * self.error_sum + kv * v + ka * a + kf * v.signum();
        Exact::new_raw((rest << self.places) + kd * delta, self.denominator.clone())
    }
}

/// `clamp(floor(y + ½), −2^(n−1), 2^(n−1)−1)`.
pub(crate) fn exact_code(y: &Exact, dac: Dac) -> i128 {
    // floor(y + ½) = floor((2·numerator + denominator)/(2·denominator))
    let nearest = Exact::new_raw((y.numer() << 1) + y.denom(), y.denom() << 1).floor();
    let ends = [dac.min_code(), dac.max_code()].map(BigInt::from);
    let [low, high] = ends;
    let code = nearest.to_integer().clamp(low, high);
    i128::try_from(code).expect("24 bits")
}

/// Millionths of a code between `y` and `sum` \[2^−32 codes\], rounded up.
pub(crate) fn millionths_apart(y: &Exact, sum: i128) -> i64 {
    let apart: BigInt = (y.numer() << 32) - y.denom() * sum;
    let millionths = BigInt::from(apart.magnitude().clone()) * 1_000_000;
    let apart = Exact::new_raw(millionths, y.denom() << 32);
    i64::try_from(apart.ceil().to_integer()).unwrap_or(i64::MAX)
}

/// Choice of the next error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Any, independently.
    Uniform,
    /// The ends and 0.
    Ends,
    /// Long stretches at either end.
    Stretches,
    /// Small ones more often than large ones.
    Small,
    /// The error that takes the sum near a random code of the converter, so
    /// that it is hidden by no limit.
    Steered,
    /// Errors that a sluggish axis that follows the code would show.
    ClosedLoop,
}

impl Shape {
    pub(crate) const ALL: [Self; 6] = [
        Self::Uniform,
        Self::Ends,
        Self::Stretches,
        Self::Small,
        Self::Steered,
        Self::ClosedLoop,
    ];
}

/// Inputs within every declared range.
#[derive(Debug, Clone)]
pub(crate) struct Within {
    law: Law,
    shape: Shape,
    random: Random,
    k: u32,
    /// Position of the sluggish axis \[counts\].
    axis: i64,
}

impl Within {
    pub(crate) fn new(law: Law, shape: Shape, seed: u64) -> Self {
        Self {
            law,
            shape,
            random: Random(seed),
            k: 0,
            axis: 0,
        }
    }

    fn pick(&mut self, limit: i64) -> i64 {
        match self.shape {
            Shape::Ends => limit * self.random.one_of(&[1, -1, 0]),
            Shape::Stretches if self.k % 400 < 300 => limit,
            Shape::Stretches => -limit,
            Shape::Uniform | Shape::Steered => self.random.between(-limit, limit),
            _ => self.random.between(-limit, limit) >> self.random.between(0, 20),
        }
    }

    /// The next sample; neither the error nor its sum leaves its range, nor
    /// does a difference beyond which something would be lost.
    pub(crate) fn next(&mut self, exact: &ExactLaw, last_code: i128) -> LawInput {
        self.k += 1;
        let words = *self.law.words();
        let limit = i64::from(self.law.error_limit());
        let outweighs =
            words.filter.is_none() && self.law.difference_limit() < 2 << words.error_bits;
        // Differences of errors are free up to 2·E, measured ones without end.
        let bound = words.filter.is_some() && words.derivative == Derivative::Error;
        let within = i64::from(self.law.difference_limit());
        let measured = if outweighs && self.random.one_in(2) {
            i32::MAX.into()
        } else {
            within
        };
        let before = exact.previous_error.unwrap_or(0);
        let near = |e: i64| {
            let e = if bound {
                e.clamp(before - within, before + within)
            } else {
                e
            };
            e.clamp(-limit, limit)
        };
        let wish = match self.shape {
            Shape::Steered => self.steered(exact, before),
            Shape::ClosedLoop => self.closed_loop(last_code),
            _ => self.pick(limit),
        };
        // Where the sum of errors would end beyond its range: the other way,
        // with what a turn in steps of D at most still adds.
        let error = near(wish);
        let turn = if bound {
            i128::from(error).pow(2) / i128::from(2 * within) + i128::from(limit)
        } else {
            0
        };
        let ahead = exact.error_sum * i128::from(error.signum()) + i128::from(error.abs());
        let beyond = ahead + turn > i128::from(self.law.error_sum_limit());
        let error = if beyond {
            near(-limit * error.signum())
        } else {
            error
        };
        let rate = (1 << 24) - 1;
        let [difference, velocity, acceleration] = [measured, rate, rate].map(|x| self.pick(x));
        let [error, difference, velocity, acceleration] =
            [error, difference, velocity, acceleration].map(|x| i32::try_from(x).expect("31 bits"));
        LawInput {
            error,
            difference,
            velocity,
            acceleration,
            ..LawInput::default()
        }
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "steering only: any integer is a valid error"
    )]
    fn steered(&mut self, exact: &ExactLaw, before: i64) -> i64 {
        let rough =
            |word: GainWord| f64::from(word.mantissa) * (-f64::from(word.fraction_bits)).exp2();
        let words = self.law.words();
        let [kp, ki, kd] = [words.kp, words.ki_dt, words.kd_per_dt].map(rough);
        let ends = [self.law.dac().min_code(), self.law.dac().max_code()].map(i64::from);
        let target = self.random.between(ends[0], ends[1]) as f64;
        let given = ki * exact.error_sum as f64 - kd * before as f64;
        ((target - given) / (kp + ki + kd).max(1e-9)).round() as i64
    }

    /// A first-order lag driven by the code, 40 counts a sample at most.
    fn closed_loop(&mut self, last_code: i128) -> i64 {
        let code = i64::try_from(last_code).expect("24 bits");
        self.axis += 40 * code / (i64::from(self.law.dac().max_code()) + 1);
        let setpoint = if self.k % 4_000 < 2_000 { 20_000 } else { 0 };
        setpoint - self.axis
    }
}
