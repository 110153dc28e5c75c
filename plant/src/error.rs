//! Why a motion could not be made or the plant not advanced.

use core::fmt;

/// Why the plant could not be advanced. The state stays where the last
/// completed step left it; the run cannot go on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum PlantError {
    /// A state left the finite numbers.
    NonFinite {
        /// When \[s\].
        time_s: f64,
    },
    /// The adaptive step fell below what the clock resolves, or one interval
    /// took more steps than [`crate::Plant`] allows: the plant is too stiff,
    /// or the state runs away in finite time.
    TooStiff {
        /// When \[s\].
        time_s: f64,
    },
    /// Solver `exact` was asked to solve a plant with a quadratic resistance.
    NotAffine,
    /// More mode changes in one interval than [`crate::Plant`] allows.
    TooManyEvents {
        /// When \[s\].
        time_s: f64,
    },
}

impl fmt::Display for PlantError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite { time_s } => {
                write!(f, "the state left the finite numbers at t = {time_s} s")
            }
            Self::TooStiff { time_s } => write!(
                f,
                "the solver's step became too short at t = {time_s} s: either the state runs away \
                 there (a resistance that drives the carriage), or something is too stiff for it \
                 (a tiny inductance or inertia, a huge stiffness, damping or gain)"
            ),
            Self::NotAffine => f.write_str(
                "solver exact needs a plant without quadratic resistance; dopri5 solves it",
            ),
            Self::TooManyEvents { time_s } => write!(
                f,
                "the contact or the friction changes its mode without end at t = {time_s} s"
            ),
        }
    }
}

impl core::error::Error for PlantError {}

/// Why seven intervals and a travel make no motion.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum MotionError {
    /// An interval is negative or not finite.
    Interval {
        /// Number of the interval, 1 to 7.
        number: usize,
        /// The offending duration \[s\].
        duration_s: f64,
    },
    /// The travel is not finite \[m\].
    Travel(f64),
    /// All seven intervals are zero.
    NoDuration,
    /// `t1` to `t3` are all zero: nothing accelerates the axis.
    NoAcceleration,
    /// `t5` to `t7` are all zero: nothing stops the axis.
    NoDeceleration,
    /// Interval and travel are finite, but the motion they make is not.
    OutOfRange,
}

impl fmt::Display for MotionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Interval { number, duration_s } => write!(
                f,
                "interval t{number} is {duration_s} s; every interval must be finite and at least 0"
            ),
            Self::Travel(travel_m) => write!(f, "the travel is {travel_m} m; it must be finite"),
            Self::NoDuration => {
                f.write_str("all seven intervals are 0; the motion needs a duration")
            }
            Self::NoAcceleration => {
                f.write_str("t1, t2 and t3 are all 0; the motion needs an acceleration")
            }
            Self::NoDeceleration => {
                f.write_str("t5, t6 and t7 are all 0; the motion needs a deceleration")
            }
            Self::OutOfRange => f.write_str(
                "the intervals or the travel are too large or too small to compute with",
            ),
        }
    }
}

impl core::error::Error for MotionError {}
