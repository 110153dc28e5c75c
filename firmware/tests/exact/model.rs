//! The law and its output, written from the pages of `firmware::law`,
//! `law::words`, `law::filter` and `firmware::output` as the mathematics has
//! them: integers of 128 bits with overflow checks, one unit (2^−32 codes)
//! throughout, divisions that floor. Nothing is shared with the firmware but the shape of
//! its settings and inputs.

use firmware::GainWord;
use firmware::law::{AntiWindup, Begin, Derivative, LawInput, LawWords};
use firmware::output::Quantiser;

/// Results of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sample {
    pub(crate) code: i128,
    /// `y`, the sum before rounding \[2^−32 codes\]; code and rest where the
    /// output goes on from the code in force.
    pub(crate) sum: i128,
    /// True if a declared range was left.
    pub(crate) told: bool,
}

/// One code.
pub(crate) const CODE: i128 = 1 << 32;
/// Largest integral, and largest sum of all terms.
pub(crate) const MOST: i128 = CODE << 30;

/// `2^exponent`.
pub(crate) fn two(exponent: u8) -> i128 {
    1_i128 << exponent
}

/// `n/2^31` to the nearest integer, halves away from zero.
fn half_away(n: i128) -> i128 {
    n.signum() * (n.abs() + two(30)).div_euclid(two(31))
}

/// The word's value, for a word that is no finer than the sum.
pub(crate) fn value(word: GainWord) -> i128 {
    i128::from(word.mantissa) << (32 - word.fraction_bits)
}

/// The ranges that a set of words declares.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ranges {
    /// `E` \[counts\].
    pub(crate) error: i128,
    /// `D` \[counts\].
    pub(crate) difference: i128,
    /// True if `D` outweighs the rest: beyond it nothing is lost.
    pub(crate) outweighs: bool,
    /// `Q`.
    pub(crate) integral: i128,
    /// `T + R`.
    pub(crate) largest: i128,
}

impl Ranges {
    /// The ranges of words that are no finer than the sum, `Q` ≤ 2^30 codes.
    pub(crate) fn of(words: &LawWords, dac_bits: u32) -> Self {
        let error = two(words.error_bits);
        let rates = value(words.velocity_ff) + value(words.acceleration_ff);
        let direct = value(words.kp) * error + rates * two(24) + value(words.friction_ff);
        let integral = two(words.integral_bits) * CODE;
        let code = CODE << (dac_bits - 1);
        let gain = value(words.kd_per_dt);
        let most = match words.filter {
            Some(_) => two(29).min(2 * error),
            None => 2 * error,
        };
        // The first count that outweighs the rest.
        let rest = direct + integral + 2 * code;
        let difference = match gain {
            0 => most,
            _ => most.min((rest + gain - 1).div_euclid(gain)),
        };
        // With a filter its value may be a unit of 2^−h beyond D.
        let unit = words.filter.map_or(0, |filter| {
            let units = two(filter.fraction_bits.min(100));
            (gain + units - 1).div_euclid(units)
        });
        let terms = direct + gain * difference + unit + value(words.ki_dt) * error;
        Self {
            error,
            difference,
            outweighs: words.filter.is_none() && difference < 2 * error,
            integral,
            largest: terms + code,
        }
    }
}

/// Law, output and memory.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) words: LawWords,
    pub(crate) ranges: Ranges,
    /// `n` of the converter.
    dac_bits: u32,
    pub(crate) slew: Option<u32>,
    pub(crate) quantiser: Quantiser,
    pub(crate) integral: i128,
    /// `W` of the filter, its `h` and what it filters.
    wide: i128,
    filter_of: Option<(u8, Derivative)>,
    previous_error: i128,
    pub(crate) code: i128,
    /// `ρ` of the error feedback.
    rho: i128,
    random: i128,
    told: bool,
    /// The largest magnitude that met 64 bits.
    pub(crate) widest: i128,
}

impl Model {
    pub(crate) fn new(
        words: LawWords,
        dac_bits: u32,
        slew: Option<u32>,
        quantiser: Quantiser,
    ) -> Self {
        Self {
            words,
            ranges: Ranges::of(&words, dac_bits),
            dac_bits,
            slew,
            quantiser,
            integral: 0,
            wide: 0,
            filter_of: None,
            previous_error: 0,
            code: 0,
            rho: CODE / 2,
            random: match quantiser {
                Quantiser::Dither { seed } => seed.into(),
                _ => 0,
            },
            told: false,
            widest: 0,
        }
    }

    /// Other words for the same memory.
    pub(crate) fn change(&mut self, words: LawWords) {
        (self.words, self.ranges) = (words, Ranges::of(&words, self.dac_bits));
    }

    /// The output stands at `code` without the law.
    pub(crate) fn rest_at(&mut self, code: i128) {
        (self.code, self.rho) = (code, CODE / 2);
    }

    /// `low` and `high` \[codes\].
    pub(crate) fn window(&self) -> (i128, i128) {
        let half = 1_i128 << (self.dac_bits - 1);
        let [min, max] = [-half, half - 1];
        let slew = self.slew.map_or(two(32), i128::from);
        (min.max(self.code - slew), max.min(self.code + slew))
    }

