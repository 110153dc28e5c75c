//! Why a controller's settings cannot be put into the firmware's words.

use std::fmt;

use firmware::refusal::What;
use firmware::{ErrorRange, Refusal};

/// Largest error range \[counts\].
const MAX_ERROR: u64 = 1 << ErrorRange::MAX_BITS;

/// A gain that no word can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnfitGain {
    /// Key in the run file.
    pub key: &'static str,
    /// Value in the run file.
    pub value: f64,
    /// Largest value that fits this sample time and error range.
    pub largest: f64,
    /// The errors that the travel asks for \[counts\].
    pub error_limit: i32,
}

impl UnfitGain {
    /// What is allowed, as the second half of a sentence.
    pub fn because(&self) -> String {
        if self.value.is_finite() && self.value >= 0.0 {
            format!(
                "the firmware's words hold at most {} at this sample time and errors up to {} counts",
                rounded_down(self.largest, 6),
                self.error_limit
            )
        } else {
            "a gain must be finite and at least 0".to_owned()
        }
    }
}

/// Why a controller's settings cannot be put into the firmware's words. The
/// run cannot start.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum QuantiseError {
    /// The travel is too long for the largest error range \[counts\].
    Travel(i64),
    /// Gains that no word can hold: all of them.
    Gains(Vec<UnfitGain>),
    /// The firmware refuses the words.
    Words(Refusal),
    /// The firmware refuses the words of its law.
    Law(Refusal),
    /// A setting that has no word.
    Setting {
        /// Key in the run file.
        key: &'static str,
        /// Value in the run file.
        value: f64,
        /// What is allowed, as the second half of a sentence.
        because: String,
    },
    /// The motion cannot be generated on the chip.
    Motion(Refusal),
    /// The gap could not be measured.
    Gap(String),
    /// Without a sample time there are no words.
    NoSampleTime,
    /// The delay is to be measured on a chip, and none takes part.
    DelayUnknown,
    /// The electronics cannot be had.
    Io(String),
    /// The setpoints do not fit the table.
    Setpoints(Refusal),
    /// The firmware knows no converter of that many bits.
    Dac(Refusal),
}

impl QuantiseError {
    /// The error of a motion with `needed` samples, for callers that know the
    /// number before they have computed the samples.
    pub fn too_long(needed: u64, capacity: usize) -> Self {
        Self::Setpoints(Refusal {
            what: What::Setpoints,
            value: i64::try_from(needed).unwrap_or(i64::MAX),
            least: 1,
            most: i64::try_from(capacity).unwrap_or(i64::MAX),
        })
    }
}

impl fmt::Display for QuantiseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Travel(counts) => write!(
                f,
                "the travel makes {counts} encoder counts; the firmware takes at most {}",
                MAX_ERROR / 2
            ),
            Self::Gains(unfit) => {
                for (i, gain) in unfit.iter().enumerate() {
                    let separator = if i == 0 { "" } else { "\n" };
                    let (key, value) = (gain.key, gain.value);
                    write!(f, "{separator}{key} = {value}: {}", gain.because())?;
                }
                Ok(())
            }
            Self::Words(error) => error.fmt(f),
            Self::Law(error) => error.fmt(f),
            Self::Setting {
                key,
                value,
                because,
            } => write!(f, "{key} = {value}: {because}"),
            Self::Motion(error) => error.fmt(f),
            Self::NoSampleTime => f.write_str("a sampled law needs controller.sample_time_s"),
            Self::DelayUnknown => f.write_str(
                "only the steps of a chip are measured; run law \"firmware\" over a link to one \
                 (--link qemu), or give a number of seconds",
            ),
            Self::Gap(because) | Self::Io(because) => f.write_str(because),
            Self::Setpoints(error) => error.fmt(f),
            Self::Dac(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for QuantiseError {}

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
