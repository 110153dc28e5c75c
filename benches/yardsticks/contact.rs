//! The mode of contact that right-hand side, guards and driver share, and the
//! error of a run.

use std::cell::Cell;
use std::fmt;

use bench_benches::elastic_axis::{ElasticAxis, Flank};
use diffsol::error::DiffsolError;

/// Number of guards in every mode.
pub(crate) const GUARDS: usize = 2;

/// One change of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Instant \[s\].
    pub time_s: f64,
    /// −1, 0 or 1.
    pub from: f64,
    /// −1, 0 or 1.
    pub to: f64,
}

/// Reason for the early end of a run.
#[derive(Debug)]
#[non_exhaustive]
pub enum YardstickError {
    /// An error reported by `diffsol`.
    Solver(DiffsolError),
    /// A flank was met and left again within the first step after a change,
    /// where a root at the step's start hides the second one.
    MissedContact {
        /// Instant \[s\].
        time_s: f64,
    },
}

impl fmt::Display for YardstickError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solver(error) => write!(f, "{error}"),
            Self::MissedContact { time_s } => write!(f, "a contact was missed at {time_s} s"),
        }
    }
}

impl std::error::Error for YardstickError {}

impl From<DiffsolError> for YardstickError {
    fn from(error: DiffsolError) -> Self {
        Self::Solver(error)
    }
}

/// The axis with its mode of contact. The solver's closures see it by
/// reference, hence the cells.
#[derive(Debug)]
pub(crate) struct Contact {
    pub(crate) axis: ElasticAxis,
    flank: Cell<Flank>,
}

impl Contact {
    pub(crate) fn new(axis: ElasticAxis) -> Self {
        Self {
            axis,
            flank: Cell::new(axis.open()),
        }
    }

    #[inline]
    pub(crate) fn flank(&self) -> Flank {
        self.flank.get()
    }

    /// Functions that are positive inside the mode.
    #[inline]
    pub(crate) fn guards(&self, epsilon: f64) -> [f64; GUARDS] {
        let (flank, b) = (self.flank.get(), self.axis.backlash_half_rad);
        if flank.sign == 0.0 {
            [b - epsilon, b + epsilon]
        } else {
            [flank.sign * epsilon - b, 1.0]
        }
    }

    /// Changes the mode where guard `index` is zero; returns the change and
    /// the ε that lies exactly on the surface.
    pub(crate) fn switch(&self, index: usize, time_s: f64) -> (Change, f64) {
        let before = self.flank.get();
        let after = if before.sign == 0.0 {
            self.axis.flank(index == 0)
        } else {
            self.axis.open()
        };
        self.flank.set(after);
        let change = Change {
            time_s,
            from: before.sign,
            to: after.sign,
        };
        (change, before.surface_rad + after.surface_rad)
    }
}