    pub(crate) fn step(&mut self, input: &LawInput, begin: Option<Begin>) -> Sample {
        let (words, ranges) = (self.words, self.ranges);
        self.told = false;
        let e = self.held(input.error.into(), ranges.error, true);
        if let Some(begin) = begin {
            if begin != Begin::OtherGains {
                (self.previous_error, self.integral, self.filter_of) = (e, 0, None);
            }
            self.rho = CODE / 2;
        }
        let difference = match words.derivative {
            Derivative::Error => e - self.previous_error,
            Derivative::Measurement => -i128::from(input.difference),
        };
        self.previous_error = e;
        let delta = self.held(difference, ranges.difference, !ranges.outweighs);
        let derivative = self.derivative(delta, begin.is_some());
        // The dead band is for what follows, not for the difference.
        let e = if input.within_dead_band { 0 } else { e };
        let rate = |rate: i32| i128::from(rate).clamp(-two(24), two(24) - 1);
        let direct = value(words.kp) * e
            + derivative
            + value(words.velocity_ff) * rate(input.velocity)
            + value(words.acceleration_ff) * rate(input.acceleration)
            + value(words.friction_ff) * i128::from(input.velocity.signum())
            + i128::from(input.ahead.to_bits());

        let (low, high) = self.window();
        if matches!(begin, Some(Begin::FromCode | Begin::OtherGains)) {
            self.code = self.code.clamp(low, high);
            self.integral = 0;
            if words.ki_dt.mantissa != 0 {
                // A number is drawn in every sample.
                self.rounding();
                self.integral = self.bounded(self.code * CODE - direct);
                return self.sample(self.integral + direct);
            }
        }
        let step = if input.hold_integral {
            0
        } else {
            value(words.ki_dt) * e
        };
        let next = self.fitting(self.integral + step);
        let y = next + direct;
        let rounded = y + self.rounding();
        let rounded = self.fitting(rounded);
        let whole = rounded.div_euclid(CODE);
        self.code = whole.clamp(low, high);
        let excess = whole - self.code;
        self.rho = if excess == 0 {
            rounded.rem_euclid(CODE)
        } else {
            CODE / 2
        };
        self.integral = match words.anti_windup {
            _ if excess == 0 || words.ki_dt.mantissa == 0 => next,
            AntiWindup::None => self.bounded(next),
            // Of the step, what does not push further out, in whole codes.
            AntiWindup::Clamp if step.signum() != excess.signum() => next,
            AntiWindup::Clamp if step.abs() < excess.abs() * CODE => self.integral,
            AntiWindup::Clamp => next - excess * CODE,
            AntiWindup::BackCalculation { tracking } => {
                self.bounded(next - 2 * i128::from(tracking) * excess)
            }
        };
        self.sample(y)
    }

    fn sample(&self, sum: i128) -> Sample {
        let (code, told) = (self.code, self.told);
        Sample { code, sum, told }
    }

    /// `(Kd/Δt)·δ`, filtered where that is asked for.
    fn derivative(&mut self, delta: i128, begins: bool) -> i128 {
        let derivative = self.words.derivative;
        let of = self
            .words
            .filter
            .map(|filter| (filter.fraction_bits, derivative));
        let goes_on = of == self.filter_of;
        self.filter_of = of;
        let kd = self.words.kd_per_dt;
        let Some(filter) = self.words.filter else {
            return value(kd) * delta;
        };
        let h = filter.fraction_bits;
        let x = delta * two(h);
        let most = self.ranges.difference * two(h) * two(31);
        if begins {
            self.wide = if goes_on {
                self.wide.clamp(-most, most)
            } else {
                x * two(31)
            };
        }
        self.wide += i128::from(filter.smoothing) * (x - half_away(self.wide));
        value(GainWord::new(kd.mantissa, kd.fraction_bits + h)) * half_away(self.wide)
    }

    /// `ρ` of this sample.
    fn rounding(&mut self) -> i128 {
        match self.quantiser {
            Quantiser::Nearest => CODE / 2,
            Quantiser::ErrorFeedback => self.rho,
            Quantiser::Dither { .. } => {
                self.random = (self.random * 1_664_525 + 1_013_904_223) % CODE;
                self.random
            }
        }
    }

    fn held(&mut self, x: i128, limit: i128, tells: bool) -> i128 {
        self.told |= tells && x.abs() > limit;
        x.clamp(-limit, limit)
    }

    fn bounded(&mut self, integral: i128) -> i128 {
        // The first whole number of codes beyond (Ki·Δt)·S.
        let ki = value(self.words.ki_dt);
        let by_rounding = ki << self.words.ki_dt.fraction_bits >> 1;
        let range = match ki {
            0 => self.ranges.integral,
            _ => by_rounding.min(self.ranges.integral.div_euclid(ki) * ki),
        };
        let range = (range.div_euclid(CODE) + 1) * CODE;
        self.told |= !(-range..range).contains(&integral);
        self.fitting(integral).clamp(-MOST, MOST)
    }

    /// Notes what the firmware keeps in 64 bits.
    fn fitting(&mut self, x: i128) -> i128 {
        self.widest = self.widest.max(x.abs());
        x
    }
}
