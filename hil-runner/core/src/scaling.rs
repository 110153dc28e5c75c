//! Settings in SI units → the fixed-point gains of the law (`firmware::law`).
//!
//! The firmware accepts or rejects them; this is where they are chosen: each gain
//! as fine as its bits and the 32 fraction bits of the sum allow, the range of
//! errors by need (2^17 counts, or what the limit of the following error allows),
//! the declared range of the integral so wide that it holds four times the
//! converter and 2^8 of the largest errors. Where the firmware refuses gains for
//! the errors that the limit allows, the largest limit that would do is looked
//! for; where it refuses them for any, the largest gains that would fit. All other
//! settings are as they are.
//!
//! Gains are in codes per motor count in the run file. Where the position
//! comes from the load, `Kp` and `Ki` act on load counts and are converted:
//! one load count is `ρ` motor counts.

use core::ops::RangeInclusive;

use firmware::law::{AntiWindup, FilterWords, Law, LawWords, Part};
use firmware::{Dac, ErrorRange, GainWord};

use crate::options::{self, FollowingErrorLimit, LawSettings};
use crate::quantise::{
    FixedPointGain, FixedPointGains, PARTS, QuantiseError, UnfitGain, finest_word, key,
    power_of_two, rounded_down,
};

/// Fraction bits of a gain at most: those of the sum.
const FRACTION_BITS: u8 = 32;

/// Bits of a gain that a processor multiplies by an error of 17 bits in two
/// products of 32.
const USUAL_BITS: u32 = 24;

/// Bits of a gain at most.
const MOST_BITS: u32 = 31;

/// Key of the limit of the following error at standstill.
pub(crate) const FOLLOWING_ERROR: &str = "limits.following_error_counts";

/// Key of what it allows on top.
pub(crate) const FOLLOWING_ERROR_PER_SPEED: &str = "limits.following_error_per_speed_s";

/// Everything that the fixed-point gains are made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScalingRequest {
    /// Shape of the law; its feed-forward stands in `gains` and is not read here.
    pub settings: LawSettings,
    /// Gains per motor count and feed-forward, in the order of [`PARTS`].
    pub gains: [f64; 6],
    /// The formulas of the gains that are from the plant.
    pub from_plant: [Option<&'static str>; 6],
    /// `Δt` \[ns\].
    pub sample_time_ns: u64,
    /// Limit of the following error \[counts of the encoder that the position comes
    /// from\].
    pub following_error: Option<FollowingErrorLimit>,
    /// Largest speed of the motion \[the same counts/s\].
    pub peak_speed_counts_per_s: f64,
    /// `ρ`: motor counts per count of that encoder; 1 where it is the motor's.
    pub motor_counts_per_count: f64,
    /// `n`.
    pub dac_bits: u32,
    /// Exponents of the setpoints' rates.
    pub rates: RateBits,
}

/// Fraction bits of the velocity \[counts/sample\] and the acceleration
/// \[counts/sample²\] that come with the setpoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RateBits {
    /// Of the velocity.
    pub velocity: u8,
    /// Of the acceleration.
    pub acceleration: u8,
}

/// The law of a run with the gains that it was made of.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaledLaw {
    /// The accepted law.
    pub law: Law,
    /// Gains and feed-forward, in the order of the law.
    pub rows: [FixedPointGain; 6],
}

impl ScaledLaw {
    /// The gains as they are shown: feed-forward only where there is some.
    pub fn fixed_point(&self) -> FixedPointGains {
        let shown = |row: &&FixedPointGain| row.wanted != 0.0 || row.is_of_the_paper();
        FixedPointGains {
            rows: self.rows.iter().filter(shown).copied().collect(),
            error_limit: self.law.error_limit(),
        }
    }
}

impl ScalingRequest {
    /// The fixed-point gains, chosen and accepted.
    ///
    /// # Errors
    /// [`QuantiseError`] that names the keys, their values and what fits.
    pub fn scaled_law(&self) -> Result<ScaledLaw, QuantiseError> {
        self.settle().map_err(|refused| match refused {
            QuantiseError::Refused(error) => self.explain(error),
            other => other,
        })
    }

