//! One of the two directions of an axis.

/// Direction of motion, torque, voltage or current; of a joint, the flank that pushes that
/// way: the drive flank at ε = b, the coast flank at ε = −b.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Positive,
    Negative,
}

impl Direction {
    pub(crate) const BOTH: [Self; 2] = [Self::Positive, Self::Negative];

    /// That of a number which is not zero.
    pub(crate) fn of(number: f64) -> Self {
        match number > 0.0 {
            true => Self::Positive,
            false => Self::Negative,
        }
    }

    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }

    pub(crate) fn turned(self) -> Self {
        match self {
            Self::Positive => Self::Negative,
            Self::Negative => Self::Positive,
        }
    }
}
