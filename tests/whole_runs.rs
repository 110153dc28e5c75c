//! Whole random runs of the exact solver against `dopri5`.
//!
//! Two solvers can only agree on a run that rounding does not decide. An
//! undamped stiff joint amplifies the last bit at every impact, a loop that
//! does not settle at every sample, and a code that flips by one is a
//! disturbance of its own. Whether a run is of that kind is measured, not
//! guessed: the exact solver repeats it with the carriage's mass changed by
//! 1e-12 of itself. Runs that move by more than 1e-9 are counted apart, by what
//! they have in common.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::sync::atomic::{AtomicU64, Ordering};

use bench_tests::draw::Draw;
use bench_tests::random_case::random_case;
use bench_tests::rows;
use bench_tests::solvers::{FINER_TOLERANCE, REFERENCE_TOLERANCE, run_exactly, run_with_dopri5};
use hil_core::case::{Case, Law};
use hil_core::trace::Row;
use hil_runner::host::LinkKind;
use plant::{ContactChange, Joint};

const RUNS: u64 = 300;

/// Largest difference of two runs that agree, in units of a range.
const AGREEMENT: f64 = 1e-9;

/// Change of the mass that tells whether rounding decides.
const NUDGE: f64 = 1e-12;

/// Ranges below this are held to this (rad, rad/s, A).
const SMALLEST_RANGE: f64 = 1e-3;

/// Shorter samples from rest never leave the gap.
const SAMPLE_TIMES_S: (f64, f64) = (50e-6, 20e-3);

const QUANTITIES: [fn(&Row) -> f64; 5] = [
    |row| row.beta_rad,
    |row| row.beta_dot_radps,
    |row| row.gamma_rad,
    |row| row.gamma_dot_radps,
    |row| row.current_a,
];

struct Run {
    rows: Vec<Row>,
    changes: Vec<ContactChange>,
}

impl Run {
    fn of(case: &Case) -> Self {
        let (rows, outcome) = rows(case, LinkKind::InProcess);
        Self {
            rows,
            changes: outcome.contact_changes,
        }
    }

    /// Largest difference of a quantity in units of its range.
    fn distance(&self, other: &Self) -> f64 {
        assert_eq!(self.rows.len(), other.rows.len());
        let mut largest = 0.0_f64;
        for of in QUANTITIES {
            let values = self.rows.iter().map(of);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            });
            let range = (high - low).max(SMALLEST_RANGE);
            for (a, b) in self.rows.iter().zip(&other.rows) {
                largest = largest.max((of(a) - of(b)).abs() / range);
            }
        }
        largest
    }

    fn codes_differ(&self, other: &Self) -> bool {
        let whole = |row: &Row| row.sample.map(|sample| sample.dac_code.round());
        self.rows
            .iter()
            .zip(&other.rows)
            .any(|(a, b)| whole(a) != whole(b))
    }

    fn changes_differ(&self, other: &Self) -> bool {
        let order = |run: &Self| -> Vec<_> { run.changes.iter().map(|c| (c.from, c.to)).collect() };
        order(self) != order(other)
    }
}

/// Properties shared by the runs that cannot be compared.
const REASONS: [&str; 5] = [
    "undamped joint",
    "codes flip",
    "more than 20 contact changes",
    "other",
    "dopri5 itself moves with its tolerance",
];

#[derive(Debug, Default)]
struct Count {
    compared: u64,
    /// Runs for which the reference was repeated with a finer tolerance.
    finer: u64,
    changes: usize,
    apart: [u64; REASONS.len()],
    /// Largest difference of runs that are compared, and of their twins with
    /// another mass.
    worst: (f64, f64),
    faults: Vec<String>,
}

