//! What can keep the routine from a gap.

use core::fmt;

/// Why the routine gave no gap. The axis rests where it was; the routine can
/// be started again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BacklashMeasurementError {
    /// The load did not follow within the longest creep.
    NeverFollowed {
        /// How far the motor was sent \[motor counts\].
        counts: u32,
    },
    /// The gap was not the same at each crossing.
    Disagree {
        /// The whole gap at each crossing \[motor counts\].
        full_counts: [i64; 3],
        /// What was allowed between them \[motor counts\].
        tolerance_counts: u32,
    },
    /// The load moved further than the motor.
    Negative {
        /// The whole gap at each crossing \[motor counts\].
        full_counts: [i64; 3],
    },
    /// The load is to be seen by an encoder that is not there.
    NoLoadEncoder,
}

impl fmt::Display for BacklashMeasurementError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NeverFollowed { counts } => write!(
                f,
                "the load did not follow the motor within {counts} counts of creep; \
                 the gap is wider than that, or the load follows below the threshold"
            ),
            Self::Disagree {
                full_counts: [first, second, third],
                tolerance_counts,
            } => write!(
                f,
                "three crossings gave gaps of {first}, {second} and {third} counts; \
                 they may differ by {tolerance_counts}"
            ),
            Self::Negative {
                full_counts: [first, second, third],
            } => write!(
                f,
                "three crossings gave gaps of {first}, {second} and {third} counts; a load that \
                 moves further than the motor means that the ratio of the two encoders is wrong"
            ),
            Self::NoLoadEncoder => write!(
                f,
                "the gap is to be measured by the load's encoder but there is no count of it"
            ),
        }
    }
}

impl core::error::Error for BacklashMeasurementError {}
