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
//! # Choice of the flank
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

use crate::counts::difference;
use crate::reference::Setpoint;
use crate::refusal::{Refusal, What, accepted};
use crate::wide;

/// Largest half gap \[motor counts\].
pub const HALF_GAP_MAX: u32 = 1 << 24;

/// Most samples of one move across the gap, `2·N`.
pub const SAMPLES_MAX: u32 = 2 * HALF_SAMPLES_MAX;

/// Largest `N`: its square fits 32 bits.
const HALF_SAMPLES_MAX: u32 = 65_535;

/// Choice of the flank on which the motor must stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// The sign of the setpoint's velocity: for an axis whose friction keeps
    /// the load on the flank that pushes it.
    ///
    /// At a velocity of 0 the sign of the position's difference to the
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

/// Remainder of the axis' limits beside the motion: limit less the motion's peak.
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
/// # Ok::<(), firmware::Refusal>(())
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
    /// A [`Refusal`] where the gap is too large, where nothing is left of a limit or where the move would take more than [`SAMPLES_MAX`] samples.
    pub const fn plan(half_gap_counts: u32, room: Room, trigger: Trigger) -> Result<Self, Refusal> {
        accepted!(What::HalfGap.word_within(half_gap_counts, [0, HALF_GAP_MAX]));
        let half_gap = wide::unsigned(half_gap_counts);
        let limits = [room.velocity, room.acceleration];
        let less = [0, half_gap.saturating_sub(1)];
        let too_long = Refusal::new(What::Crossing(limits), half_gap, less);
        // D = 2·B, at most 2^25
        let distance = half_gap_counts.wrapping_mul(2);
        if distance > 0 && (room.velocity == 0 || room.acceleration == 0) {
            return Err(Refusal::new(What::NoRoom(limits), half_gap, [0, 0]));
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
    pub const fn planned(half_gap_counts: u32, samples: u32, trigger: Trigger) -> Option<Self> {
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

    /// Choice of the flank.
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

    /// The offset of this sample \[motor counts\], for the setpoint of this
    /// sample; to be called once a sample, also while the reference rests.
    #[inline]
    pub fn step(&self, state: &mut BacklashCompensationState, setpoint: &Setpoint) -> i32 {
        let previous = state.previous_position.replace(setpoint.position);
        let rate = match self.trigger {
            Trigger::Acceleration => setpoint.acceleration,
            Trigger::Velocity if setpoint.velocity != 0 => setpoint.velocity,
            Trigger::Velocity => previous.map_or(0, |last| difference(setpoint.position, last)),
        };
        if rate > 0 {
            state.wanted = Flank::Positive;
        } else if rate < 0 {
            state.wanted = Flank::Negative;
        }

        let samples = self.samples();
        if state.left == 0 && state.wanted != state.flank {
            state.from_centre = state.flank == Flank::Neither;
            state.flank = state.wanted;
            state.left = samples;
            state.travel = Mixed::default();
        }
        if state.left > 0 {
            state.velocity = if state.left == samples {
                self.first
            } else if state.left > self.half_samples {
                state.velocity.plus(self.change, self.n2)
            } else if state.left == self.half_samples {
                state.velocity
            } else {
                state.velocity.minus(self.change, self.n2)
            };
            // T(j) ← T(j − 1) + (T(j) − T(j − 1))
            state.travel = state.travel.plus(state.velocity, self.n2);
            state.left = state.left.wrapping_sub(1);
        }
        self.offset(state)
    }

    /// The nearest integer to the exact offset, half away from zero.
    #[inline]
    const fn offset(&self, state: &BacklashCompensationState) -> i32 {
        // All magnitudes are at most 2·B ≤ 2^25: nothing wraps.
        let Mixed { whole, part } = state.travel;
        let ahead = if state.from_centre {
            // T/2, half up: floor((T + 1)/2)
            whole.wrapping_add(1).wrapping_shr(1)
        } else {
            // T − B, half up where it is not negative, half down where it is
            let rest = self.n2.wrapping_sub(part);
            let up = part > rest || (part == rest && whole >= self.half_gap_counts);
            let nearest = if up { whole.wrapping_add(1) } else { whole };
            nearest.wrapping_sub(self.half_gap_counts)
        };
        match state.flank {
            Flank::Neither => 0,
            Flank::Positive => ahead.cast_signed(),
            Flank::Negative => ahead.cast_signed().wrapping_neg(),
        }
    }
}

/// A flank of the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Flank {
    /// None yet: the joint counts as centred.
    #[default]
    Neither,
    /// The motor pushes in the positive direction.
    Positive,
    /// The motor pushes in the negative direction.
    Negative,
}

/// Memory of the backlash compensation. The default is an offset of 0, the joint centred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BacklashCompensationState {
    /// `T` of the running or the last move \[counts\].
    travel: Mixed,
    /// `T(j) − T(j − 1)` of the last sample \[counts per sample\].
    velocity: Mixed,
    /// Samples that the running move still takes; 0 at rest.
    left: u32,
    /// Position of the last setpoint \[counts\].
    previous_position: Option<i32>,
    /// The flank that the reference has last asked for.
    wanted: Flank,
    /// The flank that the running move leads to, or the last one led to.
    flank: Flank,
    /// True if that move started at the centre.
    from_centre: bool,
}

