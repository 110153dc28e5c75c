//! Motions in stretches against the exact command: within their bounds at every
//! sample looked at, exact at the end, mirrored, and refused only with reason.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by panicking"
)]

mod command;
mod edges;
mod golden;

use firmware::law::LawWords;
use firmware::refusal::What;
use firmware::{Codes, GainWord, MotionPlan, Stretch};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

use command::{Command, Fixed};

/// A travel, its intervals \[ps\] and the sample time \[ns\].
type Drawn = (i64, [u64; 7], u32);

/// One sample of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sample {
    position: i32,
    ahead: Codes,
}

/// Every sample of stretches, made as an axis makes them.
fn samples(stretches: impl Iterator<Item = Stretch>) -> impl Iterator<Item = Sample> {
    stretches.flat_map(|mut stretch| {
        core::iter::from_fn(move || {
            (stretch.samples > 0).then(|| {
                stretch.samples -= 1;
                let sample = Sample {
                    position: stretch.position.floor().to_num(),
                    ahead: stretch.ahead,
                };
                stretch.advance();
                sample
            })
        })
    })
}

/// Words of a feed-forward that gives some thousands of codes: of the velocity,
/// of the acceleration, or none.
fn words(velocity: i32, acceleration: i32) -> LawWords {
    LawWords {
        velocity_ff: GainWord::new(velocity, 32),
        acceleration_ff: GainWord::new(acceleration, 32),
        ..LawWords::NONE
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
    /// Of the feed-forward \[codes\].
    ahead: f64,
}

impl Worst {
    fn take(&mut self, other: Self) {
        self.position = self.position.max(other.position);
        self.ahead = self.ahead.max(other.ahead);
    }
}

/// Runs the motion to its end and compares `every`-th samples, and those on
/// both sides of each change of interval; with the number of its stretches.
fn compare(drawn: Drawn, plan: &MotionPlan, half_pi: &Fixed, every: u64) -> (Worst, usize) {
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
    // Half a thousandth of a code a unit of 24 bits: up to 8,192 codes.
    let words = words(1 << 21, 1 << 21);
    let stretches: Vec<Stretch> = plan.stretches(&words, 0).collect();
    let mut worst = Worst::default();
    let (mut previous, mut position) = (0_i32, 0_i64);
    let mut count = 0;
    for (k, sample) in (0_u64..).zip(samples(stretches.iter().copied())) {
        let moved = i64::from(sample.position.wrapping_sub(previous));
        assert!(moved * travel.signum() >= 0, "back at {k} of {drawn:?}");
        previous = sample.position;
        position += moved;
        if k % every == 0 || edges.contains(&k) {
            let exact = command.at_sample(k);
            let off = Fixed::ratio(i128::from(position), 1).sub(&exact.position);
            let unit = |bits: u8| 2_f64.powi(i32::from(bits) - 11);
            let ahead = exact.velocity.to_f64(0) * unit(plan.head().velocity_fraction_bits)
                + exact.acceleration.to_f64(0) * unit(plan.head().acceleration_fraction_bits);
            worst.take(Worst {
                position: off.to_f64(0).abs(),
                ahead: (sample.ahead.to_num::<f64>() - ahead).abs(),
            });
        }
        count = k + 1;
    }
    assert_eq!(count, plan.head().last_sample, "{drawn:?}");
    let end = (i128::from(travel) + (1 << 31)) >> 32;
    assert_eq!(plan.head().end, end as i32, "of {drawn:?}");
    (worst, stretches.len())
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
                worst.take(compare(drawn, &plan, &half_pi, every).0);
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

/// ½ for the rounding and ¼ for all before it; see `firmware::motion`.
const BOUND: Worst = Worst {
    position: 0.75,
    ahead: 0.125,
};

fn within(worst: Worst) -> bool {
    worst.position <= BOUND.position && worst.ahead <= BOUND.ahead
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
            let every = (plan.head().last_sample / 500).max(1);
            let (worst, stretches) = compare(drawn, &plan, &half_pi, every);
            let samples = plan.head().last_sample;
            println!("{travel} in {samples} samples, {stretches} stretches: {worst:?}");
            assert!(within(worst));
        }
    }
}

/// A usual motion takes few stretches. The contrast: ones twice as long leave
/// their bound.
#[test]
fn usual_motions_take_few_stretches() {
    let half_pi = Fixed::half_pi();
    let ms = 1_000_000_000;
    for (counts, each_ms) in [(6_000_i64, 40), (100_000, 140), (10_000_000, 140)] {
        let drawn = (counts << 32, [each_ms * ms; 7], 1_000_000);
        let plan = MotionPlan::new(drawn.0, drawn.1, drawn.2).expect("a plan");
        let (worst, stretches) = compare(drawn, &plan, &half_pi, 1);
        println!(
            "{counts} counts in {} ms: {stretches} stretches, {worst:?}",
            7 * each_ms
        );
        assert!(within(worst));
        assert!(stretches <= 160, "{stretches}");
    }
}

fn stretches(plan: &MotionPlan, start: i32) -> Vec<Stretch> {
    plan.stretches(&words(1 << 20, 1 << 19), start).collect()
}

/// Every sample of a plan.
fn all(plan: &MotionPlan) -> Vec<Sample> {
    samples(stretches(plan, 0).into_iter()).collect()
}

proptest! {
    /// The sums are those of the travel's magnitude; the sign comes last.
    #[test]
    fn a_mirrored_travel_is_mirrored_exactly((travel, intervals, period) in drawn(64)) {
        let there = MotionPlan::new(travel, intervals, period);
        let back = MotionPlan::new(-travel, intervals, period);
        prop_assert_eq!(there.is_ok(), back.is_ok());
        if let (Ok(there), Ok(back)) = (there, back) {
            for (a, b) in all(&there).into_iter().zip(all(&back)) {
                prop_assert_eq!(a.ahead, -b.ahead);
                // Both halves go up.
                prop_assert!([0, 1].contains(&a.position.wrapping_add(b.position)));
            }
        }
    }

    /// Another start of the motion only shifts it, round the wheel too.
    #[test]
    fn the_start_is_added_modulo_2_32((travel, intervals, period) in drawn(16), start: i32) {
        if let Ok(plan) = MotionPlan::new(travel, intervals, period) {
            let moved = samples(stretches(&plan, start).into_iter());
            for (a, b) in all(&plan).into_iter().zip(moved) {
                prop_assert_eq!(a.position.wrapping_add(start), b.position);
                prop_assert_eq!(a.ahead, b.ahead);
            }
        }
    }
}
