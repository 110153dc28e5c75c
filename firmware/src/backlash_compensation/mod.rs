//! Backlash compensation: an offset on the motor's reference that carries the
//! motor across the gap whenever the load changes flank.
//!
//! With a half gap of `B` motor counts the motor leads the load by `B` where
//! it pushes in the positive direction and lags by `B` where it pushes in the
//! negative one. So the motor's reference is
//!
//! ```text
//! r_motor = r + offset,   offset → dir·B,   dir = −1, 0, +1        [counts]
//! ```
//!
//! The offset starts at 0: nobody knows on which flank the joint stands.
//!
//! # What decides the flank
//!
//! The reference alone ([`Trigger`]). Error and output are not arguments of
//! [`BacklashCompensation::step`]: a motor that
//! oscillates about its goal changes the sign of both, and a compensation that
//! followed them would throw the motor across the gap and back for ever. At
//! rest, and where the acceleration is 0, the last flank is kept.
//!
//! # The move across
//!
//! From one flank to the other the offset travels `D = 2·B` counts in `2·N`
//! samples, `N` with a constant acceleration and `N` with the opposite one:
//!
//! ```text
//! T(j) = B·j²/N²               j = 0 … N
//! T(j) = 2·B − B·(2·N − j)²/N²  j = N … 2·N
//! ```
//!
//! Its second differences are `±B/N²` at the first and the last sample,
//! `±2·B/N² = ±D/N²` between and 0 at the turn, so also where one move follows
//! directly on another they are at most `D/N²`; its first differences are at
//! most `D·(2·N − 1)/(2·N²) < D/N`. `N` is the smallest number with
//!
//! ```text
//! D/N ≤ v_left   [counts/sample],   D/N² ≤ a_left   [counts/sample²]
//! ```
//!
//! where `v_left` and `a_left` are what the motion's own peaks leave of the
//! limits of the axis ([`Room`]). The sum of motion and offset then stays
//! within those limits whenever the two meet (triangle inequality). Where the
//! speed limit is what binds, a longer parabola is slower than a trapezoid
//! would be, and needs less acceleration.
//!
//! From the centre to the first flank the offset is `±T(j)/2`: half the way in
//! the same time, with half the speed and half the acceleration.
//!
//! A change of flank during a move waits until the move has ended: never a
//! jump. Moves start and end at rest.
//!
//! # Exactness
//!
//! `T` and its first difference are kept as a whole number and a part of `N²`
//! and advanced by additions with a carry, so they are `T(j)` and its
//! difference exactly and `T(2·N) = 2·B` needs no correction. The offset is
//! the nearest integer, half away from zero: within half a count of the exact
//! one, and exactly odd in the direction. Between two samples it moves by less
//! than `D/N + 1`.
//!
//! | quantity | type | magnitude |
//! | --- | --- | --- |
//! | `B` | `u32` | at most 2^24 |
//! | `T`, its difference | whole `u32` | at most 2^25 |
//! | parts of `N²`, `N ≤ 65 535` | `u32` | below `N²` < 2^32 |
//! | `D·2^32` against `v·N`, `a·N²` | `u64` | 2^57; products saturate |

mod error;
mod parabola;
mod step;

pub use error::BacklashCompensationError;
pub use step::BacklashCompensationState;

use parabola::{Mixed, half_samples};

/// Largest half gap \[motor counts\].
pub const HALF_GAP_MAX: u32 = 1 << 24;

/// Most samples of one move across the gap, `2·N`.
pub const SAMPLES_MAX: u32 = 2 * HALF_SAMPLES_MAX;

/// Largest `N`: its square fits 32 bits.
const HALF_SAMPLES_MAX: u32 = 65_535;

/// What decides on which flank the motor must stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// The sign of the setpoint's velocity: for an axis whose friction keeps
    /// the load on the flank that pushes it.
    ///
    /// Where the velocity is 0 the sign of the position's difference to the
    /// last sample takes its place, for sources that know positions only.
    Velocity,
    /// The sign of the setpoint's acceleration: for a load that is thrown by
    /// its inertia and changes flank where the motion starts to brake.
    ///
    /// It needs a source that gives accelerations. With one that gives none,
    /// such as a table, the offset stays 0: a second difference of whole
    /// counts would change its sign at every step of one count.
    Acceleration,
}

/// What the motion leaves of the axis' limits: limit less the motion's peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    /// `v_left` \[2^−32 counts per sample\].
    pub velocity: u64,
    /// `a_left` \[2^−32 counts per sample²\].
    pub acceleration: u64,
}

