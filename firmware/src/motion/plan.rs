//! A plan from travel and intervals, and its setpoints sample by sample.

use heapless::Vec;

use super::interval::{chain, sample_from};
use super::piece::{Piece, Point};
use super::real::Real;
use crate::reference::{Next, Observed, Setpoint, SetpointSource};
use crate::refusal::{Refusal, What};
use crate::wide::held;

/// Fraction bits of velocity and acceleration at most.
const OUTPUT_BITS_MAX: i32 = 60;
/// The intervals together last at most this long \[ps\].
const DURATION_MAX_PS: u64 = 1 << 62;

/// Peaks of velocity and acceleration \[counts per sample, per sample²\].
const PEAKS: [i64; 2] = [0, (1 << PEAK_BITS) - 1];

/// Bits of those peaks: setpoints' rates stay below
/// [`crate::law::words::LARGEST_RATE`].
const PEAK_BITS: u8 = 24;
const _: () = assert!(1 << PEAK_BITS == crate::law::words::LARGEST_RATE);

/// A motion that can be generated: checked and computed once. The default is no
/// motion: the axis stays at 0.
///
/// ```
/// use firmware::MotionPlan;
///
/// // 2^20 counts in four quarter waves of 0.25 s, at 1 ms.
/// let quarter_ps = 250_000_000_000;
/// let intervals_ps = [quarter_ps, 0, quarter_ps, 0, quarter_ps, 0, quarter_ps];
/// let plan = MotionPlan::new(1 << 52, intervals_ps, 1_000_000)?;
/// assert_eq!(plan.head().last_sample, 1_000);
/// // The peak is 2^21 counts per second, 2^11.03 per sample, in 24 bits.
/// assert_eq!(plan.head().velocity_fraction_bits, 12);
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MotionPlan {
    /// Those of the intervals that have samples, for the travel's magnitude.
    pub(super) pieces: Vec<Piece, 7>,
    pub(super) head: PlanHead,
}

/// A plan without its pieces; the default is no motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlanHead {
    /// −1 where the travel is negative, otherwise 0.
    pub sign: i32,
    /// The end of the motion, `floor(h + ½)` \[counts, modulo 2^32\].
    pub end: i32,
    /// Number of the sample at which the motion has ended; the first is 0.
    pub last_sample: u64,
    /// Fraction bits of the setpoints' velocities, 0 to 60.
    pub velocity_fraction_bits: u8,
    /// Fraction bits of the setpoints' accelerations, 0 to 60.
    pub acceleration_fraction_bits: u8,
}

impl MotionPlan {
    /// The motion over `travel` \[2^−32 counts\] in the intervals `t1` to `t7`
    /// \[ps\], with a sample every `period_ns` from its start on.
    ///
    /// # Errors
    /// [`Refusal`] if there is no acceleration or no deceleration, or what
    /// is asked for cannot be generated to a quarter of a count.
    pub fn new(travel: i64, intervals_ps: [u64; 7], period_ns: u32) -> Result<Self, Refusal> {
        What::Period.word_within(period_ns, [1, u32::MAX])?;
        What::Travel.within(travel, [i64::MIN.saturating_add(1), i64::MAX])?;
        let total_ps = intervals_ps
            .iter()
            .fold(0_u64, |sum, &t| sum.saturating_add(t));
        What::Duration.within(held(total_ps), [0, held(DURATION_MAX_PS)])?;
        // Below 2^42.
        let period_ps = u64::from(period_ns).saturating_mul(1_000);
        let (peak, intervals) = chain(travel.unsigned_abs(), intervals_ps, period_ps)?;

        let velocity_bits =
            output_bits(peak).ok_or_else(|| Refusal::new(What::Velocity, rounded(peak), PEAKS))?;
        let mut acceleration_bits = OUTPUT_BITS_MAX;
        for interval in intervals.iter().filter(|interval| interval.samples > 0) {
            let largest = interval.largest_acceleration();
            let bits = output_bits(largest).ok_or_else(|| {
                let what = What::Acceleration(interval.number);
                Refusal::new(what, rounded(largest), PEAKS)
            })?;
            acceleration_bits = acceleration_bits.min(bits);
        }

        let mut pieces = Vec::new();
        for interval in intervals.iter().filter(|interval| interval.samples > 0) {
            // There is room for all seven.
            let _ = pieces.push(interval.piece(velocity_bits, acceleration_bits)?);
        }
        let half = 1_i128 << 31_u32;
        let end = i128::from(travel).wrapping_add(half).wrapping_shr(32);
        let [a, b, c, d, ..] = end.to_le_bytes();
        Ok(Self {
            pieces,
            head: PlanHead {
                sign: i32::from(travel < 0).wrapping_neg(),
                end: i32::from_le_bytes([a, b, c, d]),
                last_sample: sample_from(total_ps, period_ps),
                velocity_fraction_bits: u8::try_from(velocity_bits).unwrap_or(0),
                acceleration_fraction_bits: u8::try_from(acceleration_bits).unwrap_or(0),
            },
        })
    }

