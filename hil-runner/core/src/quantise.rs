//! Fixed-point gains.
//!
//! The firmware only accepts or rejects fixed-point gains; [`crate::scaling`] is
//! where they are chosen. Per sample the law needs `Kp`, `Ki·Δt` and `Kd/Δt` in
//! codes per count (eq. 23 at `t = k·Δt`). Each becomes `w·2^−f` with the largest
//! `f` for which `w` fits its bits, so that
//!
//! ```text
//! |w·2^−f − gain| ≤ ½·2^−f        half a unit of the last place
//! ```
//!
//! which is what the firmware's error budget assumes (`firmware::law::words`). The
//! products with `Δt` are formed in f64 from the decimal gain and the whole
//! nanoseconds; together with the reading of the decimal that is at most four
//! roundings of 2^−53. The terms of the law are below 2^30 codes, so these
//! shift the sum by less than 2^−20 codes, against a slack of 1/64 code.

use core::fmt::Display;

use firmware::law::Part;
use firmware::{GainWord, Refusal};

use crate::number::table;

/// One gain of the law in fixed point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPointGain {
    /// Part of the law.
    pub part: Part,
    /// Value in the run file, in its key's unit.
    pub value: f64,
    /// Its formula, if it is from the plant.
    pub from_plant: Option<&'static str>,
    /// The gain that the law multiplies by, per sample.
    pub wanted: f64,
    /// The fixed-point number that stands for it.
    pub word: GainWord,
}

impl FixedPointGain {
    /// Key in the run file.
    pub fn key(&self) -> &'static str {
        key(self.part)
    }

    /// The gain as the law has it.
    pub fn name(&self) -> &'static str {
        words(self.part)[1]
    }

    /// Its unit in the law: rates come in units of their own.
    pub fn unit(&self) -> &'static str {
        words(self.part)[2]
    }

    /// Number and formula of one from the plant: `velocity_ff_s = 0.026849 from the plant: …`.
    pub fn of_plant(&self) -> Option<String> {
        let key = self.key().trim_start_matches("controller.");
        let value = table(self.value);
        let formula = self.from_plant?;
        Some(format!("{key} = {value} from the plant: {formula}"))
    }

    /// True for one of the three gains of eq. 23, which are shown even
    /// where they are 0.
    pub fn is_of_the_paper(&self) -> bool {
        PARTS[..3].contains(&self.part)
    }

    /// `(value of the fixed-point number − wanted)/wanted`; 0 where nothing is wanted.
    pub fn relative_error(&self) -> f64 {
        if self.wanted == 0.0 {
            0.0
        } else {
            (value(self.word) - self.wanted) / self.wanted
        }
    }
}

/// The parts of the law that have a gain, in its order.
pub const PARTS: [Part; 6] = [
    Part::Proportional,
    Part::Integral,
    Part::Derivative,
    Part::Velocity,
    Part::Acceleration,
    Part::Friction,
];

/// The run file's key of a gain, its name in the law and its unit there.
fn words(part: Part) -> [&'static str; 3] {
    match part {
        Part::Proportional => ["controller.kp", "Kp", "codes/count"],
        Part::Integral => ["controller.ki_per_s", "Ki·Δt", "codes/count"],
        Part::Derivative => ["controller.kd_s", "Kd/Δt", "codes/count"],
        Part::Velocity => ["controller.velocity_ff_s", "Kv/Δt", "codes/unit of v"],
        Part::Acceleration => ["controller.acceleration_ff_s2", "Ka/Δt²", "codes/unit of a"],
        Part::Friction => ["controller.friction_ff_codes", "Kf", "codes"],
    }
}

/// The run file's key of a gain.
pub fn key(part: Part) -> &'static str {
    words(part)[0]
}

/// Number and formula of the gains that are from the plant, a line each.
pub fn from_plant(rows: &[FixedPointGain]) -> String {
    let lines = rows.iter().filter_map(FixedPointGain::of_plant);
    lines.map(|line| line + "\n").collect()
}

/// The gains of a run as tables and reports show them.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedPointGains {
    /// The gains that are not left out.
    pub rows: Vec<FixedPointGain>,
    /// `E`: errors up to this size are within the declared range \[counts\].
    pub error_limit: i32,
}