/// The compensation of one gap, planned. Immutable; its memory is
/// [`BacklashCompensationState`].
///
/// ```
/// use firmware::{Room, Setpoint, BacklashCompensation, BacklashCompensationState, Trigger};
///
/// // 4 counts to either side, at most 2 counts/sample and 1/2 count/sample²:
/// // D/N² = 8/16.
/// let room = Room { velocity: 2 << 32, acceleration: 1 << 31 };
/// let backlash_compensation = BacklashCompensation::plan(4, room, Trigger::Velocity)?;
/// assert_eq!(backlash_compensation.samples(), 8);
///
/// let mut state = BacklashCompensationState::default();
/// let forwards = Setpoint { velocity: 1, ..Setpoint::default() };
/// let backwards = Setpoint { velocity: -1, ..Setpoint::default() };
/// let first = [(); 8].map(|()| backlash_compensation.step(&mut state, &forwards));
/// assert_eq!(first, [0, 1, 1, 2, 3, 4, 4, 4]);
/// let reversal = [(); 8].map(|()| backlash_compensation.step(&mut state, &backwards));
/// assert_eq!(reversal, [4, 3, 2, 0, -2, -3, -4, -4]);
/// # Ok::<(), firmware::BacklashCompensationError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BacklashCompensation {
    trigger: Trigger,
    half_gap_counts: u32,
    /// `N`, 1 to 65 535.
    half_samples: u32,
    /// `N²`.
    n2: u32,
    /// `B/N²`, the first difference at the first sample.
    first: Mixed,
    /// `2·B/N²`, by which it grows and shrinks.
    change: Mixed,
}

impl BacklashCompensation {
    /// Plans the shortest move across a gap of `half_gap_counts` motor counts
    /// to either side that stays within `room`.
    ///
    /// # Errors
    /// A [`BacklashCompensationError`] where the gap is too large, where nothing is left of
    /// a limit or where the move would take more than [`SAMPLES_MAX`] samples.
    pub const fn plan(
        half_gap_counts: u32,
        room: Room,
        trigger: Trigger,
    ) -> Result<Self, BacklashCompensationError> {
        if half_gap_counts > HALF_GAP_MAX {
            return Err(BacklashCompensationError::GapTooLarge { half_gap_counts });
        }
        let no_room = BacklashCompensationError::NoRoom {
            half_gap_counts,
            room,
        };
        let too_long = BacklashCompensationError::TooLong {
            half_gap_counts,
            room,
        };
        // D = 2·B, at most 2^25
        let distance = half_gap_counts.wrapping_mul(2);
        if distance > 0 && (room.velocity == 0 || room.acceleration == 0) {
            return Err(no_room);
        }
        let Some(half_samples) = half_samples(distance, room) else {
            return Err(too_long);
        };
        match Self::of(half_gap_counts, half_samples, trigger) {
            Some(plan) => Ok(plan),
            None => Err(too_long),
        }
    }

    /// The plan of a move that takes `samples`, as another machine has planned
    /// it; `None` for a number of samples or a gap that no plan has.
    pub fn planned(half_gap_counts: u32, samples: u32, trigger: Trigger) -> Option<Self> {
        let half_samples = samples.wrapping_shr(1);
        let whole = half_samples.wrapping_mul(2) == samples;
        if half_gap_counts > HALF_GAP_MAX || !whole || half_samples > HALF_SAMPLES_MAX {
            return None;
        }
        Self::of(half_gap_counts, half_samples, trigger)
    }

    /// `None` for no samples at all.
    const fn of(half_gap_counts: u32, half_samples: u32, trigger: Trigger) -> Option<Self> {
        // N² ≤ 65 535² < 2^32, D ≤ 2^25
        let n2 = half_samples.wrapping_mul(half_samples);
        let distance = half_gap_counts.wrapping_mul(2);
        let (Some(first), Some(change)) = (
            Mixed::ratio(half_gap_counts, n2),
            Mixed::ratio(distance, n2),
        ) else {
            return None;
        };
        Some(Self {
            trigger,
            half_gap_counts,
            half_samples,
            n2,
            first,
            change,
        })
    }

    /// What decides the flank.
    pub const fn trigger(&self) -> Trigger {
        self.trigger
    }

    /// Samples of one move, `2·N`, 2 to [`SAMPLES_MAX`].
    pub const fn samples(&self) -> u32 {
        self.half_samples.wrapping_mul(2)
    }

    /// `B` \[motor counts\], at most [`HALF_GAP_MAX`].
    pub const fn half_gap_counts(&self) -> u32 {
        self.half_gap_counts
    }
}
