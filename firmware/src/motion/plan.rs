//! A plan from travel and intervals, and its setpoints sample by sample.

use heapless::Vec;

use super::planner::{PlanHead, Planner};
use crate::law::LawWords;
use crate::reference::{InPlace, Next, Observed, Setpoint, SetpointSource, Stretch};
use crate::refusal::{Refusal, What};

/// A motion that can be generated: checked once. The default is no motion: the
/// axis stays at 0.
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
    travel: i64,
    intervals_ps: [u64; 7],
    period_ns: u32,
    head: PlanHead,
}

impl MotionPlan {
    /// The motion over `travel` \[2^−32 counts\] in the intervals `t1` to `t7`
    /// \[ps\], with a sample every `period_ns` from its start on.
    ///
    /// # Errors
    /// [`Refusal`] if there is no acceleration or no deceleration, or what
    /// is asked for cannot be generated to a quarter of a count.
    pub fn new(travel: i64, intervals_ps: [u64; 7], period_ns: u32) -> Result<Self, Refusal> {
        let mut plan = Self {
            travel,
            intervals_ps,
            period_ns,
            head: PlanHead::default(),
        };
        let mut planner = Planner::NONE;
        plan.again(&mut planner)?;
        plan.head = planner.head();
        Ok(plan)
    }

    fn again(&self, planner: &mut Planner) -> Result<(), Refusal> {
        planner.plan(self.travel, &self.intervals_ps, self.period_ns)
    }

    /// What is known of the motion besides its stretches.
    pub const fn head(&self) -> PlanHead {
        self.head
    }

    /// The motion from `start` on \[counts, modulo 2^32\], with the feed-forward
    /// that the words give: `Kv·v + Ka·a + Kf·sign(v)`, in the exponents of
    /// [`MotionPlan::head`], with the sign that `v` has on the way.
    pub fn stretches(&self, words: &LawWords, start: i32) -> Stretches {
        let mut stretches = Stretches(Planner::NONE);
        self.begin(&mut stretches.0, words, start);
        stretches
    }

    fn begin(&self, planner: &mut Planner, words: &LawWords, start: i32) {
        // It was accepted, or is no motion, which has no stretches.
        if self.again(planner).is_ok() {
            let gains = [words.velocity_ff, words.acceleration_ff, words.friction_ff];
            planner.begin(gains, start);
        }
    }
}

/// Stretches of a plan, in their order.
#[derive(Debug, Clone)]
pub struct Stretches(Planner);

impl Iterator for Stretches {
    type Item = Stretch;

    fn next(&mut self) -> Option<Stretch> {
        let mut words = [0; Stretch::WORDS];
        let there = self.0.next(&mut words);
        there.then(|| Stretch::from_words(&words))
    }
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
        let mut planner = Planner::NONE;
        plan.begin(&mut planner, words, 0);
        let mut words = [0; Stretch::WORDS];
        let mut needed = 0_i64;
        while planner.next(&mut words) {
            needed = needed.saturating_add(1);
            // What has no room is counted.
            let _ = self.stretches.push(Stretch::from_words(&words));
        }
        let most = i64::try_from(N).unwrap_or(i64::MAX);
        if needed > most {
            self.stretches.clear();
            return Err(Refusal::new(What::Stretches, needed, [0, most]));
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
