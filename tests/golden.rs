//! Summaries of the five built-in cases, to the last digit. The plant and the
//! controller give the same bits on every machine, so any difference is a
//! change of behaviour.
//!
//! `BLESS=1 cargo test -p bench-tests --test golden` rewrites the files after
//! an intended change; with `CI` set it refuses.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use bench_tests::{case, rows};
use hil_core::runfile::builtin_names;
use hil_runner::host::LinkKind;

fn summary(name: &str, sets: &[&str]) -> String {
    let (_, outcome) = rows(&case(name, sets), LinkKind::InProcess);
    serde_json::to_string_pretty(&outcome.summary).unwrap() + "\n"
}

#[test]
fn summaries_of_the_built_in_cases() {
    let bless = std::env::var_os("BLESS").is_some();
    assert!(
        !(bless && std::env::var_os("CI").is_some()),
        "golden files are not rewritten in CI"
    );
    for name in builtin_names() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("golden/{name}.json"));
        let summary = summary(name, &[]);
        if bless {
            std::fs::write(&file, &summary).unwrap();
        }
        let golden = std::fs::read_to_string(&file).unwrap();
        assert!(
            summary == golden,
            "{name} differs from {}:\n{summary}",
            file.display()
        );
    }
}

/// The contrast: a micrometre of travel shows.
#[test]
fn another_travel_gives_another_summary() {
    let found = summary("paper-2", &["motion.travel_mm=250.001"]);
    assert_ne!(found, summary("paper-2", &[]));
}
