//! Settings that are not accepted: one shape for all of them.
//!
//! Whoever accepts settings gives a [`Refusal`] and builds or changes nothing,
//! so the run cannot start. Its sentence says the value and what would do.

use core::fmt;

use crate::wide;
use crate::word::{GainWord, Part};

/// A setting that is not accepted.
///
/// ```
/// use firmware::{Dac, Refusal, refusal::What};
///
/// let refusal = Dac::with_bits(25).unwrap_err();
/// assert_eq!(refusal, Refusal { what: What::DacBits, value: 25, least: 2, most: 24 });
/// assert_eq!(
///     refusal.to_string(),
///     "a D/A converter of 25 bits is not supported; it must have 2 to 24 bits"
/// );
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refusal {
    /// The setting.
    pub what: What,
    /// The value given, or what the settings come to.
    pub value: i64,
    /// The least value that is accepted.
    pub least: i64,
    /// The largest value that is accepted.
    pub most: i64,
}

/// A setting that can be refused; its unit is that of the values beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum What {
    /// Bits of the converter.
    DacBits,
    /// Slew limit \[codes per sample\].
    SlewCodes,
    /// Width of a counter \[bits\].
    CounterBits,
    /// Largest jump of a counter with so many bits \[counts\].
    LargestJump(u8),
    /// Entries of the setpoint table, at least.
    Setpoints,
    /// Exponent of the error range.
    ErrorBits,
    /// Exponent of the integral's range.
    IntegralBits,
    /// Mantissa of a gain that is negative.
    Gain(Part, GainWord),
    /// Fraction bits of a gain.
    FractionBits(Part, GainWord),
    /// Largest integer that a gain multiplies: the term needs more than 62 bits.
    Term(Part, GainWord),
    /// Largest difference that `Kd/Δt` serves \[counts\].
    Difference(GainWord),
    /// Largest sum of all terms \[codes\].
    Terms,
    /// Declared range of the sum of errors \[counts\].
    ErrorSum,
    /// `Δt/(T_f + Δt)·2^31`.
    FilterSmoothing,
    /// Fraction bits of the filtered difference.
    FilterFractionBits,
    /// `Δt/T_t·2^31`.
    Tracking,
    /// Sample time of a motion \[ns\].
    Period,
    /// Travel of a motion \[2^−32 counts\].
    Travel,
    /// Intervals 1 to 3 together: no speed is gained.
    Rise,
    /// Intervals 5 to 7 together: the speed is not lost again.
    Fall,
    /// Intervals together \[ps\].
    Duration,
    /// Peak of the velocity \[counts per sample\].
    Velocity,
    /// Peak of the acceleration in an interval, 1 to 7 \[counts per sample²\].
    Acceleration(u8),
    /// Stretches of a planned motion.
    Stretches,
    /// Limit of the following error \[counts\].
    FollowingError,
    /// Mantissa of the lag that is allowed per speed.
    Lag(GainWord),
    /// Fraction bits of the lag.
    LagFractionBits(GainWord),
    /// Fraction bits of the setpoints' velocities.
    VelocityFractionBits,
    /// Code that must move the axis.
    EncoderLossCode,
    /// Samples after which an encoder is lost.
    EncoderLossSamples,
    /// Samples at a limit of the output.
    SaturationSamples,
    /// Half gap \[motor counts\].
    HalfGap,
    /// Half gap \[motor counts\] for which the motion leaves nothing of this
    /// velocity or acceleration \[2^−32 counts per sample, per sample²\].
    NoRoom([u64; 2]),
    /// Half gap \[motor counts\] that takes too many samples to cross with this
    /// velocity and acceleration \[2^−32 counts per sample, per sample²\].
    Crossing([u64; 2]),
    /// Speed of creep \[2^−16 counts per sample\].
    CreepSpeed,
    /// Longest creep \[counts\].
    LongestCreep,
    /// Motor counts per load count \[2^−16\].
    LoadRatio,
    /// Threshold by which the load is seen to follow.
    Detection,
}