impl Count {
    fn add(&mut self, seed: u64) {
        let laws = Law::ALL;
        let case = random_case(&mut Draw::new(seed), &laws, SAMPLE_TIMES_S);
        let mut nudged = case.clone();
        nudged.axis.carriage.mass_kg *= 1.0 + NUDGE;
        let exact = Run::of(&run_exactly(&case));
        let twin = Run::of(&run_exactly(&nudged));
        let sway = exact.distance(&twin);
        // A NaN must not pass for agreement.
        if sway.is_nan() || sway > AGREEMENT {
            let damping = match case.axis.transmission.joint {
                Joint::Elastic(joint) => joint.damping_nms_per_rad,
                Joint::Rigid => 1.0,
            };
            let reason = if damping == 0.0 {
                0
            } else if case.controller.law >= Law::Quantised && exact.codes_differ(&twin) {
                1
            } else if exact.changes.len() > 20 {
                2
            } else {
                3
            };
            self.apart[reason] += 1;
            return;
        }
        let coarse = Run::of(&run_with_dopri5(&case, REFERENCE_TOLERANCE));
        let mut other = coarse;
        if exact.distance(&other) > AGREEMENT {
            let finer = Run::of(&run_with_dopri5(&case, FINER_TOLERANCE));
            self.finer += 1;
            if exact.distance(&finer) > AGREEMENT && finer.distance(&other) > AGREEMENT {
                self.apart[4] += 1;
                return;
            }
            other = finer;
        }
        let distance = exact.distance(&other);
        self.compared += 1;
        self.changes += exact.changes.len();
        self.worst = (self.worst.0.max(distance), self.worst.1.max(sway));
        if distance.is_nan() || distance > AGREEMENT || exact.changes_differ(&other) {
            self.faults.push(format!(
                "case {seed} ({}): off by {distance:.2e}, twin by {sway:.2e}, {} changes for {}",
                case.controller.law.name(),
                exact.changes.len(),
                other.changes.len()
            ));
        }
    }

    fn join(&mut self, other: Self) {
        self.compared += other.compared;
        self.finer += other.finer;
        self.changes += other.changes;
        for (mine, others) in self.apart.iter_mut().zip(other.apart) {
            *mine += others;
        }
        self.worst = (
            self.worst.0.max(other.worst.0),
            self.worst.1.max(other.worst.1),
        );
        self.faults.extend(other.faults);
    }
}

#[test]
fn whole_runs_agree_where_rounding_does_not_decide() {
    let next = AtomicU64::new(0);
    let work = || {
        let mut count = Count::default();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= RUNS {
                return count;
            }
            count.add(seed);
        }
    };
    let threads = std::thread::available_parallelism().map_or(2, usize::from);
    let mut total = Count::default();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            total.join(worker.join().unwrap());
        }
    });
    total.faults.sort();
    println!(
        "{} runs compared with {} contact changes, largest difference {:.2e} (twins {:.2e})",
        total.compared, total.changes, total.worst.0, total.worst.1
    );
    println!(
        "{:>4} times dopri5 was repeated with a finer tolerance",
        total.finer
    );
    for (reason, number) in REASONS.iter().zip(total.apart) {
        println!("{number:>4} not comparable: {reason}");
    }
    assert!(total.faults.is_empty(), "{:#?}", total.faults);
    // Nearly all runs can be compared, and some cannot: the twin has an effect.
    let apart: u64 = total.apart.iter().sum();
    assert_eq!(total.compared + apart, RUNS);
    assert!((1..=RUNS / 20).contains(&apart), "{apart} runs");
}

/// The contrast: a gap wider by a millionth of itself shows in most runs that
/// can be compared, and the comparison does not excuse it.
#[test]
fn a_wrong_gap_shows() {
    let shown = (0..40).filter(|&seed| {
        let case = random_case(&mut Draw::new(seed), &Law::ALL, SAMPLE_TIMES_S);
        let mut wider = case.clone();
        if let Joint::Elastic(joint) = &mut wider.axis.transmission.joint {
            joint.backlash_half_rad *= 1.000_001;
        }
        let run = Run::of(&run_exactly(&case));
        run.distance(&Run::of(&run_exactly(&wider))) > AGREEMENT
    });
    let shown = shown.count();
    assert!(shown >= 15, "{shown} of 40");
}
