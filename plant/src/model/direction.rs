//! One of the two directions of an axis.

/// Direction of motion, torque, voltage or current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Positive,
    Negative,
}

impl Direction {
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
}
