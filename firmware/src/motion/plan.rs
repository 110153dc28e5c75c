//! A plan from travel and intervals, and its setpoints sample by sample.

use heapless::Vec;

use super::interval::{Interval, chain, sample_from};
use super::real::Real;
use crate::law::LawWords;
use crate::reference::{InPlace, Next, Observed, Setpoint, SetpointSource, Stretch};
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
    pub(super) intervals: Vec<Interval, 7>,
    pub(super) head: PlanHead,
}

/// A plan without its intervals; the default is no motion.
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

        let mut with_samples = Vec::new();
        for interval in intervals.iter().filter(|interval| interval.samples > 0) {
            // There is room for all seven.
            let _ = with_samples.push(*interval);
        }
        let half = 1_i128 << 31_u32;
        let end = i128::from(travel).wrapping_add(half).wrapping_shr(32);
        let [a, b, c, d, ..] = end.to_le_bytes();
        Ok(Self {
            intervals: with_samples,
            head: PlanHead {
                sign: i32::from(travel < 0).wrapping_neg(),
                end: i32::from_le_bytes([a, b, c, d]),
                last_sample: sample_from(total_ps, period_ps),
                velocity_fraction_bits: u8::try_from(velocity_bits).unwrap_or(0),
                acceleration_fraction_bits: u8::try_from(acceleration_bits).unwrap_or(0),
            },
        })
    }

    /// The plan less its intervals.
    pub const fn head(&self) -> PlanHead {
        self.head
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

/// The stretches of a motion in memory, at most `N` of them: planned once, run as
/// often as it is wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlannedMotion<const N: usize> {
    stretches: Vec<Stretch, N>,
    end: i32,
}

impl<const N: usize> PlannedMotion<N> {
    /// No motion: it ends where it starts.
    pub const NONE: Self = Self {
        stretches: Vec::new(),
        end: 0,
    };

    /// The stretches of a plan from 0 on, with the feed-forward that the words
    /// give ([`MotionPlan::stretches`]).
    ///
    /// # Errors
    /// A [`Refusal`] where there are more than `N`.
    pub fn new(plan: &MotionPlan, words: &LawWords) -> Result<Self, Refusal> {
        let mut planned = Self::NONE;
        planned.plan(plan, words)?;
        Ok(planned)
    }

    /// The same in memory that is there already.
    ///
    /// # Errors
    /// A [`Refusal`] where there are more than `N`; the motion is none then.
    pub fn plan(&mut self, plan: &MotionPlan, words: &LawWords) -> Result<(), Refusal> {
        self.stretches.clear();
        self.end = 0;
        for stretch in plan.stretches(words, 0) {
            if self.stretches.push(stretch).is_err() {
                self.stretches.clear();
                let [needed, most] = [plan.stretches(words, 0).count(), N]
                    .map(|count| i64::try_from(count).unwrap_or(i64::MAX));
                return Err(Refusal::new(What::Stretches, needed, [0, most]));
            }
        }
        self.end = plan.head().end;
        Ok(())
    }

    /// The end of the motion \[counts\].
    pub const fn end(&self) -> i32 {
        self.end
    }

    /// The stretches in their order.
    pub fn stretches(&self) -> &[Stretch] {
        &self.stretches
    }
}

/// A source of setpoints that runs a planned motion.
///
/// ```
/// use firmware::law::LawWords;
/// use firmware::{Motion, MotionPlan, Next, Observed, PlannedMotion, SetpointSource};
///
/// // 1000 counts up in 40 ms and to rest in 40 ms, a sample every 20 ms.
/// let intervals_ps = [0, 40_000_000_000, 0, 0, 0, 40_000_000_000, 0];
/// let plan = MotionPlan::new(1_000 << 32, intervals_ps, 20_000_000)?;
/// let planned = PlannedMotion::<8>::new(&plan, &LawWords::NONE)?;
/// let mut source = Motion::new(&planned, 7);
/// // Up, down, and the end.
/// assert!(matches!(source.next(&Observed::default()), Next::Stretch(up) if up.samples == 2));
/// assert!(matches!(source.next(&Observed::default()), Next::Stretch(_)));
/// assert!(matches!(source.next(&Observed::default()), Next::Last(end) if end.position == 1_007));
/// # Ok::<(), firmware::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct Motion<'a> {
    stretches: core::slice::Iter<'a, Stretch>,
    end: i32,
    start: i32,
}

impl<'a> Motion<'a> {
    /// The motion from `start` on \[counts, modulo 2^32\].
    pub fn new<const N: usize>(planned: &'a PlannedMotion<N>, start: i32) -> Self {
        Self {
            stretches: planned.stretches.iter(),
            end: start.wrapping_add(planned.end),
            start,
        }
    }
}

impl SetpointSource for Motion<'_> {
    fn next(&mut self, observed: &Observed) -> Next {
        let mut stretch = Stretch::default();
        self.next_in_place(observed, &mut stretch).with(stretch)
    }

    #[inline(always)]
    fn next_in_place(&mut self, _: &Observed, stretch: &mut Stretch) -> InPlace {
        match self.stretches.next() {
            Some(next) => {
                stretch.take(next, self.start);
                InPlace::Stretch
            }
            None => InPlace::Last(Setpoint {
                position: self.end,
                ..Setpoint::default()
            }),
        }
    }
}