    /// The gains in as many bits as the settings say, or as few as will do.
    fn settle(&self) -> Result<ScaledLaw, QuantiseError> {
        if let Some(bits) = self.settings.word_bits {
            return self.settle_in(bits);
        }
        let mut fewer = USUAL_BITS..MOST_BITS;
        let fitting = fewer.find_map(|bits| self.settle_in(bits).ok());
        fitting.map_or_else(|| self.settle_in(MOST_BITS), Ok)
    }

    /// The gains in mantissas of so many bits, or the firmware's objection to them.
    fn settle_in(&self, word_bits: u32) -> Result<ScaledLaw, QuantiseError> {
        let dac = Dac::with_bits(self.dac_bits)?;
        let wanted = self.wanted();
        let filter = self.filter(wanted[2].wanted)?;
        let rows = wanted.map(|gain| {
            // The filtered difference brings fraction bits of its own.
            let own = match (gain.part, filter) {
                (Part::Derivative, Some(filter)) => filter.fraction_bits,
                _ => 0,
            };
            let word = self.finest(&gain, FRACTION_BITS.saturating_sub(own), word_bits);
            FixedPointGain { word, ..gain }
        });
        let error_bits = self.error_bits();
        let words = LawWords {
            kp: rows[0].word,
            ki_dt: rows[1].word,
            kd_per_dt: rows[2].word,
            velocity_ff: rows[3].word,
            acceleration_ff: rows[4].word,
            friction_ff: rows[5].word,
            error_bits,
            integral_bits: 0,
            derivative: self.settings.derivative,
            filter,
            anti_windup: self.anti_windup()?,
        };
        let accepted = |integral_bits| {
            let mut words = words;
            words.integral_bits = integral_bits;
            Law::accept(words, dac)
        };
        let ranges = self.integral_bits(wanted[1].wanted, error_bits);
        // The range that was wanted says what is in the way.
        let law = accepted(*ranges.end()).or_else(|refusal| {
            let mut narrower = ranges.rev().skip(1);
            narrower.find_map(|bits| accepted(bits).ok()).ok_or(refusal)
        })?;
        Ok(ScaledLaw { law, rows })
    }

    /// Exponent of the range of errors: by need, at least 2^17. What no range
    /// holds, the firmware refuses.
    fn error_bits(&self) -> u8 {
        let allowed_counts = self.following_error.map_or(0.0, |limit| {
            f64::from(limit.counts) + self.by_speed_counts(limit)
        });
        let holds = |&bits: &u8| allowed_counts <= power_of_two(bits);
        let bits = (ErrorRange::MIN_BITS..=ErrorRange::MAX_BITS).find(holds);
        bits.unwrap_or(ErrorRange::MAX_BITS + 1)
    }

    /// Share of the allowed errors that comes by the motion's largest speed \[counts\].
    fn by_speed_counts(&self, limit: FollowingErrorLimit) -> f64 {
        limit.per_speed_s * self.peak_speed_counts_per_s
    }

    /// The same for errors up to `2^bits` counts.
    fn with_errors_of(&self, bits: u8) -> Self {
        let limit = FollowingErrorLimit {
            counts: 1 << bits,
            per_speed_s: 0.0,
        };
        Self {
            following_error: Some(limit),
            ..*self
        }
    }

    /// Exponents of the integral's declared range: the least that will do, to the
    /// one that is wanted.
    fn integral_bits(&self, ki_dt: f64, error_bits: u8) -> RangeInclusive<u8> {
        let converter = u8::try_from(self.dac_bits).unwrap_or(u8::MAX);
        let errors = ki_dt * power_of_two(error_bits.saturating_add(8).min(63));
        let holds = |&bits: &u8| errors <= power_of_two(bits);
        let least = (converter..30).find(holds).unwrap_or(30);
        let wanted = LawWords::NONE
            .integral_bits
            .max(converter.saturating_add(2));
        least..=wanted.clamp(least, 30)
    }

