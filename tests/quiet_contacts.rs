//! Neither rounding nor the solver's error may count as contacts as the joint's
//! torque dies away. The numbers of changes are those of an
//! independent program in extended precision.

use bench_tests::{case, rows};
use hil_runner::host::LinkKind;

/// Contact changes and impacts of a case in `tests/cases`.
fn contacts(name: &str, sets: &[&str]) -> (u64, u64) {
    let path = format!("{}/cases/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let (_, outcome) = rows(&case(&path, sets), LinkKind::InProcess);
    (outcome.summary.contact_changes, outcome.summary.impacts)
}

#[test]
fn an_axis_at_rest_on_friction_is_quiet() {
    assert_eq!(contacts("rest-on-friction", &[]), (5, 3));
    let mirrored = ["motion.travel_mm=58.8"];
    assert_eq!(contacts("rest-on-friction", &mirrored), (7, 3));
}

#[test]
fn an_axis_that_cruises_is_quiet() {
    assert_eq!(contacts("free-cruise", &[]), (1, 1));
}

/// Rounding of the current, 2e-15 A, once let go of the load 83 ms early.
#[test]
fn an_axis_at_its_limit_keeps_its_load() {
    let file = format!("{}/cases/run-up.toml", env!("CARGO_MANIFEST_DIR"));
    let let_go_s = |solver: &str| {
        let solver = format!("run.solver={solver}");
        let (_, outcome) = rows(&case(&file, &[&solver]), LinkKind::InProcess);
        outcome.summary.events.unwrap()[1].0
    };
    let (exact_s, dopri5_s) = (let_go_s("exact"), let_go_s("dopri5"));
    assert!((exact_s - 1.06967).abs() < 1e-6, "{exact_s}");
    assert!((dopri5_s - exact_s).abs() < 1e-6, "{dopri5_s} {exact_s}");
}

/// The contrast: real contacts are not swallowed, however narrow the gap.
#[test]
fn real_contacts_are_counted() {
    let narrow = ["transmission.backlash_half_deg=6e-14"];
    let (changes, impacts) = contacts("free-cruise", &narrow);
    assert!(changes >= 1 && impacts >= 1);
    let rattling = ["drive.amplifier_gain=3.0"];
    assert!(contacts("free-cruise", &rattling).0 > 10);
}
