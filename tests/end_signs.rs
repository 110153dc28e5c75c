//! Contacts missed by a solver that looks for them at the samples' ends only:
//! the reason for locating crossings within the sample.
//!
//! The draws are the first 300 of work W4: simulation 2 of the paper on
//! rung `quantised` at 1 ms, with random b in \[0, 4\]°, K_p in \[1, 6\] and K_d
//! in \[0, 0.1\].

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use bench_tests::solvers::run_exactly;
use bench_tests::{case, reference_folder, rows};
use hil_core::case::Case;
use hil_runner::host::LinkKind;
use plant::Joint;

/// The draws as cases.
fn draws() -> Vec<Case> {
    let template = run_exactly(&case("paper-2", &["controller.law=quantised"]));
    let path = reference_folder().join("w4-first-300.csv");
    let mut reader = csv::Reader::from_path(path).unwrap();
    let records = reader.deserialize::<(f64, f64, f64)>();
    let cases = records.map(|record| {
        let (backlash_half_rad, kp, kd_s) = record.unwrap();
        let mut case = template.clone();
        let Joint::Elastic(joint) = &mut case.axis.transmission.joint else {
            panic!("the paper's joint is elastic");
        };
        joint.backlash_half_rad = backlash_half_rad;
        (case.controller.gains.kp, case.controller.gains.kd_s) = (kp, kd_s);
        case
    });
    cases.collect()
}

/// Contact changes of a run, and those that its rows show.
fn changes_and_seen(case: &Case) -> (usize, usize) {
    let (rows, outcome) = rows(case, LinkKind::InProcess);
    let steps = rows.windows(2).map(|pair| {
        let step = pair[0].contact.abs_diff(pair[1].contact);
        usize::from(step)
    });
    (outcome.contact_changes.len(), steps.sum())
}

#[test]
fn the_ends_of_the_samples_miss_contacts() {
    let (mut changes, mut seen, mut runs) = (0, 0, 0);
    let draws = draws();
    assert_eq!(draws.len(), 300);
    for case in &draws {
        let (all, some) = changes_and_seen(case);
        assert!(some <= all && (all - some) % 2 == 0, "{some} of {all}");
        changes += all;
        seen += some;
        runs += usize::from(some < all);
    }
    println!("{seen} of {changes} changes are seen; {runs} of 300 runs have hidden ones");
    // About a third of all 10,000 draws; three standard deviations of 300 are
    // 8 %.
    assert!((75..=125).contains(&runs), "{runs} runs");
    assert!(changes - seen >= 2 * runs);
}

/// The contrast: at a sample time of 1 µs both counts agree, so that what
/// the rows do not show at 1 ms is the sampling and nothing else.
#[test]
fn short_samples_hide_nothing() {
    let draws = draws();
    let hidden = draws.iter().find(|case| {
        let (all, seen) = changes_and_seen(case);
        seen < all
    });
    let mut case = hidden.unwrap().clone();
    // Rows of `continuous` are free of the sample time.
    case.controller.law = hil_core::case::Law::Continuous;
    case.run.duration_ns = 200_000_000;
    case.run.row_interval_ns = 500;
    let (all, seen) = changes_and_seen(&case);
    assert!(all > 0);
    assert_eq!(all, seen);
}
