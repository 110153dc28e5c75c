//! The run file: what it accepts, and what it says about the rest.

#![allow(
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test that cannot go on has failed"
)]

mod acts;
mod cases;
mod document;
mod every_key;
mod fields;
mod fuzz;
mod json_schema;
mod motion;
mod options;
mod overrides;
mod sentences;
mod templates;
mod ways;
mod written;

use hil_core::case::Case;
use hil_core::runfile::{self, RunFile};

/// A run file in which every required key is given, one a line.
pub(crate) const BASE: &str = include_str!("base.toml");

/// [`BASE`] with one piece of text replaced; the piece must be there once.
pub(crate) fn base_with(from: &str, to: &str) -> String {
    assert_eq!(BASE.matches(from).count(), 1, "{from:?} in the base");
    BASE.replace(from, to)
}

/// The lines printed for the run file named `x.toml`; empty if it is right.
pub(crate) fn messages(text: &str, sets: &[&str]) -> Vec<String> {
    match parse(text, sets) {
        Ok(_) => Vec::new(),
        Err(errors) => errors.to_string().lines().map(str::to_owned).collect(),
    }
}

pub(crate) fn parse(text: &str, sets: &[&str]) -> Result<Case, runfile::RunFileErrors> {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    RunFile::parse("cases/x.toml", text, &sets, profile).map(|file| file.case)
}

/// Profiles beside the run file.
fn profile(run_file: &str, path: &str) -> Result<String, String> {
    assert_eq!(run_file, "cases/x.toml");
    let last = match path {
        "one" => "2,2",
        "three" => return Err(format!("there is no {path}")),
        "blank" => "\n\n1,2",
        _ => "2,3.5",
    };
    Ok(format!("t_s,x_mm\n0,0\n1,0.5\n{last}\n"))
}
