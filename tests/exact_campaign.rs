//! The exact solver against `dopri5`, restarted from its state at every
//! sample, over random axes, loops and voltages.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]
#![allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts and nanoseconds of a short run"
)]

#[path = "exact_campaign/compare.rs"]
mod compare;
#[path = "exact_campaign/margin.rs"]
mod margin;
#[path = "exact_campaign/tally.rs"]
mod tally;
#[path = "exact_campaign/trial.rs"]
mod trial;

use std::sync::atomic::{AtomicU64, Ordering};

use bench_tests::solvers::REFERENCE_TOLERANCE;
use plant::{AxisParameters, Joint};
use tally::{KINDS, Tally};

/// Cases of the campaign.
const CASES: u64 = 2400;

fn as_it_is(_: &mut AxisParameters) {}

/// Counts over the cases of some seeds, on every core: each case has its own
/// stream of numbers, so that the split changes nothing.
fn campaign(seeds: core::ops::Range<u64>, spoil: fn(&mut AxisParameters), tolerance: f64) -> Tally {
    let next = AtomicU64::new(seeds.start);
    let work = || {
        let mut tally = Tally::default();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                return tally;
            }
            tally.add(Tally::of_case(seed, spoil, tolerance));
        }
    };
    let threads = std::thread::available_parallelism().map_or(2, usize::from);
    let mut total = Tally::default();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            total.add(worker.join().unwrap());
        }
    });
    total
}

#[test]
fn every_sample_agrees_with_dopri5() {
    let tally = campaign(0..CASES, as_it_is, REFERENCE_TOLERANCE);
    println!("{tally}");
    assert_eq!(tally.failed + tally.gave_up, 0, "{tally}");
    assert!(tally.excluded_share() < 0.01, "{tally}");
    assert!(tally.changes > 50_000, "{tally}");
    for (name, count) in KINDS.iter().zip(tally.kinds) {
        assert!(count >= 50, "only {count} times: {name}");
    }
}

/// The contrast: a gap wider by 1e-10 rad, a carriage heavier by a millionth
/// of itself and a reference at the tolerance of everyday runs all show.
#[test]
fn a_wrong_plant_or_a_loose_reference_shows() {
    let wider: fn(&mut AxisParameters) = |axis| {
        if let Joint::Elastic(joint) = &mut axis.transmission.joint {
            joint.backlash_half_rad += 1e-10;
        }
    };
    let heavier: fn(&mut AxisParameters) = |axis| axis.carriage.mass_kg *= 1.000_001;
    for (spoil, tolerance) in [
        (wider, REFERENCE_TOLERANCE),
        (heavier, REFERENCE_TOLERANCE),
        (as_it_is, 1e-7),
    ] {
        let tally = campaign(0..60, spoil, tolerance);
        assert!(tally.failed > tally.samples / 50, "{tally}");
    }
}
