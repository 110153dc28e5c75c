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
//! The reference alone ([`Trigger`]), never error or output: a motor that
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
//! jump. Moves start and end at rest. Only settings with another gap, taken on
//! during a move, make one: half of the difference at its middle, half at its end.
//!
//! # Exactness
//!
//! `T` is the sum of its first differences, and those of the second ones, in
//! 2^−32 counts ([`Counts`]): three additions a sample. `B/N²` is rounded once, so
//! that `T(j)` is off by at most `j²·2^−33`; at the middle and at the end it is
//! exact. The offset is the nearest integer to that: within `½ + N²·2^−33` counts
//! of the exact one, which is ½ and a 500th up to `N` = 4,096, and exactly odd in
//! the direction. Between two samples it moves by less than `D/N + 1`.
//!
//! | quantity | type | magnitude |
//! | --- | --- | --- |
//! | `B` | `u32` | at most 2^24 |
//! | `T`, its differences | `I32F32` | at most 2^25 counts |
//! | `D·2^32` against `v·N`, `a·N²` | `u64` | 2^57; products saturate |

use crate::counts::Counts;
use crate::reference::Stretch;
use crate::refusal::{Refusal, What, accepted};
use crate::settings::Words;
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

/// The compensation of one gap, planned.
///
/// ```
/// use firmware::{BacklashCompensation, Room, Trigger};
///
/// // 4 counts to either side, at most 2 counts/sample and 1/2 count/sample²:
/// // D/N² = 8/16.
/// let room = Room { velocity: 2 << 32, acceleration: 1 << 31 };
/// let backlash_compensation = BacklashCompensation::plan(4, room, Trigger::Velocity)?;
/// assert_eq!(backlash_compensation.samples(), 8);
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BacklashCompensation {
    trigger: Trigger,
    half_gap_counts: u32,
    /// `N`, 1 to 65 535.
    half_samples: u32,
    /// `B/N²`, the first difference at the first sample.
    first: Counts,
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
        // N² ≤ 65 535² < 2^32, B·2^32 ≤ 2^56
        let n2 = half_samples.wrapping_mul(half_samples);
        let whole = wide::word(half_gap_counts).wrapping_shl(32);
        let nearest = whole.wrapping_add(wide::word(n2.wrapping_shr(1)));
        let Some(first) = nearest.checked_div(wide::word(n2)) else {
            return None;
        };
        Some(Self {
            trigger,
            half_gap_counts,
            half_samples,
            first: Counts::from_bits(wide::held(first)),
        })
    }

    /// `B/N²`, by which the first sample moves \[counts\].
    pub(crate) const fn first(&self) -> Counts {
        self.first
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
}

impl Words {
    /// The flank that a part of the command asks for; 0 where it asks for none.
    pub(crate) const fn flank_of(&self, stretch: &Stretch) -> i8 {
        match [self.crossing_half_samples(), self.flank_of_acceleration()] {
            [0, _] => 0,
            [_, 0] => stretch.velocity_sign,
            _ => stretch.acceleration_sign,
        }
    }
}

/// Half a count.
const HALF: Counts = Counts::from_bits(1 << 31);

/// Memory of a compensation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub(crate) struct CrossingState {
    /// Samples that this half of the running move still takes; 0 at rest.
    pub(crate) left: u32,
    /// \[motor counts\].
    pub(crate) offset: i32,
    /// Where the move begins: half a gap behind the centre, or there.
    base: i32,
    /// The flank that the running move leads to, or the last one led to; 0 at the
    /// start, when the joint counts as centred.
    flank: i8,
    /// The flank that the command has last asked for.
    wanted: i8,
    /// True in the second half of the move.
    brakes: bool,
    /// `T + ½`.
    travel: Counts,
    /// Its change to the next sample.
    velocity: Counts,
    /// The change of that.
    change: Counts,
}

impl CrossingState {
    /// An offset of 0, the joint centred.
    pub(crate) const CENTRED: Self = Self {
        left: 0,
        offset: 0,
        base: 0,
        flank: 0,
        wanted: 0,
        brakes: false,
        travel: Counts::ZERO,
        velocity: Counts::ZERO,
        change: Counts::ZERO,
    };

    /// Starts the move to the flank that is asked for, where none is under way.
    pub(crate) fn begin(&mut self, settings: &Words) {
        if self.left != 0 || self.wanted == self.flank {
            return;
        }
        let [low, high] = [
            settings.crossing_first_low(),
            settings.crossing_first_high(),
        ];
        let mut first = Counts::from_bits(wide::joined(high.cast_signed(), low.cast_signed()));
        self.base = settings.half_gap_counts().cast_signed();
        if self.flank == 0 {
            // From the centre: half the way, to the nearest.
            first = Counts::from_bits(first.to_bits().wrapping_add(1).wrapping_shr(1));
            self.base = 0;
        }
        self.left = settings.crossing_half_samples();
        self.flank = self.wanted;
        self.brakes = false;
        self.travel = HALF;
        self.velocity = first;
        self.change = first.wrapping_add(first);
    }

    /// One sample of a move that is under way.
    #[inline(always)]
    pub(crate) fn advance(&mut self) {
        self.travel = self.travel.wrapping_add(self.velocity);
        self.velocity = self.velocity.wrapping_add(self.change);
        self.left = self.left.wrapping_sub(1);
        self.offset = self.nearest();
    }

    /// A move has come to its middle, or to its end: exactly there.
    pub(crate) fn turn(&mut self, settings: &Words) {
        let half_gap = settings.half_gap_counts().cast_signed();
        if self.brakes {
            self.offset = half_gap.wrapping_mul(i32::from(self.flank));
            return self.begin(settings);
        }
        // T(N) = B, of a move from the centre T(N)/2: half the way from the base
        let way = wide::signed(half_gap.wrapping_add(self.base));
        self.travel = HALF.wrapping_add(Counts::from_bits(way.wrapping_shl(31)));
        self.velocity = self.velocity.wrapping_sub(self.change);
        self.change = self.change.wrapping_neg();
        self.left = settings.crossing_half_samples();
        self.brakes = true;
        self.offset = self.nearest();
    }

    /// Notes the flank that the command asks for; tells whether it is another than
    /// that of the last move.
    pub(crate) const fn asks_for(&mut self, flank: i8) -> bool {
        self.wanted = flank;
        flank != self.flank
    }

    /// Tells whether the offset is on its way, or about to be: the axis is not in
    /// position before this is over.
    pub(crate) const fn is_under_way(&self) -> bool {
        self.left != 0 || self.wanted != self.flank
    }

    /// `dir·(T − B)`, to the nearest count; of a move from the centre `dir·T/2`.
    #[inline(always)]
    fn nearest(&self) -> i32 {
        let ahead = wide::upper(self.travel.to_bits()).wrapping_sub(self.base);
        ahead.wrapping_mul(i32::from(self.flank))
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
