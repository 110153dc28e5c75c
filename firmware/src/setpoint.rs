//! The setpoint table: the desired positions, stored in the controller's
//! memory as in the paper (section 3, `α_ref(t)` before eq. 20).
//!
//! Entry `k` is the setpoint of sample `k` in counts modulo 2^32
//! ([`crate::counts`]). The table holds the motion from `k = 0` to its end;
//! from then on the last entry is held. It never reports an end: a motion
//! that has ended is an axis at rest.

use crate::refusal::{Refusal, What};

use heapless::Vec;

/// Entries of a table on the host and on the larger chips: 64 KiB, 16.4 s of
/// motion at 1 ms, 1.6 s at 0.1 ms.
pub const CAPACITY: usize = 16_384;

/// Entries of a table on the smallest chips: 8 KiB, 2 s of motion at 1 ms.
pub const CAPACITY_SMALLEST: usize = 2_048;

/// Setpoints of one motion, at most `N` of them and at least one.
///
/// ```
/// use firmware::SetpointTable;
///
/// let mut table = SetpointTable::<4>::starting_at(0);
/// table.push(3)?;
/// table.push(5)?;
/// assert_eq!(table.at(1), 3);
/// // The last setpoint is held.
/// assert_eq!(table.at(1_000), 5);
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SetpointTable<const N: usize> {
    entries: Vec<i32, N>,
    /// Setpoint held beyond the entries: the last of them.
    last: i32,
}

impl<const N: usize> SetpointTable<N> {
    /// A table must have room for the setpoint of `k = 0`.
    const HAS_ROOM: () = assert!(N > 0, "a setpoint table needs room for one entry");

    /// A table with the setpoint of `k = 0` only \[counts\].
    pub fn starting_at(first: i32) -> Self {
        let () = Self::HAS_ROOM;
        let mut entries = Vec::new();
        // There is room (line above), so nothing is lost here.
        let _ = entries.push(first);
        Self {
            entries,
            last: first,
        }
    }

    /// An axis that stays at `position` \[counts\], with all of the table's room
    /// left.
    pub const fn resting_at(position: i32) -> Self {
        let () = Self::HAS_ROOM;
        Self {
            entries: Vec::new(),
            last: position,
        }
    }

    /// Forgets the entries; the axis stays at `position` \[counts\].
    pub fn rest_at(&mut self, position: i32) {
        self.entries.clear();
        self.last = position;
    }

    /// A table with the setpoints `counts` of `k = 0, 1, …` \[counts\].
    ///
    /// # Errors
    /// A [`Refusal`] of none and of more than `N`.
    ///
    /// ```
    /// use firmware::SetpointTable;
    ///
    /// let refusal = SetpointTable::<2>::from_counts(&[0, 1, 2]).unwrap_err();
    /// assert_eq!((refusal.value, refusal.most), (3, 2));
    /// ```
    pub fn from_counts(counts: &[i32]) -> Result<Self, Refusal> {
        let last = *counts.last().ok_or_else(|| Self::refusal(0))?;
        let entries = Vec::from_slice(counts).map_err(|_| Self::refusal(counts.len()))?;
        Ok(Self { entries, last })
    }

    fn refusal(needed: usize) -> Refusal {
        let [needed, most] = [needed, N].map(|entries| i64::try_from(entries).unwrap_or(i64::MAX));
        Refusal::new(What::Setpoints, needed, [1, most])
    }

    /// Appends the setpoint of the next sample \[counts\].
    ///
    /// # Errors
    /// A [`Refusal`] where the table is full; it keeps what it
    /// has.
    pub fn push(&mut self, setpoint: i32) -> Result<(), Refusal> {
        self.entries
            .push(setpoint)
            .map_err(|_| Self::refusal(N.saturating_add(1)))?;
        self.last = setpoint;
        Ok(())
    }

    /// The setpoint of sample `k`; the last one from the table's end on
    /// \[counts\].
    pub fn at(&self, k: u64) -> i32 {
        usize::try_from(k)
            .ok()
            .and_then(|k| self.entries.get(k))
            .copied()
            .unwrap_or(self.last)
    }

    /// The setpoints of `k = 0, 1, …` \[counts\].
    pub fn as_counts(&self) -> &[i32] {
        &self.entries
    }
}
