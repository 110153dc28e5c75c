//! Saturation: the output stands at a limit for too long.

use super::{WatchError, lengthened};
use crate::faults::{FaultCause, Trip};

/// Watches for an output that stands at a limit: an axis that cannot do what
/// it is asked to, because it is blocked or the motion asks too much.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SaturationWatch {
    ticks: u32,
}

impl SaturationWatch {
    /// Allows `ticks` samples in a row.
    ///
    /// # Errors
    /// [`WatchError::SaturationTicks`] for 2^32 − 1, which the counter never
    /// passes.
    ///
    /// ```
    /// use firmware::watch::{SaturationState, SaturationWatch};
    ///
    /// let watch = SaturationWatch::accept(1)?;
    /// let mut state = SaturationState::default();
    /// assert_eq!(watch.check(&mut state, true), None);
    /// assert!(watch.check(&mut state, true).is_some());
    /// # Ok::<(), firmware::WatchError>(())
    /// ```
    pub const fn accept(ticks: u32) -> Result<Self, WatchError> {
        if ticks == u32::MAX {
            return Err(WatchError::SaturationTicks { ticks });
        }
        Ok(Self { ticks })
    }

    /// Samples in a row that are allowed.
    pub const fn limit(&self) -> u32 {
        self.ticks
    }

    /// One sample: takes whether the output stands at a limit.
    #[inline]
    pub fn check(&self, state: &mut SaturationState, at_limit: bool) -> Option<Trip> {
        state.samples = lengthened(state.samples, at_limit);
        (state.samples > self.ticks).then_some(Trip {
            cause: FaultCause::SaturationTooLong,
            measured: i64::from(state.samples),
            limit: i64::from(self.ticks),
        })
    }
}

/// Memory of a [`SaturationWatch`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SaturationState {
    samples: u32,
}
