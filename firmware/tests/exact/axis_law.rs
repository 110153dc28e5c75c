//! The axis' law and its output, written from the pages of
//! `firmware::law`, `law::filter` and `firmware::output` as the mathematics has
//! them: integers of 128 bits with overflow checks, one unit (2^−F codes)
//! throughout, divisions that floor. Nothing here is shared with the firmware.

use firmware::law::{AntiWindup, Derivative, LawInput, LawWords};
use firmware::output::Quantiser;
use firmware::{Dac, GainWord};

/// `2^exponent`.
pub(crate) fn two(exponent: u32) -> i128 {
    1_i128 << exponent
}

/// `n/2^k` to the nearest integer, halves away from zero.
pub(crate) fn half_away(n: i128, k: u32) -> i128 {
    n.signum() * (n.abs() + two(k - 1)).div_euclid(two(k))
}

/// The ranges that a set of words declares.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ranges {
    /// `E` \[counts\].
    pub(crate) error: i128,
    /// `D` \[counts\].
    pub(crate) slope: i128,
    /// `Q` \[2^−F codes\].
    pub(crate) integral: i128,
    /// `R` \[2^−F codes\].
    pub(crate) code: i128,
    /// `Kp·E` and the feed-forward at its largest \[2^−F codes\].
    pub(crate) direct: i128,
}

/// The word's value in 2^−F codes, for a word that is no finer than the sum.
pub(crate) fn value(words: &LawWords, word: GainWord) -> i128 {
    i128::from(word.mantissa) << (words.sum_fraction_bits - word.fraction_bits)
}

impl Ranges {
    pub(crate) fn of(words: &LawWords, dac: Dac) -> Self {
        let f = u32::from(words.sum_fraction_bits);
        let error = two(u32::from(words.error_bits));
        let rates = value(words, words.velocity_ff) + value(words, words.acceleration_ff);
        let direct =
            value(words, words.kp) * error + rates * two(30) + value(words, words.friction_ff);
        let integral = two(u32::from(words.integral_bits) + f);
        let code = -i128::from(dac.min_code()) * two(f);
        // The first count whose term is at least the rest.
        let gain = value(words, words.kd_per_dt);
        let rest = direct + integral + 2 * code;
        let mut slope = 2 * error;
        if gain > 0 {
            slope = slope.min((rest + gain - 1).div_euclid(gain));
        }
        if words.filter.is_some() {
            slope = slope.min(two(29));
        }
        Self {
            error,
            slope,
            integral,
            code,
            direct,
        }
    }
}

/// Results that one sample must give.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sample {
    pub(crate) sum: i128,
    pub(crate) code: i128,
    /// Of the error, of the difference, of the integral.
    pub(crate) limited: [bool; 3],
}

/// Law, output and memory.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) words: LawWords,
    pub(crate) ranges: Ranges,
    dac: Dac,
    slew: Option<u32>,
    quantiser: Quantiser,
    pub(crate) integral: i128,
    /// `W` of the filter.
    wide: i128,
    previous_error: Option<i128>,
    pub(crate) take_over: Option<i128>,
    pub(crate) code: i128,
    /// `ρ` of the error feedback \[2^−F codes\].
    rho: i128,
    random: u64,
}

impl Model {
    pub(crate) fn new(words: LawWords, dac: Dac, slew: Option<u32>, quantiser: Quantiser) -> Self {
        let random = match quantiser {
            Quantiser::Dither { seed } => u64::from(seed),
            _ => 0,
        };
        Self {
            words,
            ranges: Ranges::of(&words, dac),
            dac,
            slew,
            quantiser,
            integral: 0,
            wide: 0,
            previous_error: None,
            take_over: None,
            code: 0,
            rho: two(u32::from(words.sum_fraction_bits) - 1),
            random,
        }
    }

    /// Starts the law's memory again at `code`; the output's stays.
    pub(crate) fn take_over(&mut self, code: i128) {
        (self.integral, self.wide, self.previous_error) = (0, 0, None);
        self.take_over = Some(code);
    }

