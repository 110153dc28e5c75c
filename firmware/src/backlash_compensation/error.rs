//! Why a backlash compensation cannot be planned.

use core::fmt;

use super::{HALF_GAP_MAX, Room, SAMPLES_MAX};

/// Why a backlash compensation cannot be planned. Nothing was built; the axis can run
/// without it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BacklashCompensationError {
    /// The half gap is larger than [`HALF_GAP_MAX`].
    GapTooLarge {
        /// The half gap given \[motor counts\].
        half_gap_counts: u32,
    },
    /// The motion's own peaks use up a limit of the axis.
    NoRoom {
        /// The half gap given \[motor counts\].
        half_gap_counts: u32,
        /// What is left of the limits.
        room: Room,
    },
    /// With what is left of the limits the move takes too long.
    TooLong {
        /// The half gap given \[motor counts\].
        half_gap_counts: u32,
        /// What is left of the limits.
        room: Room,
    },
}

impl fmt::Display for BacklashCompensationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::GapTooLarge { half_gap_counts } => write!(
                f,
                "a half gap of {half_gap_counts} counts is too large; \
                 it must be at most {HALF_GAP_MAX}"
            ),
            Self::NoRoom {
                half_gap_counts,
                room,
            } => write!(
                f,
                "the motion leaves {}·2^-32 counts/sample and {}·2^-32 counts/sample² of the \
                 axis' limits; a half gap of {half_gap_counts} counts cannot be taken up \
                 unless both are above 0",
                room.velocity, room.acceleration
            ),
            Self::TooLong {
                half_gap_counts,
                room,
            } => write!(
                f,
                "with {}·2^-32 counts/sample and {}·2^-32 counts/sample² left of the axis' limits \
                 a half gap of {half_gap_counts} counts takes more than {SAMPLES_MAX} samples \
                 to cross; a slower motion leaves more",
                room.velocity, room.acceleration
            ),
        }
    }
}

impl core::error::Error for BacklashCompensationError {}
