//! Saturation: the output stands at a limit for too long.

use super::{MonitorError, lengthened};
use crate::faults::{FaultCause, Trip};

/// Guards against an output that stands at a limit: an axis that cannot do what
/// it is asked to, because it is blocked or the motion asks too much.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SaturationMonitor {
    ticks: u32,
}

impl SaturationMonitor {
    /// Allows `ticks` samples in a row.
    ///
    /// # Errors
    /// [`MonitorError::SaturationTicks`] for 2^32 − 1, which the counter never
    /// passes.
    ///
    /// ```
    /// use firmware::monitor::{SaturationState, SaturationMonitor};
    ///
    /// let monitor = SaturationMonitor::accept(1)?;
    /// let mut state = SaturationState::default();
    /// assert_eq!(monitor.check(&mut state, true), None);
    /// assert!(monitor.check(&mut state, true).is_some());
    /// # Ok::<(), firmware::MonitorError>(())
    /// ```
    pub const fn accept(ticks: u32) -> Result<Self, MonitorError> {
        if ticks == u32::MAX {
            return Err(MonitorError::SaturationTicks { ticks });
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

/// Memory of a [`SaturationMonitor`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SaturationState {
    samples: u32,
}
