//! Settings in SI units → the words of the product's law (`firmware::law`).
//!
//! The firmware accepts or rejects words; this is where they are chosen. The
//! sum's exponent `F` trades resolution against range: more fraction bits make
//! finer words, fewer leave room for larger gains, errors and integrals. Taken
//! is the largest `F` from which no word gains anything more, and with it the
//! widest integral, for which the firmware's proof goes through.
//!
//! Gains are in codes per motor count in the run file. Where the position
//! comes from the load, `Kp` and `Ki` act on load counts and are converted:
//! one load count is `ρ` motor counts.

pub mod fitting;
mod options;
mod shown;

pub use shown::{CaseWords, ShownWord};

use firmware::law::{Derivative, Law, LawWords, Part};
use firmware::{Dac, ErrorRange, GainWord};
use plant::PidGains;

use crate::quantise::{QuantiseError, error_range, finest_word, power_of_two};
use crate::servo::{self, LawSettings};

/// What the words are made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WordRequest {
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

/// One word with what it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WordRow {
    /// Key in the run file.
    pub key: &'static str,
    /// Part of the law.
    pub part: Part,
    /// Value of the run file, in the key's unit.
    pub value: f64,
    /// The gain that the law multiplies by.
    pub wanted: f64,
    /// The word that stands for it.
    pub word: GainWord,
}

impl WordRow {
    /// Whether it is one of the three gains of eq. 23, which are shown even
    /// where they are 0.
    pub fn is_of_the_paper(&self) -> bool {
        matches!(
            self.part,
            Part::Proportional | Part::Integral | Part::Derivative
        )
    }

    /// `(value of the word − wanted)/wanted`; 0 where nothing is wanted.
    pub fn relative_error(&self) -> f64 {
        let worth = f64::from(self.word.mantissa) / power_of_two(self.word.fraction_bits);
        if self.wanted == 0.0 {
            0.0
        } else {
            (worth - self.wanted) / self.wanted
        }
    }
}

/// The law of a run with the words that it was made of.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoWords {
    /// The accepted law.
    pub law: Law,
    /// Gains and feed-forward, in the order of the law.
    pub rows: Vec<WordRow>,
}

impl WordRequest {
    /// The words, chosen and accepted.
    ///
    /// # Errors
    /// [`QuantiseError`] that names the keys, their values and what fits.
    pub fn words(&self) -> Result<ServoWords, QuantiseError> {
        self.settle().map_err(|error| fitting::explain(self, error))
    }

    /// The words, or what the firmware says against them.
    fn settle(&self) -> Result<ServoWords, Refusal> {
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
                        return Ok(ServoWords { law, rows });
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
                servo::Derivative::Error => Derivative::Error,
                servo::Derivative::Measurement => Derivative::Measurement,
            },
            filter,
            anti_windup: self.anti_windup()?,
        })
    }
}

/// The run file's key of a gain.
pub const fn key(part: Part) -> &'static str {
    match part {
        Part::Proportional => "controller.kp",
        Part::Integral => "controller.ki_per_s",
        Part::Derivative => "controller.kd_s",
        Part::Velocity => "controller.velocity_ff_s",
        Part::Acceleration => "controller.acceleration_ff_s2",
        Part::Friction => "controller.friction_ff_codes",
    }
}

/// A gain before it is a word.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    part: Part,
    value: f64,
    gain: f64,
}

fn rows(wanted: &[Wanted; 6], words: &LawWords) -> Vec<WordRow> {
    let words = [
        words.kp,
        words.ki_dt,
        words.kd_per_dt,
        words.velocity_ff,
        words.acceleration_ff,
        words.friction_ff,
    ];
    let rows = wanted.iter().zip(words).map(|(wanted, word)| WordRow {
        key: key(wanted.part),
        part: wanted.part,
        value: wanted.value,
        wanted: wanted.gain,
        word,
    });
    rows.collect()
}

/// Why there are no words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Refusal {
    /// The firmware knows no converter of that many bits.
    Dac(firmware::Refusal),
    /// The travel needs a larger error range than there is.
    Travel,
    /// `Δt/(T_f + Δt)` has no word.
    Filter,
    /// `Δt/T_t` has no word.
    Tracking,
    /// What the firmware says against the last words that were tried.
    Law(firmware::Refusal),
}
