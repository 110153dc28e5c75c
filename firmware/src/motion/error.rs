//! Why a motion cannot be generated.

use core::fmt;

/// Why a motion has no plan. Nothing was built; the axis stays where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MotionError {
    /// The sample time is 0.
    Period,
    /// The travel is 2^31 counts or longer.
    Travel {
        /// The travel given \[2^−32 counts\].
        travel: i64,
    },
    /// The intervals 1 to 3 are all 0: no speed is gained.
    NoAcceleration,
    /// The intervals 5 to 7 are all 0: the speed is not lost again.
    NoDeceleration,
    /// The intervals add up to more than 2^62 ps, 53 days.
    Duration {
        /// Their sum \[ps\], held at the end of the type.
        total_ps: u64,
    },
    /// The motion is faster than 2^30 counts per sample.
    Speed {
        /// Its peak \[counts per sample\], rounded.
        counts_per_sample: u64,
    },
    /// The acceleration at some sample is more than 2^30 counts per sample².
    Acceleration {
        /// Which interval, 1 to 7.
        interval: u8,
        /// Its peak \[counts per sample²\], rounded.
        counts_per_sample2: u64,
    },
    /// An interval has so many samples that their roundings could add up to
    /// a quarter of a count.
    Samples {
        /// Which interval, 1 to 7.
        interval: u8,
        /// Samples in it.
        samples: u64,
        /// Most samples that are accepted with this amplitude.
        max: u64,
    },
}

impl fmt::Display for MotionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Period => write!(f, "the sample time is 0; it must be at least 1 ns"),
            Self::Travel { travel } => write!(
                f,
                "a travel of {travel}/2^32 counts is too long; it must be shorter than 2^31 counts"
            ),
            Self::NoAcceleration => write!(
                f,
                "the intervals 1 to 3 are all 0; one of them must be longer to gain speed"
            ),
            Self::NoDeceleration => write!(
                f,
                "the intervals 5 to 7 are all 0; one of them must be longer to lose speed"
            ),
            Self::Duration { total_ps } => write!(
                f,
                "the intervals add up to {total_ps} ps; together they may last 2^62 ps, 53 days"
            ),
            Self::Speed { counts_per_sample } => write!(
                f,
                "the motion reaches {counts_per_sample} counts per sample; \
                 it must stay below 2^30, with a longer motion or a shorter sample time"
            ),
            Self::Acceleration {
                interval,
                counts_per_sample2,
            } => write!(
                f,
                "interval {interval} accelerates by {counts_per_sample2} counts per sample²; \
                 it must stay below 2^30, with a longer interval or a shorter sample time"
            ),
            Self::Samples {
                interval,
                samples,
                max,
            } => write!(
                f,
                "interval {interval} has {samples} samples; \
                 up to {max} of them are exact to a quarter of a count"
            ),
        }
    }
}

impl core::error::Error for MotionError {}