impl BacklashCompensationState {
    /// Tells whether the offset is on its way, or about to be: the axis is not in
    /// position before this is over.
    #[inline]
    pub fn is_under_way(&self) -> bool {
        self.left > 0 || self.wanted != self.flank
    }
}

/// A number `whole + part/N²` with `part < N²`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Mixed {
    whole: u32,
    part: u32,
}

impl Mixed {
    /// `numerator/denominator`; `None` for a denominator of 0.
    const fn ratio(numerator: u32, denominator: u32) -> Option<Self> {
        match (
            numerator.checked_div(denominator),
            numerator.checked_rem(denominator),
        ) {
            (Some(whole), Some(part)) => Some(Self { whole, part }),
            _ => None,
        }
    }

    /// The sum, in parts of `n2`. Whole numbers stay below 2^26, and only a sum
    /// of parts below `n2` is ever formed: nothing wraps.
    #[inline]
    const fn plus(self, other: Self, n2: u32) -> Self {
        let whole = self.whole.wrapping_add(other.whole);
        let missing = n2.wrapping_sub(other.part);
        let (carry, part) = if self.part >= missing {
            (1, self.part.wrapping_sub(missing))
        } else {
            (0, self.part.wrapping_add(other.part))
        };
        let whole = whole.wrapping_add(carry);
        Self { whole, part }
    }

    /// The difference, in parts of `n2`, for `other ≤ self`: nothing wraps.
    #[inline]
    const fn minus(self, other: Self, n2: u32) -> Self {
        let whole = self.whole.wrapping_sub(other.whole);
        let (borrow, part) = if self.part >= other.part {
            (0, self.part.wrapping_sub(other.part))
        } else {
            let missing = n2.wrapping_sub(other.part);
            (1, self.part.wrapping_add(missing))
        };
        let whole = whole.wrapping_sub(borrow);
        Self { whole, part }
    }
}

/// The smallest `N` with `D/N ≤ v_left` and `D/N² ≤ a_left`, up to 65 535.
const fn half_samples(distance: u32, room: Room) -> Option<u32> {
    // The largest N that is not enough, bit by bit from the top.
    let (mut too_small, mut bit) = (0_u32, 1_u32 << 15);
    while bit > 0 {
        let n = too_small | bit;
        if !enough(n, distance, room) {
            too_small = n;
        }
        bit = bit.wrapping_shr(1);
    }
    let n = too_small.wrapping_add(1);
    if n <= HALF_SAMPLES_MAX { Some(n) } else { None }
}

/// Tells whether `N = n` samples, at most 65 535, keep both limits.
const fn enough(n: u32, distance: u32, room: Room) -> bool {
    // D·2^32 ≤ 2^57. A product that saturates is large enough in any case.
    let scaled = wide::word(distance).wrapping_shl(32);
    let n = wide::word(n);
    // N² ≤ 65 535²
    scaled <= room.velocity.saturating_mul(n)
        && scaled <= room.acceleration.saturating_mul(n.wrapping_mul(n))
}
