//! Why the plant could not be advanced.

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
    /// took more steps than [`crate::Plant`] allows.
    TooStiff {
        /// When \[s\].
        time_s: f64,
    },
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
                "the plant is too stiff for this solver at t = {time_s} s: look for a tiny \
                 inductance or inertia, or a huge stiffness, damping or gain"
            ),
            Self::TooManyEvents { time_s } => write!(
                f,
                "the contact or the friction changes its mode without end at t = {time_s} s"
            ),
        }
    }
}

impl core::error::Error for PlantError {}