    /// The gains as the law multiplies them, not yet in fixed point.
    fn wanted(&self) -> [FixedPointGain; 6] {
        let sample_ns = self.sample_time_ns as f64;
        let (dt_s, ratio) = (sample_ns / 1e9, self.motor_counts_per_count);
        let [velocity, acceleration] =
            [self.rates.velocity, self.rates.acceleration].map(power_of_two);
        let [kp, ki, kd, kv, ka, kf] = self.gains;
        let wanted = [
            kp * ratio,
            // As the paper's law forms it: Δt in ns, over 10^9.
            ki * sample_ns / 1e9 * ratio,
            kd * 1e9 / sample_ns,
            kv * ratio / dt_s / velocity,
            ka * ratio / (dt_s * dt_s) / acceleration,
            kf,
        ];
        core::array::from_fn(|index| FixedPointGain {
            part: PARTS[index],
            value: self.gains[index],
            from_plant: self.from_plant[index],
            wanted: wanted[index],
            word: GainWord::new(0, 0),
        })
    }

    /// The finest fixed-point form of a gain with at most `most` fraction bits. One of
    /// the paper's is rounded before to the bits that were asked for: a multiple of a
    /// power of two, which the form holds exactly where it has that many.
    fn finest(&self, gain: &FixedPointGain, most: u8, word_bits: u32) -> GainWord {
        let rounded = match self.settings.gain_fraction_bits {
            Some(bits) if gain.is_of_the_paper() => {
                (gain.wanted * power_of_two(bits)).round() / power_of_two(bits)
            }
            _ => gain.wanted,
        };
        finest_word(rounded, most, word_bits)
    }

    /// `a = Δt/(T_f + Δt)`, and the fewest fraction bits with
    /// `(Kd/Δt)·2^−h ≤ 1/16`.
    fn filter(&self, kd_per_dt: f64) -> Result<Option<FilterWords>, QuantiseError> {
        let filter_s = self.settings.derivative_filter_s;
        if filter_s == 0.0 {
            return Ok(None);
        }
        let dt_s = self.sample_time_ns as f64 / 1e9;
        let because = "Δt/(T_f + Δt) is 0 in 31 bits; at most 10^9 sample times are more";
        let key = "controller.derivative_filter_s";
        let smoothing = word31(dt_s / (filter_s + dt_s), key, filter_s, because)?;
        let needed = (0..29).find(|&h| 16.0 * kd_per_dt <= power_of_two(h));
        Ok(Some(FilterWords {
            smoothing,
            fraction_bits: needed.unwrap_or(29),
        }))
    }

    fn anti_windup(&self) -> Result<AntiWindup, QuantiseError> {
        Ok(match self.settings.anti_windup {
            options::AntiWindup::None => AntiWindup::None,
            options::AntiWindup::Clamp => AntiWindup::Clamp,
            options::AntiWindup::BackCalculation => {
                let dt_s = self.sample_time_ns as f64 / 1e9;
                let tracking_s = self.settings.tracking_time_s;
                let because = "it must be longer than the sample time and at most 10^9 of them";
                let key = "controller.tracking_time_s";
                let tracking = word31(dt_s / tracking_s, key, tracking_s, because)?;
                AntiWindup::BackCalculation { tracking }
            }
        })
    }

