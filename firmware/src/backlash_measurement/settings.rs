//! How to creep, how to see that the load follows, and what is accepted of
//! both.

use core::fmt;

use super::BacklashMeasurement;

/// Fastest creep, 256 counts per sample \[2^−16 counts per sample\].
pub const SPEED_MAX: u32 = 1 << 24;

/// Longest creep \[counts\].
pub const CREEP_MAX: u32 = 1 << 28;

/// Most motor counts per load count, 4096 \[2^−16\].
pub const RATIO_MAX: u32 = 1 << 28;

/// How the routine sees that the load follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detection {
    /// By the load's own encoder, which must count up where the motor's does.
    LoadEncoder {
        /// `n`, by which the load's count must have moved since the creep
        /// started, at least 1; 2 where it may flicker by one \[load counts\].
        counts: u32,
        /// `ρ`, motor counts per load count \[2^−16\].
        ratio: u32,
    },
    /// By the code that it takes.
    Effort {
        /// Smallest code that free creep never takes for `samples` samples on
        /// end, at least 1 \[codes\].
        codes: u32,
        /// How long it must be taken, at least 1 \[samples\].
        samples: u32,
    },
}

/// How to creep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Creep {
    /// Speed \[2^−16 motor counts per sample\].
    pub speed: u32,
    /// The load must follow within this distance, which each leg starts anew
    /// \[motor counts\].
    pub longest_counts: u32,
    /// Rest between two legs \[samples\].
    pub pause_samples: u32,
    /// Largest difference of the three gaps \[motor counts\].
    pub tolerance_counts: u32,
}

impl BacklashMeasurement {
    /// Accepts settings if nothing can overflow with them.
    ///
    /// # Errors
    /// A [`BacklashMeasurementRefused`] that names what is out of its range.
    pub fn accept(creep: Creep, detection: Detection) -> Result<Self, BacklashMeasurementRefused> {
        let (speed, counts) = (creep.speed, creep.longest_counts);
        if speed == 0 || speed > SPEED_MAX {
            return Err(BacklashMeasurementRefused::Speed { speed });
        }
        if counts == 0 || counts > CREEP_MAX {
            return Err(BacklashMeasurementRefused::LongestCreep { counts });
        }
        match detection {
            Detection::LoadEncoder { ratio, .. } if ratio == 0 || ratio > RATIO_MAX => {
                Err(BacklashMeasurementRefused::Ratio { ratio })
            }
            Detection::LoadEncoder { counts: 0, .. }
            | Detection::Effort { codes: 0, .. }
            | Detection::Effort { samples: 0, .. } => {
                Err(BacklashMeasurementRefused::NothingToDetect { detection })
            }
            _ => Ok(Self { creep, detection }),
        }
    }
}

/// Why settings are not accepted. Nothing was built; the routine cannot run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BacklashMeasurementRefused {
    /// The speed of creep is 0 or above [`SPEED_MAX`].
    Speed {
        /// The speed given \[2^−16 counts per sample\].
        speed: u32,
    },
    /// The longest creep is 0 or above [`CREEP_MAX`].
    LongestCreep {
        /// The distance given \[counts\].
        counts: u32,
    },
    /// `ρ` is 0 or above [`RATIO_MAX`].
    Ratio {
        /// The ratio given \[2^−16\].
        ratio: u32,
    },
    /// A threshold of 0, which would be reached without a load.
    NothingToDetect {
        /// The detection given.
        detection: Detection,
    },
}

impl fmt::Display for BacklashMeasurementRefused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Speed { speed } => write!(
                f,
                "a creep of {speed}·2^-16 counts/sample is not supported; \
                 it must lie between 1 and {SPEED_MAX}"
            ),
            Self::LongestCreep { counts } => write!(
                f,
                "a longest creep of {counts} counts is not supported; \
                 it must lie between 1 and {CREEP_MAX}"
            ),
            Self::Ratio { ratio } => write!(
                f,
                "{ratio}·2^-16 motor counts per load count are not supported; \
                 it must lie between 1 and {RATIO_MAX}"
            ),
            Self::NothingToDetect { detection } => write!(
                f,
                "the detection {detection:?} has a threshold of 0; it must be at least 1"
            ),
        }
    }
}

impl core::error::Error for BacklashMeasurementRefused {}
