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

use firmware::law::{AntiWindup, Derivative, FilterWords, Law, LawError, LawWords, Part};
use firmware::{Dac, DacError, ErrorRange};
use plant::PidGains;

use crate::options::{self, LawSettings};
use crate::quantise::{
    FixedPointGain, FixedPointGains, QuantiseError, UnfitGain, error_range, finest_word, key,
    power_of_two, rounded_down,
};

/// The gains that can be set, in the order of the law.
pub const GAIN_KEYS: [&str; 6] = [
    key(Part::Proportional),
    key(Part::Integral),
    key(Part::Derivative),
    key(Part::Velocity),
    key(Part::Acceleration),
    key(Part::Friction),
];

/// Everything that the fixed-point gains are made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScalingRequest {
    /// Shape of the law.
    pub settings: LawSettings,
    /// Gains per motor count.
    pub gains: PidGains,
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
    pub fn words(&self) -> Result<ScaledLaw, QuantiseError> {
        self.settle().map_err(|refusal| self.explain(refusal))
    }

    /// The gains, or the firmware's objection to them.
    fn settle(&self) -> Result<ScaledLaw, Refusal> {
        let dac = Dac::with_bits(self.dac_bits).map_err(Refusal::Dac)?;
        let range = error_range(self.travel_counts).ok_or(Refusal::Travel)?;
        let mut refused = None;
        // The finest words end at `most`; beyond it bits only cost range.
        let exponents = LawWords::SUM_FRACTION_BITS;
        let wanted = self.wanted();
        let most = wanted
            .iter()
            .filter(|wanted| wanted.gain != 0.0)
            .map(|wanted| {
                finest_word(self.rounded(wanted), 40, self.settings.word_bits).fraction_bits
            })
            .max()
            .unwrap_or(0)
            .clamp(*exponents.start(), *exponents.end());
        for sum_fraction_bits in (*exponents.start()..=most).rev() {
            // Twice the converter's range at least: Q = 2^n codes.
            let least = u8::try_from(self.dac_bits).unwrap_or(u8::MAX);
            for integral_bits in (least..=29).rev() {
                let words = self.with(&wanted, range, sum_fraction_bits, integral_bits)?;
                match Law::accept(words, dac) {
                    Ok(law) => {
                        let rows = rows(&wanted, law.words());
                        return Ok(ScaledLaw { law, rows });
                    }
                    // The widest resolution with the least range says what is
                    // really in the way.
                    Err(error) if sum_fraction_bits == most => refused = Some(error),
                    Err(_) => {}
                }
            }
        }
        Err(refused.map_or(Refusal::Travel, Refusal::Law))
    }

    /// The gains as the law multiplies them.
    fn wanted(&self) -> [Wanted; 6] {
        let dt_s = self.sample_time_ns as f64 / 1e9;
        let ratio = self.motor_counts_per_count;
        let feed_forward = &self.settings.feed_forward;
        let rates = self.rates;
        let wanted = |part, value, gain| Wanted { part, value, gain };
        let gains = &self.gains;
        [
            wanted(Part::Proportional, gains.kp, gains.kp * ratio),
            wanted(
                Part::Integral,
                gains.ki_per_s,
                // As the paper's law forms it: Δt in ns, over 10^9.
                gains.ki_per_s * self.sample_time_ns as f64 / 1e9 * ratio,
            ),
            wanted(
                Part::Derivative,
                gains.kd_s,
                gains.kd_s * 1e9 / self.sample_time_ns as f64,
            ),
            wanted(
                Part::Velocity,
                feed_forward.velocity_s,
                feed_forward.velocity_s * ratio / dt_s / power_of_two(rates.velocity),
            ),
            wanted(
                Part::Acceleration,
                feed_forward.acceleration_s2,
                feed_forward.acceleration_s2 * ratio
                    / (dt_s * dt_s)
                    / power_of_two(rates.acceleration),
            ),
            wanted(
                Part::Friction,
                feed_forward.friction_codes,
                feed_forward.friction_codes,
            ),
        ]
    }

    /// The gain to the fraction bits that were asked for: a multiple of a power
    /// of two, which its word holds exactly where it has that many bits.
    fn rounded(&self, wanted: &Wanted) -> f64 {
        let is_gain = matches!(
            wanted.part,
            Part::Proportional | Part::Integral | Part::Derivative
        );
        match self.settings.gain_fraction_bits {
            Some(bits) if is_gain => {
                (wanted.gain * power_of_two(bits)).round() / power_of_two(bits)
            }
            _ => wanted.gain,
        }
    }

    /// The words at one exponent of the sum and one range of the integral.
    fn with(
        &self,
        wanted: &[Wanted; 6],
        range: ErrorRange,
        sum_fraction_bits: u8,
        integral_bits: u8,
    ) -> Result<LawWords, Refusal> {
        let settings = &self.settings;
        let filter = self.filter(wanted[2].gain)?;
        let word = |wanted: &Wanted| {
            // The filtered difference brings fraction bits of its own.
            let own = match (wanted.part, filter) {
                (Part::Derivative, Some(filter)) => filter.fraction_bits,
                _ => 0,
            };
            let most = sum_fraction_bits.saturating_sub(own);
            finest_word(self.rounded(wanted), most, settings.word_bits)
        };
        let [
            kp,
            ki_dt,
            kd_per_dt,
            velocity_ff,
            acceleration_ff,
            friction_ff,
        ] = wanted.each_ref().map(word);
        Ok(LawWords {
            kp,
            ki_dt,
            kd_per_dt,
            velocity_ff,
            acceleration_ff,
            friction_ff,
            error_bits: range.bits(),
            sum_fraction_bits,
            integral_bits,
            derivative: match settings.derivative {
                options::Derivative::Error => Derivative::Error,
                options::Derivative::Measurement => Derivative::Measurement,
            },
            filter,
            anti_windup: self.anti_windup()?,
        })
    }

    /// `a = Δt/(T_f + Δt)`, and the fewest fraction bits with
    /// `(Kd/Δt)·2^−h ≤ 1/16`.
    fn filter(&self, kd_per_dt: f64) -> Result<Option<FilterWords>, Refusal> {
        let filter_s = self.settings.derivative_filter_s;
        if filter_s == 0.0 {
            return Ok(None);
        }
        let dt_s = self.sample_time_ns as f64 / 1e9;
        let smoothing = word31(dt_s / (filter_s + dt_s)).ok_or(Refusal::Filter)?;
        let needed = (0..29).find(|&h| 16.0 * kd_per_dt <= power_of_two(h));
        Ok(Some(FilterWords {
            smoothing,
            fraction_bits: needed.unwrap_or(29),
        }))
    }

    fn anti_windup(&self) -> Result<AntiWindup, Refusal> {
        Ok(match self.settings.anti_windup {
            options::AntiWindup::None => AntiWindup::None,
            options::AntiWindup::Clamp => AntiWindup::Clamp,
            options::AntiWindup::BackCalculation => {
                let dt_s = self.sample_time_ns as f64 / 1e9;
                let tracking = word31(dt_s / self.settings.tracking_time_s);
                AntiWindup::BackCalculation {
                    tracking: tracking.ok_or(Refusal::Tracking)?,
                }
            }
        })
    }

    /// The value of a gain by its place in [`GAIN_KEYS`].
    fn gain_mut(&mut self, index: usize) -> &mut f64 {
        let feed_forward = &mut self.settings.feed_forward;
        match index {
            0 => &mut self.gains.kp,
            1 => &mut self.gains.ki_per_s,
            2 => &mut self.gains.kd_s,
            3 => &mut feed_forward.velocity_s,
            4 => &mut feed_forward.acceleration_s2,
            _ => &mut feed_forward.friction_codes,
        }
    }

    /// The largest value of a gain that fits, rounded down to five digits, so
    /// that what a table prints fits too; 0 if none does.
    pub fn largest_gain(&self, index: usize) -> f64 {
        let fits = |value: f64| {
            let mut request = *self;
            *request.gain_mut(index) = value;
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

    /// The refusal in terms of the run file.
    fn explain(&self, refusal: Refusal) -> QuantiseError {
        match refusal {
            Refusal::Dac(error) => QuantiseError::Dac(error),
            Refusal::Travel => QuantiseError::Travel(self.travel_counts),
            Refusal::Filter => QuantiseError::Setting {
                key: "controller.derivative_filter_s",
                value: self.settings.derivative_filter_s,
                because: "Δt/(T_f + Δt) has no word of 31 bits; at most 10^9 sample times do"
                    .to_owned(),
            },
            Refusal::Tracking => QuantiseError::Setting {
                key: "controller.tracking_time_s",
                value: self.settings.tracking_time_s,
                because: "it must be longer than the sample time and at most 10^9 of them"
                    .to_owned(),
            },
            Refusal::Law(error) => {
                let error_limit = error_range(self.travel_counts).map_or(0, |range| range.limit());
                let mut unfit = Vec::new();
                for (index, key) in GAIN_KEYS.into_iter().enumerate() {
                    let value = *{ *self }.gain_mut(index);
                    let largest = self.largest_gain(index);
                    // A gain is to blame if a smaller one cures.
                    if value > 0.0 && largest > 0.0 && largest < value {
                        unfit.push(UnfitGain {
                            key,
                            value,
                            largest,
                            error_limit,
                        });
                    }
                }
                if let Some(bits) = self.fewest_bits() {
                    QuantiseError::Setting {
                        key: "controller.word_bits",
                        value: f64::from(self.settings.word_bits),
                        because: format!(
                            "these gains need words of at least {bits} bits to stay within one code \
                             of the exact law ({error})"
                        ),
                    }
                } else if unfit.is_empty() {
                    QuantiseError::Law(error)
                } else {
                    QuantiseError::Gains(unfit)
                }
            }
        }
    }
}

/// A gain before it is in fixed point.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    part: Part,
    value: f64,
    gain: f64,
}

fn rows(wanted: &[Wanted; 6], words: &LawWords) -> Vec<FixedPointGain> {
    let words = [
        words.kp,
        words.ki_dt,
        words.kd_per_dt,
        words.velocity_ff,
        words.acceleration_ff,
        words.friction_ff,
    ];
    let rows = wanted
        .iter()
        .zip(words)
        .map(|(wanted, word)| FixedPointGain {
            part: wanted.part,
            value: wanted.value,
            wanted: wanted.gain,
            word,
        });
    rows.collect()
}

/// A request without fixed-point gains.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Refusal {
    /// The firmware knows no converter of that many bits.
    Dac(DacError),
    /// The travel needs a larger error range than there is.
    Travel,
    /// `Δt/(T_f + Δt)` has no word.
    Filter,
    /// `Δt/T_t` has no word.
    Tracking,
    /// The firmware's objection to the last gains that were tried.
    Law(LawError),
}

/// `fraction·2^31` as a word from 1 to 2^31 − 1; `None` beyond.
fn word31(fraction: f64) -> Option<i32> {
    let word = (fraction * power_of_two(31)).round();
    // Whole and within the type: the conversion is exact.
    (1.0..=f64::from(i32::MAX))
        .contains(&word)
        .then_some(word as i32)
}