    /// The largest value of the gain of a part of [`PARTS`] that fits, rounded down to five digits, so
    /// that what a table prints fits too; 0 if none does. One that is rounded to 0 is no gain.
    pub fn largest_gain(&self, index: usize) -> f64 {
        let fits = |value: f64| {
            let mut request = *self;
            request.gains[index] = value;
            let scaled = request.settle();
            scaled.is_ok_and(|scaled| scaled.rows[index].word.mantissa != 0)
        };
        // Whole powers of two first, then halves of the interval.
        let power_fits = |exponent: &i32| fits(2_f64.powi(*exponent));
        let Some(least) = (-60..60).find(power_fits) else {
            return 0.0;
        };
        let Some(beyond) = (least + 1..60).find(|exponent| !power_fits(exponent)) else {
            return rounded_down(2_f64.powi(59), 5);
        };
        let [mut low, mut high] = [beyond - 1, beyond].map(|exponent| 2_f64.powi(exponent));
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            if fits(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        rounded_down(low, 5)
    }

    /// The fewest bits of a fixed-point gain that fit, at least so many.
    fn fewest_bits(&self, least: u32) -> Option<u32> {
        (least..=MOST_BITS).find(|&word_bits| self.settle_in(word_bits).is_ok())
    }

    /// The firmware's objection in terms of the run file.
    fn explain(&self, error: firmware::Refusal) -> QuantiseError {
        if let Some(own) = self.settings.word_bits
            && let Some(bits) = self.fewest_bits(own)
        {
            let because = format!(
                "in fixed point these gains need at least {bits} bits to stay within one code \
                 of the exact law ({error})"
            );
            return QuantiseError::setting("controller.word_bits", f64::from(own), because);
        }
        let error_bits = self.error_bits();
        if let Some(limit) = self.following_error
            && let Some(bits) = self.widest_errors_below(error_bits)
        {
            return self.too_many_errors(limit, bits);
        }
        let unfit = self.unfit_gains();
        if !unfit.is_empty() {
            return QuantiseError::Gains(unfit);
        }
        if error_bits == ErrorRange::MIN_BITS {
            return QuantiseError::Refused(error);
        }
        // Gains that fit no range of errors are told for the least.
        let least = self.with_errors_of(ErrorRange::MIN_BITS).scaled_law();
        least.err().unwrap_or(QuantiseError::Refused(error))
    }

    /// The gains of which a smaller one alone would fit.
    fn unfit_gains(&self) -> Vec<UnfitGain> {
        let error_limit = ErrorRange::from_bits(self.error_bits()).map_or(0, ErrorRange::limit);
        let gains = PARTS.into_iter().zip(self.gains).enumerate();
        let unfit = gains.filter_map(|(index, (part, value))| {
            let largest = self.largest_gain(index);
            let too_large = value > 0.0 && largest > 0.0 && largest < value;
            // A resistance that pushes makes one from the plant less than 0.
            (too_large || value < 0.0).then_some(UnfitGain {
                key: key(part),
                value,
                from_plant: self.from_plant[index].is_some(),
                largest,
                error_limit,
            })
        });
        unfit.collect()
    }

    /// Exponent of the widest range of errors below that of `error_bits` for which
    /// the gains as they are fit.
    fn widest_errors_below(&self, error_bits: u8) -> Option<u8> {
        let mut narrower = (ErrorRange::MIN_BITS..error_bits).rev();
        narrower.find(|&bits| self.with_errors_of(bits).settle().is_ok())
    }

    /// The objection to a limit of the following error where the gains fit errors up to
    /// `2^bits` counts and no more.
    fn too_many_errors(&self, limit: FollowingErrorLimit, bits: u8) -> QuantiseError {
        let most_counts = power_of_two(bits);
        let word_bits = self.settings.word_bits;
        let within = word_bits.map_or(String::new(), |bits| format!(" in {bits} bits"));
        let holds = format!(
            "the firmware holds errors up to {most_counts} counts with these gains{within} at this \
             sample time"
        );
        let counts = f64::from(limit.counts);
        let left_counts = (most_counts - self.by_speed_counts(limit)).floor();
        if left_counts < 1.0 {
            // No limit at standstill is small enough.
            let beside_counts = if counts < most_counts { counts } else { 1.0 };
            let most_s = (most_counts - beside_counts) / self.peak_speed_counts_per_s;
            let because = format!(
                "{holds}; beside {FOLLOWING_ERROR} = {beside_counts} it must be at most {} for the \
                 motion's largest speed",
                rounded_down(most_s, 5)
            );
            return QuantiseError::setting(FOLLOWING_ERROR_PER_SPEED, limit.per_speed_s, because);
        }
        let because = if left_counts < most_counts {
            format!(
                "{holds}, of which {FOLLOWING_ERROR_PER_SPEED} takes {} at the motion's largest \
                 speed; it must be at most {left_counts}",
                most_counts - left_counts
            )
        } else {
            holds
        };
        QuantiseError::setting(FOLLOWING_ERROR, counts, because)
    }
}

/// `fraction·2^31` as an integer from 1 to 2^31 − 1; beyond, the key's value is refused.
fn word31(
    fraction: f64,
    key: &'static str,
    value: f64,
    because: &str,
) -> Result<i32, QuantiseError> {
    let word = (fraction * power_of_two(31)).round();
    if (1.0..=f64::from(i32::MAX)).contains(&word) {
        // Whole and within the type: the conversion is exact.
        return Ok(word as i32);
    }
    Err(QuantiseError::setting(key, value, because))
}
