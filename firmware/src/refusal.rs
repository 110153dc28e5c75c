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

/// The settings that can be refused, each with its sentence.
macro_rules! settings {
    (
        $(#[$about:meta])*
        pub enum What($value:ident, $least:ident, $most:ident) {
            $(
                $(#[$doc:meta])*
                $what:ident $(($($part:tt: $of:ty),*))? => $sentence:literal $(, $more:expr)*;
            )*
        }
    ) => {
        $(#[$about])*
        pub enum What {
            $($(#[$doc])* $what $(($($of),*))?,)*
        }

        impl Refusal {
            /// The sentence of the setting, with its value and its range.
            fn say(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let ($value, $least, $most) = (self.value, self.least, self.most);
                match self.what {
                    $(What::$what $(($($part),*))? => write!(f, $sentence $(, $more)*),)*
                }
            }
        }
    };
}

settings! {
    /// A setting that can be refused; its unit is that of the values beside it.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    #[non_exhaustive]
    pub enum What(value, least, most) {
        /// Bits of the converter.
        DacBits => "a D/A converter of {value} bits is not supported; \
            it must have {least} to {most} bits";
        /// Slew limit \[codes per sample\].
        SlewCodes => "a slew limit of {value} codes per sample is not supported; \
            it must be {least} to {most}";
        /// Width of a counter \[bits\].
        CounterBits => "a counter of {value} bits is not supported; \
            it must have between {least} and {most}";
        /// Largest jump of a counter with so many bits \[counts\].
        LargestJump(bits: u8) => "a largest jump of {value} counts cannot be told from a wrap of \
            {bits} bits or lets no axis move; it must lie between {least} and {most}";
        /// Entries of the setpoint table, at least.
        Setpoints => "the motion needs {value} setpoints but the table holds {most}; \
            a longer sample time or a shorter motion needs fewer";
        /// Exponent of the error range.
        ErrorBits => "an error range of 2^{value} counts is not supported; \
            the exponent must lie between {least} and {most}";
        /// Exponent of the integral's range.
        IntegralBits => "an integral of 2^{value} codes is not supported; \
            the exponent must be at most {most}";
        /// Mantissa of a gain that is negative.
        Gain(part: Part, word: GainWord) => "the word {word} of {part} is negative; \
            a gain must be at least {least}";
        /// Fraction bits of a gain.
        FractionBits(part: Part, word: GainWord) => "the word {word} of {part} has {value} \
            fraction bits; it must have between {least} and {most} of them";
        /// Largest integer that a gain multiplies: the term needs more than 62 bits.
        Term(part: Part, word: GainWord) => "the word {word} of {part} times {value} needs more \
            than 62 bits; a smaller gain or a smaller range fits";
        /// Largest difference that `Kd/Δt` serves \[counts\].
        Difference(word: GainWord) => "the word {word} of Kd/Δt is too coarse for differences up \
            to {value} counts: they must be at most 2^{}", word.fraction_bits;
        /// Largest sum of all terms \[codes\].
        Terms => "the terms of the law add up to {value} codes; \
            they must stay within {most}: smaller gains or smaller ranges fit";
        /// Declared range of the sum of errors \[counts\].
        ErrorSum => "the words let the sum of errors reach {value} counts; \
            it must reach {least}: 2^8 errors of the largest size";
        /// `Δt/(T_f + Δt)·2^31`.
        FilterSmoothing => "the filter's word is {value}; \
            Δt/(T_f + Δt)·2^31 must be between 1 and 2^31 − 1";
        /// Fraction bits of the filtered difference.
        FilterFractionBits => "the filtered difference has {value} fraction bits; \
            the accuracy needs at least {least}, and its range and the sum leave at most {most}";
        /// `Δt/T_t·2^31`.
        Tracking => "the tracking word is {value}; Δt/T_t·2^31 must be between 1 and 2^31 − 1";
        /// Sample time of a motion \[ns\].
        Period => "the sample time is {value}; it must be at least {least} ns";
        /// Travel of a motion \[2^−32 counts\].
        Travel => "a travel of {value}/2^32 counts is too long; \
            it must be shorter than 2^31 counts";
        /// Intervals 1 to 3 together: no speed is gained.
        Rise => "the intervals 1 to 3 are all 0; one of them must be longer to gain speed";
        /// Intervals 5 to 7 together: the speed is not lost again.
        Fall => "the intervals 5 to 7 are all 0; one of them must be longer to lose speed";
        /// Intervals together \[ps\].
        Duration => "the intervals add up to {value} ps; together they may last 2^62 ps, 53 days";
        /// Peak of the velocity \[counts per sample\].
        Velocity => "the motion reaches {value} counts per sample; \
            it must stay below 2^24, with a longer motion or a shorter sample time";
        /// Peak of the acceleration in an interval, 1 to 7 \[counts per sample²\].
        Acceleration(interval: u8) => "interval {interval} accelerates by {value} counts per \
            sample²; it must stay below 2^24, with a longer interval or a shorter sample time";
        /// Stretches of a planned motion.
        Stretches => "the motion has {value} stretches; \
            there is room for {most}, which a smaller feed-forward or a slower motion needs";
        /// Limit of the following error \[counts\].
        FollowingError => "a following error limit of {value} counts is of no use; \
            it must lie between {least} and {most}";
        /// Mantissa of the lag that is allowed per speed.
        Lag(per_speed: GainWord) => "the following error's share per speed {per_speed} is \
            negative; it must be at least {least}";
        /// Fraction bits of the lag.
        LagFractionBits(per_speed: GainWord) => "the following error's share per speed {per_speed} \
            has {value} fraction bits; it must have at most {most}";
        /// Fraction bits of the setpoints' velocities.
        VelocityFractionBits => "velocities of {value} fraction bits are not supported; \
            they must have at most {most}";
        /// Code that must move the axis.
        EncoderLossCode => "a code threshold of {value} cannot tell a lost encoder; \
            it must lie between {least} and {most}";
        /// Samples after which an encoder is lost.
        EncoderLossSamples => "an encoder cannot be lost after {value} samples; \
            it must be at least {least} sample";
        /// Samples at a limit of the output.
        SaturationSamples => "{value} samples at a limit are never passed; \
            the number must be below {value}";
        /// Half gap \[motor counts\].
        HalfGap => "a half gap of {value} counts is too large; it must be at most {most}";
        /// Half gap \[motor counts\] for which the motion leaves nothing of this
        /// velocity or acceleration \[2^−32 counts per sample, per sample²\].
        NoRoom([velocity, acceleration]: [u64; 2]) => "the motion leaves {velocity}·2^-32 \
            counts/sample and {acceleration}·2^-32 counts/sample² of the axis' limits; \
            a half gap of {value} counts cannot be taken up unless both are above 0";
        /// Half gap \[motor counts\] that takes too many samples to cross with this
        /// velocity and acceleration \[2^−32 counts per sample, per sample²\].
        Crossing([velocity, acceleration]: [u64; 2]) => "with {velocity}·2^-32 counts/sample and \
            {acceleration}·2^-32 counts/sample² left of the axis' limits a half gap of {value} \
            counts takes more than 131070 samples to cross; a slower motion leaves more";
        /// Speed of creep \[2^−16 counts per sample\].
        CreepSpeed => "a creep of {value}·2^-16 counts/sample is not supported; \
            it must lie between {least} and {most}";
        /// Longest creep \[counts\].
        LongestCreep => "a longest creep of {value} counts is not supported; \
            it must lie between {least} and {most}";
        /// Motor counts per load count \[2^−16\].
        LoadRatio => "{value}·2^-16 motor counts per load count are not supported; \
            it must lie between {least} and {most}";
        /// Threshold by which the load is seen to follow.
        Detection => "a detection with a threshold of {value} sees a load where none is; \
            it must be at least {least}";
    }
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
        if (self.what, self.value) == (What::Setpoints, 0) {
            return f.write_str(
                "the setpoint table is empty; it needs at least the setpoint of the first sample",
            );
        }
        self.say(f)
    }
}

impl core::error::Error for Refusal {}
