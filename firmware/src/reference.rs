//! Setpoints one sample at a time, whatever they come from: the table in the
//! controller's memory, the motion generator, a streamed queue, or a homing
//! routine.

use crate::setpoint::SetpointTable;

/// What the axis should do at one sample.
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

/// What the axis shows to a source of setpoints: a routine such as homing
/// decides by it, the others do not look at it.
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

/// What a source has for this sample.
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

/// Reads a [`SetpointTable`] from its first entry to its last; a table knows
/// positions only, so velocity and acceleration are 0.
#[derive(Debug, Clone)]
pub struct TableSource<'a, const N: usize> {
    table: &'a SetpointTable<N>,
    k: u64,
}

impl<'a, const N: usize> TableSource<'a, N> {
    /// Starts at the first entry.
    pub const fn new(table: &'a SetpointTable<N>) -> Self {
        Self { table, k: 0 }
    }
}

impl<const N: usize> SetpointSource for TableSource<'_, N> {
    fn next(&mut self, _: &Observed) -> Next {
        let setpoint = Setpoint {
            position: self.table.at(self.k),
            ..Setpoint::default()
        };
        self.k = self.k.saturating_add(1);
        let entries = self.table.as_counts().len();
        if usize::try_from(self.k).is_ok_and(|k| k < entries) {
            Next::Setpoint(setpoint)
        } else {
            Next::Last(setpoint)
        }
    }
}
