//! Works W1 to W3 against runs in quadruple precision: simulation 2 of the
//! paper on rung `sampled` at 1 ms and at 0.1 ms, and on `continuous`.
//!
//! The error of a component is its largest difference over the samples in
//! units of its largest magnitude, the truth's own rows being the samples.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use bench_tests::solvers::{run_exactly, run_with_rk4};
use bench_tests::{case, reference_folder, rows};
use hil_core::case::Case;
use hil_core::trace::Row;
use hil_runner::host::LinkKind;

/// Columns of the truth and the same quantity of a row.
type Column = (&'static str, fn(&Row) -> f64);

const COLUMNS: [Column; 6] = [
    ("beta_rad", |row| row.beta_rad),
    ("beta_dot_radps", |row| row.beta_dot_radps),
    ("gamma_rad", |row| row.gamma_rad),
    ("gamma_dot_radps", |row| row.gamma_dot_radps),
    ("current_a", |row| row.current_a),
    // Printed, not judged: a hundred radians are subtracted from a hundred,
    // and at 0.1 ms the law's derivative makes 0.2 nV of the last bit of β.
    ("gap_rad", |row| row.beta_rad - row.gamma_rad),
];

/// Works with what their error may be.
const WORKS: [(&str, &[&str], f64); 3] = [
    ("w1", &["controller.law=sampled"], 1e-10),
    (
        "w2",
        &["controller.law=sampled", "controller.sample_time_s=1e-4"],
        1e-10,
    ),
    ("w3", &["controller.law=continuous"], 1e-11),
];

/// Error of every component of a run.
fn errors(work: &str, case: &Case) -> [f64; 6] {
    let path = reference_folder().join(format!("truth-{work}.csv"));
    let mut reader = csv::Reader::from_path(path).unwrap();
    let header = reader.headers().unwrap().clone();
    let (rows, _) = rows(case, LinkKind::InProcess);
    let (mut off, mut largest) = ([0.0_f64; 6], [0.0_f64; 6]);
    let mut found = rows.iter();
    let mut number = 0;
    for record in reader.records() {
        let record = record.unwrap();
        let value = |name: &str| -> f64 {
            let index = header.iter().position(|column| column == name).unwrap();
            record[index].parse().unwrap()
        };
        let t_s = value("t_s");
        let row = found.find(|row| (row.t_s - t_s).abs() < 1e-9).unwrap();
        for (i, (name, of)) in COLUMNS.iter().enumerate() {
            off[i] = off[i].max((of(row) - value(name)).abs());
            largest[i] = largest[i].max(value(name).abs());
        }
        number += 1;
    }
    assert_eq!(number, 1501, "{work}");
    core::array::from_fn(|i| off[i] / largest[i])
}

/// Largest error of a state that a row has.
fn worst(errors: [f64; 6]) -> f64 {
    let judged = errors.into_iter().take(5);
    // `max` would hide a NaN.
    judged.fold(
        0.0,
        |worst, error| if error <= worst { worst } else { error },
    )
}

#[test]
fn works_agree_with_quadruple_precision() {
    for (work, sets, allowed) in WORKS {
        let errors = errors(work, &run_exactly(&case("paper-2", sets)));
        let named = COLUMNS.iter().zip(errors);
        let words: Vec<_> = named
            .map(|((name, _), e)| format!("{name} {e:.1e}"))
            .collect();
        println!("{work}: {}", words.join(", "));
        assert!(worst(errors) <= allowed, "{work}: {errors:?}");
    }
}

/// The contrast: the measure sees a gap that is wider by 1e-9 rad, and the
/// paper's own fixed steps.
#[test]
fn a_wrong_plant_or_solver_shows() {
    for (work, sets, allowed) in WORKS {
        let wider = format!(
            "transmission.backlash_half_deg={}",
            3.0 + 1e-9_f64.to_degrees()
        );
        let sets = [sets, &[wider.as_str()]].concat();
        let errors_wider = errors(work, &run_exactly(&case("paper-2", &sets)));
        assert!(worst(errors_wider) > allowed, "{work}: {errors_wider:?}");
        let errors_fixed = errors(
            work,
            &run_with_rk4(&case("paper-2", &sets[..sets.len() - 1])),
        );
        assert!(
            worst(errors_fixed) > 1e3 * allowed,
            "{work}: {errors_fixed:?}"
        );
    }
}
