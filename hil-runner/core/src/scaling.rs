//! Settings in SI units → the fixed-point gains of the axis' law (`firmware::law`).
//!
//! The firmware accepts or rejects them; this is where they are chosen. The
//! sum's exponent `F` trades resolution against range: more fraction bits make
//! finer gains, fewer leave room for larger gains, errors and integrals. Taken
//! is the largest `F` from which no gain profits any more, and with it the
//! widest integral, for which the firmware's proof goes through. Where it refuses, the
//! largest gains that would fit are looked for, all other settings as they are.
//!
//! Gains are in codes per motor count in the run file. Where the position
//! comes from the load, `Kp` and `Ki` act on load counts and are converted:
//! one load count is `ρ` motor counts.

use firmware::law::{AntiWindup, FilterWords, Law, LawWords, Part};
use firmware::{Dac, GainWord};

use crate::options::{self, LawSettings};
use crate::quantise::{
    FixedPointGain, FixedPointGains, PARTS, QuantiseError, UnfitGain, error_range, finest_word,
    key, power_of_two, rounded_down,
};

/// Everything that the fixed-point gains are made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScalingRequest {
    /// Shape of the law; its feed-forward stands in `gains` and is not read here.
    pub settings: LawSettings,
    /// Gains per motor count and feed-forward, in the order of [`PARTS`].
    pub gains: [f64; 6],
    /// `Δt` \[ns\].
    pub sample_time_ns: u64,
    /// Travel \[counts of the encoder that the position comes from\].
    pub travel_counts: i64,
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

    /// The gains, or the firmware's objection to the last ones that were tried.
    fn settle(&self) -> Result<ScaledLaw, QuantiseError> {
        let dac = Dac::with_bits(self.dac_bits)?;
        let beyond = QuantiseError::Travel(self.travel_counts);
        let Some(range) = error_range(self.travel_counts) else {
            return Err(beyond);
        };
        let wanted = self.wanted();
        let filter = self.filter(wanted[2].wanted)?;
        let anti_windup = self.anti_windup()?;
        // Twice the converter's range at least: Q = 2^n codes.
        let least = u8::try_from(self.dac_bits).unwrap_or(u8::MAX);
        let mut refused = None;
        // The finest gains end at `most`; beyond it bits only cost range.
        let exponents = LawWords::SUM_FRACTION_BITS;
        let most = wanted
            .iter()
            .filter(|gain| gain.wanted != 0.0)
            .map(|gain| self.finest(gain, 40).fraction_bits)
            .max()
            .unwrap_or(0)
            .clamp(*exponents.start(), *exponents.end());
        for sum_fraction_bits in (*exponents.start()..=most).rev() {
            let rows = wanted.map(|gain| {
                // The filtered difference brings fraction bits of its own.
                let own = match (gain.part, filter) {
                    (Part::Derivative, Some(filter)) => filter.fraction_bits,
                    _ => 0,
                };
                let word = self.finest(&gain, sum_fraction_bits.saturating_sub(own));
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
            for integral_bits in (least..=29).rev() {
                let words = LawWords {
                    kp,
                    ki_dt,
                    kd_per_dt,
                    velocity_ff,
                    acceleration_ff,
                    friction_ff,
                    error_bits: range.bits(),
                    sum_fraction_bits,
                    integral_bits,
                    derivative: self.settings.derivative,
                    filter,
                    anti_windup,
                };
                match Law::accept(words, dac) {
                    Ok(law) => {
                        let rows = rows.to_vec();
                        return Ok(ScaledLaw { law, rows });
                    }
                    // The widest resolution with the least range says what is
                    // really in the way.
                    Err(error) if sum_fraction_bits == most => refused = Some(error),
                    Err(_) => {}
                }
            }
        }
        Err(refused.map_or(beyond, QuantiseError::Refused))
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
    fn finest(&self, gain: &FixedPointGain, most: u8) -> GainWord {
        let rounded = match self.settings.gain_fraction_bits {
            Some(bits) if gain.is_of_the_paper() => {
                (gain.wanted * power_of_two(bits)).round() / power_of_two(bits)
            }
            _ => gain.wanted,
        };
        finest_word(rounded, most, self.settings.word_bits)
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

    /// The fewest bits of a fixed-point gain that fit, if more than the present ones do.
    fn fewest_bits(&self) -> Option<u32> {
        (self.settings.word_bits + 1..=31).find(|&word_bits| {
            let mut request = *self;
            request.settings.word_bits = word_bits;
            request.settle().is_ok()
        })
    }

    /// The firmware's objection in terms of the run file.
    fn explain(&self, error: firmware::Refusal) -> QuantiseError {
        if let Some(bits) = self.fewest_bits() {
            let because = format!(
                "in fixed point these gains need at least {bits} bits to stay within one code \
                 of the exact law ({error})"
            );
            let word_bits = f64::from(self.settings.word_bits);
            return QuantiseError::setting("controller.word_bits", word_bits, because);
        }
        let error_limit = error_range(self.travel_counts).map_or(0, |range| range.limit());
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