/// `?` for constant evaluation, which has none yet.
macro_rules! accepted {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(refusal) => return Err(refusal),
        }
    };
}

pub(crate) use accepted;

impl What {
    /// Refuses a value that is not allowed. Inlined, so that an image that drops
    /// a refusal makes none.
    #[inline(always)]
    pub(crate) const fn within(self, value: i64, allowed: [i64; 2]) -> Result<(), Refusal> {
        let [least, most] = allowed;
        if value < least || value > most {
            return Err(Refusal::new(self, value, allowed));
        }
        Ok(())
    }

    /// The same for words without sign.
    #[inline(always)]
    pub(crate) const fn word_within(
        self,
        value: u32,
        [least, most]: [u32; 2],
    ) -> Result<(), Refusal> {
        if value < least || value > most {
            let allowed = [wide::unsigned(least), wide::unsigned(most)];
            return Err(Refusal::new(self, wide::unsigned(value), allowed));
        }
        Ok(())
    }

    /// The same for bytes.
    #[inline(always)]
    pub(crate) const fn byte_within(
        self,
        value: u8,
        [least, most]: [u8; 2],
    ) -> Result<(), Refusal> {
        self.word_within(wide::byte(value), [wide::byte(least), wide::byte(most)])
    }

    /// The same for a mantissa, which must not be negative.
    #[inline(always)]
    pub(crate) const fn not_negative(self, mantissa: i32) -> Result<(), Refusal> {
        if mantissa < 0 {
            let allowed = [0, wide::signed(i32::MAX)];
            return Err(Refusal::new(self, wide::signed(mantissa), allowed));
        }
        Ok(())
    }
}

