//! The motion generator against the exact command: within its bound at every
//! sample looked at, exact at the end, mirrored, and refused only with reason.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

mod command;
mod edges;

use firmware::refusal::What;
use firmware::{
    MotionGenerator, MotionPlan, MotionState, Next, Observed, Setpoint, SetpointSource,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

use command::{Command, Fixed};

/// A travel, its intervals \[ps\] and the sample time \[ns\].
type Drawn = (i64, [u64; 7], u32);

/// The setpoint of the next sample, and whether it is the last.
fn step(plan: &MotionPlan, state: &mut MotionState) -> (Setpoint, bool) {
    match plan.next(state) {
        Next::Setpoint(setpoint) => (setpoint, false),
        Next::Last(setpoint) => (setpoint, true),
        Next::Underrun => panic!("a plan has every sample"),
    }
}

/// Any pattern of intervals; lengths between a part of a sample and so many
/// samples, no multiples of the sample time, any travel.
fn drawn(most_samples: u64) -> impl Strategy<Value = Drawn> {
    let scale = 0..=most_samples.ilog2();
    let period = prop_oneof![Just(1_000_u32), 1_000..=100_000_000_u32];
    (
        1..128_u8,
        prop::array::uniform7(0..=u64::MAX),
        scale,
        period,
        0..63_u32,
        any::<i64>(),
    )
        .prop_filter_map(
            "it starts and stops",
            |(pattern, raw, scale, period, bits, travel)| {
                let mut intervals = [0; 7];
                for (index, interval) in intervals.iter_mut().enumerate() {
                    if pattern & (1 << index) != 0 {
                        // Uneven: some intervals are 2^12 times shorter.
                        let span = ((u64::from(period) * 1_000) << scale) >> (raw[index] % 13);
                        *interval = 1 + (raw[index] >> 8) % span.max(1);
                    }
                }
                let moves = intervals[..3].iter().any(|&t| t > 0);
                let stops = intervals[4..].iter().any(|&t| t > 0);
                (moves && stops).then_some((travel >> bits, intervals, period))
            },
        )
}

/// Worst differences of one motion from the command.
#[derive(Debug, Default, Clone, Copy)]
struct Worst {
    /// Distance of the rounded position from the exact one \[counts\].
    position: f64,
    /// In units of the output.
    velocity: f64,
    acceleration: f64,
}

impl Worst {
    fn take(&mut self, other: Self) {
        self.position = self.position.max(other.position);
        self.velocity = self.velocity.max(other.velocity);
        self.acceleration = self.acceleration.max(other.acceleration);
    }
}

/// Runs the motion to its end and compares `every`-th samples, and those on
/// both sides of each change of interval.
fn compare(drawn: Drawn, plan: &MotionPlan, half_pi: &Fixed, every: u64) -> Worst {
    let (travel, intervals_ps, period_ns) = drawn;
    let command = Command::new(travel, intervals_ps, period_ns, half_pi);
    let period_ps = u64::from(period_ns) * 1_000;
    let mut edges = Vec::new();
    let mut sum = 0;
    for t in intervals_ps {
        sum += t;
        let edge = sum.div_ceil(period_ps);
        edges.extend([edge.saturating_sub(1), edge, edge + 1]);
    }
    let mut state = MotionState::default();
    let mut worst = Worst::default();
    let (mut previous, mut position) = (0_i32, 0_i64);
    for k in 0..=plan.head().last_sample {
        let (setpoint, last) = step(plan, &mut state);
        assert_eq!(
            last,
            k == plan.head().last_sample,
            "sample {k} of {drawn:?}"
        );
        let moved = i64::from(setpoint.position.wrapping_sub(previous));
        assert!(moved * travel.signum() >= 0, "back at {k} of {drawn:?}");
        previous = setpoint.position;
        position += moved;
        if k % every == 0 || edges.contains(&k) {
            let exact = command.at_sample(k);
            let off = |value: i64, exact: &Fixed, bits: u8| {
                let value = Fixed::ratio(i128::from(value), 1 << u32::from(bits));
                value.sub(exact).to_f64(i32::from(bits)).abs()
            };
            worst.take(Worst {
                position: off(position, &exact.position, 0),
                velocity: off(
                    i64::from(setpoint.velocity),
                    &exact.velocity,
                    plan.head().velocity_fraction_bits,
                ),
                acceleration: off(
                    i64::from(setpoint.acceleration),
                    &exact.acceleration,
                    plan.head().acceleration_fraction_bits,
                ),
            });
        }
    }
    let (setpoint, last) = step(plan, &mut state);
    assert!(last, "the end is held");
    let end = (i128::from(travel) + (1 << 31)) >> 32;
    assert_eq!(i128::from(position), end, "of {drawn:?}");
    assert_eq!(setpoint.position, previous);
    assert_eq!((setpoint.velocity, setpoint.acceleration), (0, 0));
    worst
}

/// Draws motions and gives the worst of all that have a plan, and how many.
fn survey(cases: u32, most_samples: u64, looks: u64) -> (Worst, u32) {
    let half_pi = Fixed::half_pi();
    let mut runner = TestRunner::new_with_rng(
        Config::default(),
        TestRng::deterministic_rng(RngAlgorithm::ChaCha),
    );
    let strategy = drawn(most_samples);
    let mut worst = Worst::default();
    let mut planned = 0;
    for _ in 0..cases {
        let drawn = strategy.new_tree(&mut runner).expect("a motion").current();
        let (travel, intervals_ps, period_ns) = drawn;
        match MotionPlan::new(travel, intervals_ps, period_ns) {
            Ok(plan) => {
                let every = (plan.head().last_sample / looks).max(1);
                worst.take(compare(drawn, &plan, &half_pi, every));
                planned += 1;
            }
            Err(refusal) => assert!(
                matches!(refusal.what, What::Velocity | What::Acceleration(_)),
                "{refusal}: {drawn:?}"
            ),
        }
    }
    (worst, planned)
}

/// ½ for the rounding and ¼ for all before it; 3 units and `N·2^−27`, below
/// 0.01 here, for velocity and acceleration (see `firmware::motion`).
const BOUND: Worst = Worst {
    position: 0.75,
    velocity: 3.01,
    acceleration: 3.01,
};

fn within(worst: Worst) -> bool {
    worst.position <= BOUND.position
        && worst.velocity <= BOUND.velocity
        && worst.acceleration <= BOUND.acceleration
}

#[test]
fn short_motions_follow_the_command() {
    let (worst, planned) = survey(4_000, 64, 12);
    println!("{planned} motions, up to 2^6 samples an interval: {worst:?}");
    assert!(planned > 3_000 && within(worst));
}

#[test]
fn longer_motions_follow_the_command() {
    let (worst, planned) = survey(1_000, 1 << 14, 12);
    println!("{planned} motions, up to 2^14 samples an interval: {worst:?}");
    assert!(planned > 900 && within(worst));
}

/// Almost 2^31 counts, both ways, over a million samples and over few.
#[test]
fn the_longest_travel_follows_the_command() {
    let half_pi = Fixed::half_pi();
    for travel in [i64::MAX, -i64::MAX, (i64::MAX >> 32) << 32] {
        for each_ps in [143_000_777_777_777, 15_000_777_777_777, 33_000_777_777] {
            let drawn = (travel, [each_ps; 7], 1_000_000);
            let plan = MotionPlan::new(travel, [each_ps; 7], 1_000_000).expect("a plan");
            let worst = compare(
                drawn,
                &plan,
                &half_pi,
                (plan.head().last_sample / 500).max(1),
            );
            println!("{travel} in {} samples: {worst:?}", plan.head().last_sample);
            assert!(within(worst));
        }
    }
}

/// Two thousandths of a count are no more than the rounding of a tie: with 53
/// bits or more in all sums, nearly every position is the nearest integer.
#[test]
fn positions_are_the_nearest_integers() {
    let (worst, _) = survey(500, 1 << 10, 64);
    assert!(worst.position < 0.502, "{worst:?}");
}

/// Need for the bound: positions summed from the velocities of the
/// setpoints, 24 bits each, lose it within the same motion.
#[test]
fn summed_velocities_do_not_follow() {
    // Constant accelerations and whole samples: the mean of two velocities is
    // the exact step.
    let each_ps = 33_333 * 1_000_000_000;
    let travel = 2_000_000_011 << 32;
    let plan = MotionPlan::new(
        travel,
        [0, each_ps, 0, 9 * each_ps, 0, each_ps, 0],
        1_000_000,
    );
    let plan = plan.expect("a plan");
    let mut state = MotionState::default();
    let (mut twice, mut before, mut worst) = (0_i64, 0, 0_f64);
    for _ in 0..=plan.head().last_sample {
        let (setpoint, _) = step(&plan, &mut state);
        twice += i64::from(before) + i64::from(setpoint.velocity);
        before = setpoint.velocity;
        let summed = twice as f64 / 2_f64.powi(1 + i32::from(plan.head().velocity_fraction_bits));
        worst = worst.max((summed - f64::from(setpoint.position)).abs());
    }
    assert!(worst > BOUND.position, "{worst}");
}

/// A whole run of setpoints.
fn all(plan: &MotionPlan) -> Vec<(Setpoint, MotionState)> {
    let mut state = MotionState::default();
    (0..=plan.head().last_sample)
        .map(|_| {
            let (setpoint, _) = step(plan, &mut state);
            (setpoint, state)
        })
        .collect()
}

proptest! {
    /// The sums are those of the travel's magnitude; the sign comes last.
    #[test]
    fn a_mirrored_travel_is_mirrored_exactly((travel, intervals, period) in drawn(64)) {
        let there = MotionPlan::new(travel, intervals, period);
        let back = MotionPlan::new(-travel, intervals, period);
        prop_assert_eq!(there.is_ok(), back.is_ok());
        if let (Ok(there), Ok(back)) = (there, back) {
            prop_assert_eq!(there.head().velocity_fraction_bits, back.head().velocity_fraction_bits);
            for ((a, sum), (b, mirrored)) in all(&there).into_iter().zip(all(&back)) {
                prop_assert_eq!(sum, mirrored);
                prop_assert_eq!((a.velocity, a.acceleration), (-b.velocity, -b.acceleration));
                // Both halves go up.
                prop_assert!([0, 1].contains(&(a.position + b.position)));
            }
        }
    }

    /// Another start of the motion only shifts it, round the wheel too.
    #[test]
    fn the_start_is_added_modulo_2_32((travel, intervals, period) in drawn(16), start: i32) {
        if let Ok(plan) = MotionPlan::new(travel, intervals, period) {
            let mut source = MotionGenerator::new(&plan, start);
            let (mut next, mut state) = (None, MotionState::default());
            for _ in 0..=plan.head().last_sample {
                let (mut expected, last) = step(&plan, &mut state);
                expected.position = expected.position.wrapping_add(start);
                let expected =
                    if last { Next::Last(expected) } else { Next::Setpoint(expected) };
                next = Some(source.next(&Observed::default()));
                prop_assert_eq!(next, Some(expected));
                prop_assert_eq!(source.state(), &state);
            }
            let end = start.wrapping_add(plan.head().end);
            prop_assert!(matches!(next, Some(Next::Last(last)) if last.position == end));
        }
    }

    /// Velocity and acceleration use at least 23 of their 24 bits.
    #[test]
    fn the_peaks_fill_their_words(
        travel in prop_oneof![1_i64 << 40..1 << 58, -1_i64 << 58..-1 << 40],
        samples in prop::array::uniform7(2..60_u64),
    ) {
        let intervals = samples.map(|n| n * 1_000_000_000);
        let plan = MotionPlan::new(travel, intervals, 1_000_000).expect("a plan");
        let setpoints = all(&plan);
        let peak = |value: fn(&Setpoint) -> i32| {
            setpoints.iter().map(|(s, _)| value(s).unsigned_abs()).max()
        };
        for peak in [peak(|s| s.velocity), peak(|s| s.acceleration)] {
            let peak = peak.expect("setpoints");
            prop_assert!(((1 << 23) - 8..=1 << 24).contains(&peak), "{}", peak);
        }
    }
}
