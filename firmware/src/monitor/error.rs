//! Why a monitor is not accepted.

use core::fmt;

use super::{EncoderLossMonitor, FollowingErrorMonitor};
use crate::word::GainWord;

/// Why a monitor is not accepted. Nothing was built; the axis cannot start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MonitorError {
    /// The limit of the following error would trip at the first count, or
    /// never.
    LimitCounts {
        /// The limit given \[counts\].
        limit_counts: u32,
    },
    /// The lag is negative.
    Negative {
        /// Its word.
        per_speed: GainWord,
    },
    /// Lag and velocity have too many fraction bits together.
    FractionBits {
        /// The word of the lag.
        per_speed: GainWord,
        /// Fraction bits of the velocity.
        velocity_fraction_bits: u8,
    },
    /// The code that must move the axis is 0, or none that a converter has.
    CodeThreshold {
        /// The threshold given \[codes\].
        code_threshold: u32,
    },
    /// A loss of the encoder after 0 samples.
    LossTicks,
    /// A time at the limit that is never passed.
    SaturationTicks {
        /// The number of samples given.
        ticks: u32,
    },
}

impl fmt::Display for MonitorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LimitCounts { limit_counts } => write!(
                f,
                "a following error limit of {limit_counts} counts is of no use; \
                 it must lie between 1 and {}",
                FollowingErrorMonitor::MAX_LIMIT_COUNTS
            ),
            Self::Negative { per_speed } => write!(
                f,
                "the following error's share per speed {per_speed} is negative; \
                 it must be at least 0"
            ),
            Self::FractionBits {
                per_speed,
                velocity_fraction_bits,
            } => write!(
                f,
                "the following error's share per speed {per_speed} and a velocity with \
                 {velocity_fraction_bits} fraction bits have more than {} of them together",
                FollowingErrorMonitor::MAX_FRACTION_BITS
            ),
            Self::CodeThreshold { code_threshold } => write!(
                f,
                "a code threshold of {code_threshold} cannot tell a lost encoder; \
                 it must lie between 1 and {}",
                EncoderLossMonitor::MAX_CODE_THRESHOLD
            ),
            Self::LossTicks => f.write_str(
                "an encoder cannot be lost after 0 samples; it must be at least 1 sample",
            ),
            Self::SaturationTicks { ticks } => write!(
                f,
                "{ticks} samples at a limit are never passed; \
                 the number must be below {ticks}"
            ),
        }
    }
}

impl core::error::Error for MonitorError {}