impl Refusal {
    pub(crate) const fn new(what: What, value: i64, [least, most]: [i64; 2]) -> Self {
        Self {
            what,
            value,
            least,
            most,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            what,
            value,
            least,
            most,
        } = *self;
        // A sentence of the setting, its value and its range.
        macro_rules! say {
            ($($sentence:tt)*) => { write!(f, $($sentence)*) };
        }
        match what {
            What::DacBits => say!(
                "a D/A converter of {value} bits is not supported; it must have {least} to {most} bits"
            ),
            What::SlewCodes => say!(
                "a slew limit of {value} codes per sample is not supported; \
                 it must be {least} to {most}"
            ),
            What::CounterBits => say!(
                "a counter of {value} bits is not supported; it must have between {least} and {most}"
            ),
            What::LargestJump(bits) => say!(
                "a largest jump of {value} counts cannot be told from a wrap of {bits} bits \
                 or lets no axis move; it must lie between {least} and {most}"
            ),
            What::Setpoints if value == 0 => say!(
                "the setpoint table is empty; it needs at least the setpoint of the first sample",
            ),
            What::Setpoints => say!(
                "the motion needs {value} setpoints but the table holds {most}; \
                 a longer sample time or a shorter motion needs fewer"
            ),
            What::ErrorBits => say!(
                "an error range of 2^{value} counts is not supported; \
                 the exponent must lie between {least} and {most}"
            ),
            What::IntegralBits => say!(
                "an integral of 2^{value} codes is not supported; the exponent must be at most {most}"
            ),
            What::Gain(part, word) => {
                say!("the word {word} of {part} is negative; a gain must be at least {least}")
            }
            What::FractionBits(part, word) => say!(
                "the word {word} of {part} has {value} fraction bits; \
                 it must have between {least} and {most} of them"
            ),
            What::Term(part, word) => say!(
                "the word {word} of {part} times {value} needs more than 62 bits; \
                 a smaller gain or a smaller range fits"
            ),
            What::Difference(word) => say!(
                "the word {word} of Kd/Δt is too coarse for differences up to {value} counts: \
                 they must be at most 2^{}",
                word.fraction_bits
            ),
            What::Terms => say!(
                "the terms of the law add up to {value} codes; they must stay within {most}: \
                 smaller gains or smaller ranges fit"
            ),
            What::ErrorSum => say!(
                "the words let the sum of errors reach {value} counts; \
                 it must reach {least}: 2^8 errors of the largest size"
            ),
            What::FilterSmoothing => say!(
                "the filter's word is {value}; Δt/(T_f + Δt)·2^31 must be between 1 and 2^31 − 1"
            ),
            What::FilterFractionBits => say!(
                "the filtered difference has {value} fraction bits; \
                 the accuracy needs at least {least}, and its range and the sum leave at most {most}"
            ),
            What::Tracking => {
                say!("the tracking word is {value}; Δt/T_t·2^31 must be between 1 and 2^31 − 1")
            }
            What::Period => say!("the sample time is {value}; it must be at least {least} ns"),
            What::Travel => say!(
                "a travel of {value}/2^32 counts is too long; it must be shorter than 2^31 counts"
            ),
            What::Rise => {
                say!("the intervals 1 to 3 are all 0; one of them must be longer to gain speed",)
            }
            What::Fall => {
                say!("the intervals 5 to 7 are all 0; one of them must be longer to lose speed",)
            }
            What::Duration => {
                say!("the intervals add up to {value} ps; together they may last 2^62 ps, 53 days")
            }
            What::Velocity => say!(
                "the motion reaches {value} counts per sample; \
                 it must stay below 2^24, with a longer motion or a shorter sample time"
            ),
            What::Acceleration(interval) => say!(
                "interval {interval} accelerates by {value} counts per sample²; \
                 it must stay below 2^24, with a longer interval or a shorter sample time"
            ),
            What::Stretches => say!(
                "the motion has {value} stretches; there is room for {most}, which a smaller \
                 feed-forward or a slower motion needs"
            ),
            What::FollowingError => say!(
                "a following error limit of {value} counts is of no use; \
                 it must lie between {least} and {most}"
            ),
            What::Lag(per_speed) => say!(
                "the following error's share per speed {per_speed} is negative; \
                 it must be at least {least}"
            ),
            What::LagFractionBits(per_speed) => say!(
                "the following error's share per speed {per_speed} has {value} fraction bits; \
                 it must have at most {most}"
            ),
            What::VelocityFractionBits => say!(
                "velocities of {value} fraction bits are not supported; \
                 they must have at most {most}"
            ),
            What::EncoderLossCode => say!(
                "a code threshold of {value} cannot tell a lost encoder; \
                 it must lie between {least} and {most}"
            ),
            What::EncoderLossSamples => say!(
                "an encoder cannot be lost after {value} samples; it must be at least {least} sample"
            ),
            What::SaturationSamples => say!(
                "{value} samples at a limit are never passed; the number must be below {value}"
            ),
            What::HalfGap => {
                say!("a half gap of {value} counts is too large; it must be at most {most}")
            }
            What::NoRoom([velocity, acceleration]) => say!(
                "the motion leaves {velocity}·2^-32 counts/sample and {acceleration}·2^-32 \
                 counts/sample² of the axis' limits; a half gap of {value} counts cannot be \
                 taken up unless both are above 0"
            ),
            What::Crossing([velocity, acceleration]) => say!(
                "with {velocity}·2^-32 counts/sample and {acceleration}·2^-32 counts/sample² \
                 left of the axis' limits a half gap of {value} counts takes more than \
                 131070 samples to cross; a slower motion leaves more"
            ),
            What::CreepSpeed => say!(
                "a creep of {value}·2^-16 counts/sample is not supported; \
                 it must lie between {least} and {most}"
            ),
            What::LongestCreep => say!(
                "a longest creep of {value} counts is not supported; \
                 it must lie between {least} and {most}"
            ),
            What::LoadRatio => say!(
                "{value}·2^-16 motor counts per load count are not supported; \
                 it must lie between {least} and {most}"
            ),
            What::Detection => say!(
                "a detection with a threshold of {value} sees a load where none is; \
                 it must be at least {least}"
            ),
        }
    }
}

impl core::error::Error for Refusal {}
