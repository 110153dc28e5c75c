//! The motion generator against the exact command: within its bound at every
//! sample looked at, exact at the end, mirrored, and refused only with reason.

#![allow(clippy::expect_used, reason = "a test fails by panicking")]

mod command;

use firmware::{MotionError, MotionPlan, MotionState, Next, Setpoint};
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
                        let span = (u64::from(period) * 1_000 << scale) >> (raw[index] % 13);
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
    /// Distance of the rounded position from the exact one, less ½ \[counts\].
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
    let mut previous = 0;
    for k in 0..=plan.last_sample() {
        let (setpoint, last) = step(plan, &mut state);
        assert_eq!(last, k == plan.last_sample(), "sample {k} of {drawn:?}");
        let moved = i64::from(setpoint.position) - previous;
        assert!(moved * travel.signum() >= 0, "back at {k} of {drawn:?}");
        previous = i64::from(setpoint.position);
        if k % every == 0 || edges.contains(&k) {
            let exact = command.at_sample(k);
            let off = |value: i32, exact: &Fixed, bits: u8| {
                let value = Fixed::ratio(i128::from(value) << 64, 1 << (64 + u32::from(bits)));
                value.sub(exact).to_f64(i32::from(bits)).abs()
            };
            worst.take(Worst {
                position: off(setpoint.position, &exact.position, 0) - 0.5,
                velocity: off(
                    setpoint.velocity,
                    &exact.velocity,
                    plan.velocity_fraction_bits(),
                ),
                acceleration: off(
                    setpoint.acceleration,
                    &exact.acceleration,
                    plan.acceleration_fraction_bits(),
                ),
            });
        }
    }
    let (setpoint, last) = step(plan, &mut state);
    assert!(last, "the end is held");
    let end = (i128::from(travel) + (1 << 31)) >> 32;
    assert_eq!(i128::from(setpoint.position), end, "of {drawn:?}");
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
                let every = (plan.last_sample() / looks).max(1);
                worst.take(compare(drawn, &plan, &half_pi, every));
                planned += 1;
            }
            Err(MotionError::Speed { .. } | MotionError::Acceleration { .. }) => {}
            Err(other) => panic!("{other}: {drawn:?}"),
        }
    }
    (worst, planned)
}

#[test]
fn short_motions() {
    let (worst, planned) = survey(4_000, 64, 12);
    println!("{planned} motions up to 64 samples an interval: {worst:?}");
    assert!(planned > 3_000);
    assert!(worst.position <= 0.25 && worst.velocity <= 6.0 && worst.acceleration <= 6.0);
}

#[test]
fn long_motions() {
    let (worst, planned) = survey(1_000, 1 << 14, 12);
    println!("{planned} motions up to 2^14 samples an interval: {worst:?}");
    assert!(worst.position <= 0.25 && worst.velocity <= 6.0 && worst.acceleration <= 6.0);
}