/// The number with the most fraction bits, at most `max`, whose mantissa fits
/// `mantissa_bits` bits; for gains from 0 to 2^`mantissa_bits` − 1.
pub(crate) fn finest_word(gain: f64, max: u8, mantissa_bits: u32) -> GainWord {
    let largest = ((1_u64 << mantissa_bits) - 1) as f64;
    let mantissa = |bits: u8| (gain * power_of_two(bits)).round();
    let bits = (0..=max).rev().find(|&bits| mantissa(bits) <= largest);
    let bits = bits.unwrap_or(0);
    // Whole and within the type: the conversion is exact.
    GainWord::new(mantissa(bits) as i32, bits)
}

/// `2^exponent` for exponents below 64, exactly.
pub(crate) fn power_of_two(exponent: u8) -> f64 {
    (1_u64 << exponent) as f64
}

/// The value of a fixed-point number, exactly: 31 bits and a power of two.
fn value(word: GainWord) -> f64 {
    f64::from(word.mantissa) / power_of_two(word.fraction_bits)
}

/// `value` with so many significant digits, rounded down so that what a message
/// calls allowed is allowed.
pub(crate) fn rounded_down(value: f64, significant: i32) -> f64 {
    if value == 0.0 {
        return value;
    }
    let digits = significant - 1 - value.log10().floor() as i32;
    // Dividing by a power of ten gives the nearest number to the decimal;
    // multiplying by a negative power of ten would not.
    if digits >= 0 {
        let scale = 10_f64.powi(digits);
        (value * scale).floor() / scale
    } else {
        let scale = 10_f64.powi(-digits);
        (value / scale).floor() * scale
    }
}

/// A gain that no fixed-point number can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnfitGain {
    /// Key in the run file.
    pub key: &'static str,
    /// Value in the run file.
    pub value: f64,
    /// True of one that the plant makes.
    pub from_plant: bool,
    /// Largest value that fits this sample time and error range.
    pub largest: f64,
    /// The errors that are allowed \[counts\].
    pub error_limit: i32,
}

impl UnfitGain {
    /// The allowed, as the second half of a sentence.
    pub fn because(&self) -> String {
        let made = match self.from_plant {
            true => format!("the plant makes it {}; ", table(self.value)),
            false => String::new(),
        };
        if self.value.is_finite() && self.value >= 0.0 {
            format!(
                "{made}the firmware's fixed-point gains hold at most {} at this sample time and errors \
                 up to {} counts",
                rounded_down(self.largest, 6),
                self.error_limit
            )
        } else {
            format!("{made}a gain must be finite and at least 0")
        }
    }
}

/// Settings of a controller that the firmware cannot have. The run cannot start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantiseError {
    /// Gains that no fixed-point number can hold: all of them.
    #[error("{}", lines(.0))]
    Gains(Vec<UnfitGain>),
    /// The firmware refuses its law, its converter, its motion or its setpoints.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// A setting that has no fixed-point form.
    #[error("{key} = {value}: {because}")]
    Setting {
        /// Key in the run file.
        key: &'static str,
        /// Value in the run file.
        value: f64,
        /// The allowed, as the second half of a sentence.
        because: String,
    },
    /// The gap could not be measured, or the electronics cannot be had; a sentence.
    #[error("{0}")]
    Bench(String),
    /// Without a sample time there are no gains per sample.
    #[error("a sampled law needs controller.sample_time_s")]
    NoSampleTime,
    /// The delay is to be measured on a chip, and none takes part.
    #[error(
        "only the steps of a chip are measured; run law \"firmware\" over a link to one \
         (--link qemu), or give a number of seconds"
    )]
    DelayUnknown,
}

impl QuantiseError {
    /// A setting that is refused.
    pub(crate) fn setting(key: &'static str, value: f64, because: impl Display) -> Self {
        Self::Setting {
            key,
            value,
            because: because.to_string(),
        }
    }

    /// The same for what the firmware says of the setting of that key.
    pub(crate) fn of<E: Display>(key: &'static str, value: f64) -> impl FnOnce(E) -> Self {
        move |refusal| Self::setting(key, value, refusal)
    }
}

/// One gain a line.
fn lines(unfit: &[UnfitGain]) -> String {
    let line = |gain: &UnfitGain| format!("{} = {}: {}", gain.key, gain.value, gain.because());
    unfit.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_mantissa_rounds_by_less_than_2_to_the_minus_31() {
        let mut gain = 1e-3;
        while gain < 2_000.0 {
            let word = finest_word(gain, 40, 31);
            assert!(word.mantissa >= 1 << 30, "{gain}: {word}");
            let off = (value(word) - gain).abs();
            assert!(off <= gain / 2_147_483_648.0, "{gain}");
            gain *= 1.037;
        }
    }
}
