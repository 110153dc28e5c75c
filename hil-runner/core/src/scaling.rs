//! Settings in SI units → the fixed-point gains of the law (`firmware::law`).
//!
//! The firmware accepts or rejects them; this is where they are chosen: each gain
//! as fine as its bits and the 32 fraction bits of the sum allow, the range of
//! errors by need (2^17 counts, or what the limit of the following error allows),
//! the declared range of the integral so wide that it holds four times the
//! converter and 2^8 of the largest errors. Where the firmware refuses, the
//! largest gains that would fit are looked for, all other settings as they are.
//!
//! Gains are in codes per motor count in the run file. Where the position
//! comes from the load, `Kp` and `Ki` act on load counts and are converted:
//! one load count is `ρ` motor counts.

use core::ops::RangeInclusive;

use firmware::law::{AntiWindup, FilterWords, Law, LawWords, Part};
use firmware::{Dac, ErrorRange, GainWord};

use crate::options::{self, LawSettings};
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

/// Everything that the fixed-point gains are made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScalingRequest {
    /// Shape of the law; its feed-forward stands in `gains` and is not read here.
    pub settings: LawSettings,
    /// Gains per motor count and feed-forward, in the order of [`PARTS`].
    pub gains: [f64; 6],
    /// `Δt` \[ns\].
    pub sample_time_ns: u64,
    /// Largest error that the limit of the following error allows \[counts of the
    /// encoder that the position comes from\]; 0 without a limit.
    pub allowed_error_counts: f64,
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
    pub rows: Vec<FixedPointGain>,
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
        let [
            kp,
            ki_dt,
            kd_per_dt,
            velocity_ff,
            acceleration_ff,
            friction_ff,
        ] = rows.map(|row| row.word);
        let error_bits = self.error_bits();
        let mut words = LawWords {
            kp,
            ki_dt,
            kd_per_dt,
            velocity_ff,
            acceleration_ff,
            friction_ff,
            error_bits,
            integral_bits: 0,
            derivative: self.settings.derivative,
            filter,
            anti_windup: self.anti_windup()?,
        };
        let mut refused = None;
        for integral_bits in self.integral_bits(wanted[1].wanted, error_bits).rev() {
            words.integral_bits = integral_bits;
            match Law::accept(words, dac) {
                Ok(law) => {
                    let rows = rows.to_vec();
                    return Ok(ScaledLaw { law, rows });
                }
                // The range that was wanted says what is in the way.
                Err(refusal) => refused = refused.or(Some(refusal)),
            }
        }
        // At least one was tried.
        Err(refused.map_or(QuantiseError::NoSampleTime, QuantiseError::Refused))
    }

    /// Exponent of the range of errors: by need, at least 2^17. What no range
    /// holds, the firmware refuses.
    fn error_bits(&self) -> u8 {
        let holds = |&bits: &u8| self.allowed_error_counts <= power_of_two(bits);
        let bits = (ErrorRange::MIN_BITS..=ErrorRange::MAX_BITS).find(holds);
        bits.unwrap_or(ErrorRange::MAX_BITS + 1)
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
        let smoothing = word31(
            dt_s / (filter_s + dt_s),
            "controller.derivative_filter_s",
            filter_s,
            "Δt/(T_f + Δt) is 0 in 31 bits; at most 10^9 sample times are more",
        )?;
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
                AntiWindup::BackCalculation {
                    tracking: word31(
                        dt_s / tracking_s,
                        "controller.tracking_time_s",
                        tracking_s,
                        "it must be longer than the sample time and at most 10^9 of them",
                    )?,
                }
            }
        })
    }

    /// The largest value of the gain of a part of [`PARTS`] that fits, rounded down to five digits, so
    /// that what a table prints fits too; 0 if none does.
    pub fn largest_gain(&self, index: usize) -> f64 {
        let fits = |value: f64| {
            let mut request = *self;
            request.gains[index] = value;
            request.settle().is_ok()
        };
        // Whole powers of two first, then halves of the interval.
        let mut low = 0.0;
        let mut high = f64::INFINITY;
        for exponent in -60..60 {
            let value = 2_f64.powi(exponent);
            if fits(value) {
                low = value;
            } else if low > 0.0 {
                high = value;
                break;
            }
        }
        if !high.is_finite() {
            return rounded_down(low, 5);
        }
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
        let error_limit = ErrorRange::from_bits(self.error_bits()).map_or(0, ErrorRange::limit);
        let unfit =
            PARTS
                .into_iter()
                .zip(self.gains)
                .enumerate()
                .filter_map(|(index, (part, value))| {
                    let largest = self.largest_gain(index);
                    // A gain is to blame if a smaller one cures.
                    (value > 0.0 && largest > 0.0 && largest < value).then_some(UnfitGain {
                        key: key(part),
                        value,
                        largest,
                        error_limit,
                    })
                });
        let unfit: Vec<_> = unfit.collect();
        if unfit.is_empty() {
            QuantiseError::Refused(error)
        } else {
            QuantiseError::Gains(unfit)
        }
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
