//! Shared helpers of the cross-crate tests.

use std::path::{Path, PathBuf};

use hil_runner::case::Case;
use hil_runner::run::{LinkKind, Outcome, RunOptions, run};
use hil_runner::runfile;
use hil_runner::trace::Row;

/// Folder with the reference runs.
pub fn reference_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference")
}

/// A case by name or path, with overrides as on the command line.
///
/// # Panics
/// If the case cannot be read: a test cannot go on then.
#[allow(clippy::panic, reason = "a test without its case has failed")]
pub fn case(name_or_path: &str, sets: &[&str]) -> Case {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    match runfile::load(name_or_path, &sets) {
        Ok(case) => case,
        Err(errors) => panic!("{errors}"),
    }
}

/// Runs a case and keeps its rows.
///
/// # Panics
/// If the run cannot be made.
#[allow(clippy::panic, reason = "a test without its run has failed")]
pub fn rows(case: &Case, link: LinkKind) -> (Vec<Row>, Outcome) {
    let mut rows = Vec::new();
    let options = RunOptions {
        link,
        ..RunOptions::default()
    };
    let result = run(case, options, &mut |row| {
        rows.push(*row);
        Ok(())
    });
    match result {
        Ok(outcome) => (rows, outcome),
        Err(error) => panic!("{}: {error}", case.name),
    }
}
