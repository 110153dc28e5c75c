//! Setpoints one sample at a time, whatever they come from: the table in the
//! controller's memory, the motion generator, a streamed queue, or a backlash measurement
//! routine.

use core::borrow::Borrow;

use crate::counts;
use crate::setpoint::SetpointTable;

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

/// Reads a [`SetpointTable`], its own or a borrowed one, from the first entry
/// to the last. A table knows positions only: the velocity is the difference
/// to the entry before, in whole counts per sample
/// ([`TableSource::VELOCITY_FRACTION_BITS`]), the acceleration is 0.
#[derive(Debug, Clone)]
pub struct TableSource<T, const N: usize> {
    table: T,
    k: u64,
}

impl<T: Borrow<SetpointTable<N>>, const N: usize> TableSource<T, N> {
    /// Fraction bits of the velocity: none.
    pub const VELOCITY_FRACTION_BITS: u8 = 0;

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
