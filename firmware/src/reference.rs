//! Setpoints one sample at a time, whatever they come from: the table in the
//! controller's memory, the motion generator, a streamed queue, or a backlash measurement
//! routine.
//!
//! The table holds the desired positions as in the paper (section 3, `α_ref(t)`
//! before eq. 20): entry `k` is the setpoint of sample `k` in counts modulo 2^32
//! ([`crate::counts`]), from `k = 0` to the motion's end; from then on the last
//! entry is held. It never reports an end: a motion that has ended is an axis at
//! rest.

use core::borrow::Borrow;

use heapless::Vec;

use crate::counts;
use crate::refusal::{Refusal, What};

/// Command to the axis at one sample.
///
/// Velocity and acceleration serve the feed-forward only. Their exponents are
/// those of the source, declared once when the feed-forward words are made, so
/// that each uses its 32 bits to the full at any sample time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Setpoint {
    /// Position \[counts, modulo 2^32\].
    pub position: i32,
    /// Velocity \[2^−`velocity_fraction_bits` counts per sample\].
    pub velocity: i32,
    /// Acceleration \[2^−`acceleration_fraction_bits` counts per sample²\].
    pub acceleration: i32,
}

/// State of the axis as a source of setpoints sees it: a routine such as a
/// backlash measurement decides by it, the others do not look at it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Observed {
    /// Position of the motor \[counts, modulo 2^32\].
    pub position: i32,
    /// Position of the load \[load counts, modulo 2^32\], where it has an
    /// encoder of its own.
    pub load_position: Option<i32>,
    /// The last code that the converter was given.
    pub code: i32,
}

/// Answer of a source for this sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// A setpoint of the motion.
    Setpoint(Setpoint),
    /// The last setpoint: the axis holds it from here on.
    Last(Setpoint),
    /// The motion has not ended but there is no setpoint.
    Underrun,
}

/// A source of setpoints, asked once a sample while the axis moves.
pub trait SetpointSource {
    /// The setpoint of this sample.
    fn next(&mut self, observed: &Observed) -> Next;
}

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
/// let mut table = SetpointTable::<4>::from_counts(&[0])?;
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

/// Reads a [`SetpointTable`], its own or a borrowed one, from the first entry
/// to the last. A table knows positions only: the velocity is the difference
/// to the entry before, in whole counts per sample, the acceleration is 0.
#[derive(Debug, Clone)]
pub struct TableSource<T, const N: usize> {
    table: T,
    k: u64,
}

impl<T: Borrow<SetpointTable<N>>, const N: usize> TableSource<T, N> {
    /// The table.
    pub fn table(&self) -> &SetpointTable<N> {
        self.table.borrow()
    }

    /// Starts at the first entry.
    pub const fn new(table: T) -> Self {
        Self { table, k: 0 }
    }
}

impl<T: Borrow<SetpointTable<N>>, const N: usize> SetpointSource for TableSource<T, N> {
    fn next(&mut self, _: &Observed) -> Next {
        let table = self.table.borrow();
        let position = table.at(self.k);
        let before = table.at(self.k.saturating_sub(1));
        self.k = self.k.saturating_add(1);
        let entries = table.as_counts().len();
        if usize::try_from(self.k).is_ok_and(|k| k < entries) {
            Next::Setpoint(Setpoint {
                position,
                velocity: counts::difference(position, before),
                acceleration: 0,
            })
        } else {
            Next::Last(Setpoint {
                position,
                ..Setpoint::default()
            })
        }
    }
}