    /// `low` and `high` \[codes\].
    pub(crate) fn window(&self) -> (i128, i128) {
        let (min, max) = (
            i128::from(self.dac.min_code()),
            i128::from(self.dac.max_code()),
        );
        match self.slew {
            None => (min, max),
            Some(s) => {
                let s = i128::from(s);
                (min.max(self.code - s), max.min(self.code + s))
            }
        }
    }

    pub(crate) fn step(&mut self, input: &LawInput) -> Sample {
        let (words, ranges) = (self.words, self.ranges);
        let f = u32::from(words.sum_fraction_bits);
        let wish = i128::from(input.error);
        let e = wish.clamp(-ranges.error, ranges.error);

        let first = self.previous_error.is_none();
        let e_prev = self.previous_error.replace(e).unwrap_or(e);
        let difference = match words.derivative {
            Derivative::Error => e - e_prev,
            Derivative::Measurement => -i128::from(input.difference),
        };
        let error_limited = e != wish;
        let delta = difference.clamp(-ranges.slope, ranges.slope);
        let derivative = match words.filter {
            None => value(&words, words.kd_per_dt) * delta,
            Some(filter) => {
                let h = u32::from(filter.fraction_bits);
                let x = delta * two(h);
                if first {
                    self.wide = x * two(31);
                }
                let gap = x - half_away(self.wide, 31);
                self.wide += i128::from(filter.smoothing) * gap;
                let filtered = half_away(self.wide, 31);
                (i128::from(words.kd_per_dt.mantissa) * filtered)
                    << (f - u32::from(words.kd_per_dt.fraction_bits) - h)
            }
        };
        // Beyond D the term outweighs the rest; else leaving it is told.
        let outweighs = words.filter.is_none() && ranges.slope < 2 * ranges.error;
        // The dead band is for what follows, not for the difference.
        let e = if input.within_dead_band { 0 } else { e };
        let (v, a) = (i128::from(input.velocity), i128::from(input.acceleration));
        let direct = value(&words, words.kp) * e
            + derivative
            + value(&words, words.velocity_ff) * v
            + value(&words, words.acceleration_ff) * a
            + value(&words, words.friction_ff) * v.signum();

        let (low, high) = self.window();
        let integral = match self.take_over.take() {
            Some(_) if words.ki_dt.mantissa == 0 => 0,
            Some(code) => code * two(f) - direct,
            None if input.hold_integral => self.integral,
            None => {
                let next = self.integral + value(&words, words.ki_dt) * e;
                let y = next + direct;
                let excess = y - y.clamp(low * two(f), high * two(f));
                match words.anti_windup {
                    // Of the step, what does not push further out.
                    AntiWindup::Clamp if excess.signum() * e.signum() == 1 => {
                        let step = next - self.integral;
                        let pushing = excess.abs().min(step.abs());
                        next - step.signum() * pushing
                    }
                    AntiWindup::BackCalculation { tracking } => {
                        next - half_away(excess * i128::from(tracking), 31)
                    }
                    _ => next,
                }
            }
        };
        self.integral = integral.clamp(-ranges.integral, ranges.integral);
        let sum = direct + self.integral;
        Sample {
            sum,
            code: self.quantise(sum, low, high),
            limited: [
                error_limited,
                delta != difference && !outweighs,
                self.integral != integral,
            ],
        }
    }

    /// `clamp(floor(y + ρ), low, high)`, in halves of the sum's unit.
    fn quantise(&mut self, sum: i128, low: i128, high: i128) -> i128 {
        let f = u32::from(self.words.sum_fraction_bits);
        let rho = match self.quantiser {
            Quantiser::Nearest => two(f),
            Quantiser::ErrorFeedback => 2 * self.rho,
            Quantiser::Dither { .. } => {
                self.random = (self.random * 1_664_525 + 1_013_904_223) % (1 << 32);
                // (2·random + 1)/2^33 codes
                i128::from(2 * self.random + 1) << (f - 32)
            }
        };
        let whole = (2 * sum + rho).div_euclid(two(f + 1));
        self.code = whole.clamp(low, high);
        self.rho = if self.code == whole {
            sum + self.rho - whole * two(f)
        } else {
            two(f - 1)
        };
        self.code
    }
}