    /// The plan less its pieces.
    pub const fn head(&self) -> PlanHead {
        self.head
    }

    /// The pieces in their order.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Begins a plan that another machine has computed; its pieces follow. In
    /// place: a plan is too large to pass over a chip's stack.
    pub fn begin(&mut self, head: PlanHead) {
        self.pieces.clear();
        self.head = head;
    }

    /// Adds the next piece; `None` if there is no room for it.
    pub fn push(&mut self, piece: Piece) -> Option<()> {
        self.pieces.push(piece).ok()
    }
}

/// Fraction bits that bring a peak to 2^23 to 2^24; none if it is larger.
fn output_bits(peak: Real) -> Option<i32> {
    let bits = i32::from(PEAK_BITS).saturating_sub(peak.bits());
    (bits >= 0).then_some(bits.min(OUTPUT_BITS_MAX))
}

/// Magnitude in whole units, for messages.
fn rounded(value: Real) -> i64 {
    i64::try_from(value.to_fixed(0).unsigned_abs()).unwrap_or(i64::MAX)
}

/// Progress of a motion: 56 bytes. The default is before its first
/// sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotionState {
    pub(super) point: Point,
    /// Samples of the present interval still to come.
    pub(super) left: u32,
    /// Intervals entered so far.
    pub(super) entered: u8,
}

/// An axis keeps all that it remembers in 256 bytes.
const _: () = assert!(size_of::<MotionState>() == 56);

/// A source of setpoints that computes them from a plan.
///
/// ```
/// use firmware::{MotionGenerator, MotionPlan, Next, Observed, SetpointSource};
///
/// // 1000 counts up in 40 ms and to rest in 40 ms, a sample every 20 ms.
/// let intervals_ps = [0, 40_000_000_000, 0, 0, 0, 40_000_000_000, 0];
/// let plan = MotionPlan::new(1_000 << 32, intervals_ps, 20_000_000)?;
/// let mut source = MotionGenerator::new(&plan, 7);
/// let mut positions = [0; 5];
/// for position in &mut positions {
///     *position = match source.next(&Observed::default()) {
///         Next::Setpoint(setpoint) | Next::Last(setpoint) => setpoint.position,
///         Next::Underrun => unreachable!("a plan has every sample"),
///     };
/// }
/// assert_eq!(positions, [7, 132, 507, 882, 1_007]);
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct MotionGenerator<'a> {
    plan: &'a MotionPlan,
    state: MotionState,
    start: i32,
}

impl<'a> MotionGenerator<'a> {
    /// Starts the motion at `start` \[counts, modulo 2^32\].
    pub fn new(plan: &'a MotionPlan, start: i32) -> Self {
        Self {
            plan,
            state: MotionState::default(),
            start,
        }
    }

    /// Progress of the motion.
    pub const fn state(&self) -> &MotionState {
        &self.state
    }
}

impl SetpointSource for MotionGenerator<'_> {
    #[inline]
    fn next(&mut self, _: &Observed) -> Next {
        let next = self.plan.next(&mut self.state);
        let placed = |setpoint: Setpoint| Setpoint {
            position: setpoint.position.wrapping_add(self.start),
            ..setpoint
        };
        match next {
            Next::Setpoint(setpoint) => Next::Setpoint(placed(setpoint)),
            Next::Last(setpoint) => Next::Last(placed(setpoint)),
            Next::Underrun => Next::Underrun,
        }
    }
}

impl MotionPlan {
    /// The setpoint of the next sample, relative to where the motion starts;
    /// from the end on the last one.
    #[inline]
    pub fn next(&self, state: &mut MotionState) -> Next {
        let piece = if state.left > 0 {
            state.left = state.left.wrapping_sub(1);
            let present = usize::from(state.entered).wrapping_sub(1);
            self.pieces
                .get(present)
                .inspect(|piece| piece.advance(&mut state.point))
        } else {
            let piece = self.pieces.get(usize::from(state.entered));
            piece.inspect(|piece| state.enter(piece))
        };
        match piece {
            Some(piece) => Next::Setpoint(piece.setpoint(&state.point, self.head.sign)),
            None => Next::Last(Setpoint {
                position: self.head.end,
                velocity: 0,
                acceleration: 0,
            }),
        }
    }
}

impl MotionState {
    #[inline]
    fn enter(&mut self, piece: &Piece) {
        // Seven intervals at most.
        self.entered = self.entered.wrapping_add(1);
        self.left = piece.samples.wrapping_sub(1);
        self.point = piece.entry;
    }
}
