//! The axis' law of decimal gains with the exact filter, and inputs within
//! the declared ranges.
//!
//! Everything is an exact integer in units of 2^−(F+32)/10^9 codes: the gains
//! are whole 10^−9 of a unit of their words beside them, and the exact filter
//! has 32 bits more than the firmware's.

use firmware::GainWord;
use firmware::law::{Derivative, Law, LawInput, LawWords};

use super::Random;
use super::axis_law::two;

pub(crate) const BILLION: i128 = 1_000_000_000;
/// Just inside half a unit, in its billionths.
pub(crate) const HALF: i64 = 499_999_999;

/// Distance of each gain beside its word, in billionths of its last place:
/// `Kp`, `Ki·Δt`, `Kd/Δt`, `Kv`, `Ka`, `Kf`. None beside a word of 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Beside([i128; 6]);

impl Beside {
    pub(crate) fn new(words: &LawWords, beside: [i64; 6]) -> Self {
        let mut beside = beside.map(i128::from);
        for (beside, word) in beside.iter_mut().zip(gains(words)) {
            *beside = if word.mantissa == 0 { 0 } else { *beside };
        }
        Self(beside)
    }
}

pub(crate) fn gains(words: &LawWords) -> [GainWord; 6] {
    [
        words.kp,
        words.ki_dt,
        words.kd_per_dt,
        words.velocity_ff,
        words.acceleration_ff,
        words.friction_ff,
    ]
}

/// The law of the decimal gains with the exact filter.
#[derive(Debug, Clone)]
pub(crate) struct Decimal {
    words: LawWords,
    /// The gains in 2^−F/10^9 codes.
    gains: [i128; 6],
    pub(crate) error_sum: i128,
    pub(crate) previous: Option<i128>,
    /// The filter's value in 2^−(h+32) counts; what is cut off below them is
    /// less than 2^−32/a units, so `a` is at least 2^−16 here.
    filtered: i128,
}

impl Decimal {
    pub(crate) fn new(words: LawWords, beside: Beside) -> Self {
        let mut exact = [0; 6];
        for ((exact, word), beside) in exact.iter_mut().zip(gains(&words)).zip(beside.0) {
            let unit = two(u32::from(
                words.sum_fraction_bits.saturating_sub(word.fraction_bits),
            ));
            *exact = (i128::from(word.mantissa) * BILLION + beside) * unit;
        }
        Self {
            words,
            gains: exact,
            error_sum: 0,
            previous: None,
            filtered: 0,
        }
    }

    /// `y` in 2^−(F+32)/10^9 codes.
    pub(crate) fn step(&mut self, input: &LawInput) -> i128 {
        let e = i128::from(input.error);
        self.error_sum += e;
        let first = self.previous.is_none();
        let e_prev = self.previous.replace(e).unwrap_or(e);
        let delta = match self.words.derivative {
            Derivative::Error => e - e_prev,
            Derivative::Measurement => -i128::from(input.difference),
        };
        let [kp, ki, kd, kv, ka, kf] = self.gains;
        let derivative = match self.words.filter {
            None => (kd * delta) << 32,
            Some(filter) => {
                let h = u32::from(filter.fraction_bits);
                let x = delta << (h + 32);
                let before = if first { x } else { self.filtered };
                self.filtered = before + ((i128::from(filter.smoothing) * (x - before)) >> 31);
                // The gain has h zero bits: it was aligned to F ≥ fd + h.
                (kd >> h) * self.filtered
            }
        };
        let (v, a) = (i128::from(input.velocity), i128::from(input.acceleration));
        let rest = kp * e + ki * self.error_sum + kv * v + ka * a + kf * v.signum();
        (rest << 32) + derivative
    }
}

/// Billionths of a code between the sums that `law` gives \[2^−F codes\] and
/// the exact ones, at most, over inputs that may look at the exact law.
pub(crate) fn farthest(
    words: LawWords,
    beside: Beside,
    samples: u32,
    mut law: impl FnMut(&LawInput) -> i128,
    mut next: impl FnMut(&Decimal) -> LawInput,
) -> i128 {
    let mut exact = Decimal::new(words, beside);
    let code = two(u32::from(words.sum_fraction_bits) + 32);
    (0..samples).fold(0, |farthest: i128, _| {
        let input = next(&exact);
        let apart = ((law(&input) * BILLION) << 32) - exact.step(&input);
        // Rounded up.
        farthest.max((apart.abs() + code - 1).div_euclid(code))
    })
}

/// Inputs within every declared range, at its ends more often than not.
pub(crate) fn within(law: Law, mut random: Random) -> impl FnMut(&Decimal) -> LawInput {
    let limit = i64::from(law.error_limit());
    let slope = i64::from(law.slope_limit());
    let sum_limit = i128::from(law.error_sum_limit());
    let style = random.between(0, 3);
    let mut k = 0;
    move |exact| {
        assert!(exact.error_sum.abs() <= sum_limit);
        k += 1;
        let mut pick = |limit: i64| match style {
            0 => random.between(-limit, limit),
            1 => limit * [1, -1, 0][usize::from(random.bits(0, 2))],
            2 => {
                if k % 400 < 300 {
                    limit
                } else {
                    -limit
                }
            }
            _ => random.between(-limit, limit) / (1 << random.between(0, 20)),
        };
        let [wish, difference] = [limit, slope].map(&mut pick);
        let [velocity, acceleration] = [1 << 30, 1 << 30].map(&mut pick);
        let before = exact
            .previous
            .map_or(0, |e| i64::try_from(e).expect("29 bits"));
        let free = law.words().derivative == Derivative::Measurement;
        let near = |e: i64| {
            if free {
                e
            } else {
                e.clamp(before - slope, before + slope)
            }
        };
        // Where the sum of errors would end beyond its range: the other way.
        let mut error = near(wish).clamp(-limit, limit);
        let ahead = |e: i64| {
            // What a turn with steps of D at most still adds.
            let turn = if free {
                0
            } else {
                i128::from(e).pow(2) / (2 * i128::from(slope))
            };
            (exact.error_sum + i128::from(e)) * i128::from(e.signum()) + turn + i128::from(limit)
        };
        if ahead(error) > sum_limit {
            error = near(-limit * error.signum()).clamp(-limit, limit);
        }
        let [error, difference, velocity, acceleration] =
            [error, difference, velocity, acceleration].map(|x| i32::try_from(x).expect("31 bits"));
        LawInput {
            error,
            difference,
            velocity,
            acceleration,
            within_dead_band: false,
            hold_integral: false,
        }
    }
}
