//! Missed ticks: the control loop did not run when the timer said so.

use crate::faults::{FaultCause, Trip};

/// Checks that the control loop runs at every tick, once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickMonitor;

impl TickMonitor {
    /// One sample: takes the number of its tick, counted by the hardware timer
    /// and not by the loop. The first one may be any; after a trip the next one
    /// is compared with the number that came.
    ///
    /// ```
    /// use firmware::monitor::{TickState, TickMonitor};
    ///
    /// let mut state = TickState::default();
    /// assert_eq!(TickMonitor.check(&mut state, 41), None);
    /// assert_eq!(TickMonitor.check(&mut state, 42), None);
    /// let trip = TickMonitor.check(&mut state, 45).expect("43 and 44 are missing");
    /// assert_eq!(trip.measured, 2);
    /// ```
    #[inline]
    pub fn check(&self, state: &mut TickState, tick: u64) -> Option<Trip> {
        // Counted modulo 2^64, so that no end has to be looked at.
        let expected = state.expected.replace(tick.wrapping_add(1))?;
        let missed = tick.wrapping_sub(expected).cast_signed();
        (missed != 0).then_some(Trip {
            cause: FaultCause::MissedTick,
            measured: missed,
            limit: 0,
        })
    }
}

/// Memory of a [`TickMonitor`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickState {
    /// The number that comes next; none before the first tick.
    expected: Option<u64>,
}
