//! docs/OUTPUTS.md names every column of a trace and every key of a summary,
//! in their order, and nothing else.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::process::Command;

const PAGE: &str = include_str!("../../docs/OUTPUTS.md");

/// The names in the first column of the table below a heading.
fn documented(page: &str, heading: &str) -> Vec<String> {
    let section = page.split("\n## ").find(|s| s.starts_with(heading));
    let rows = section.unwrap_or_default().lines();
    rows.filter_map(|row| row.strip_prefix("| `")?.split('`').next())
        .map(str::to_owned)
        .collect()
}

/// Standard output of `hil-runner run paper-1`.
fn output(option: &str) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(["run", "paper-1", option, "-"])
        .output()
        .unwrap();
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_page_names_every_column() {
    let trace = output("--trace");
    let columns: Vec<&str> = trace.lines().next().unwrap().split(',').collect();
    assert_eq!(documented(PAGE, "Trace"), columns);
}

#[test]
fn the_page_names_every_key() {
    let summary: serde_json::Value = serde_json::from_str(&output("--summary")).unwrap();
    let keys: Vec<&String> = summary.as_object().unwrap().keys().collect();
    assert_eq!(documented(PAGE, "Summary").iter().collect::<Vec<_>>(), keys);
}

#[test]
fn the_page_names_every_column_of_a_log() {
    let (_, section) = PAGE
        .split_once("### A measured log (`--log F.csv`)")
        .unwrap();
    let (list, _) = section.split_once("any order").unwrap();
    let named: Vec<&str> = list.split('`').skip(1).step_by(2).collect();
    let columns = hil_core::measured::COLUMNS.iter().map(|column| column.name);
    let known: Vec<&str> = ["run", "ladder", "t_s"]
        .into_iter()
        .chain(columns)
        .collect();
    assert_eq!(named, known);
}

/// The contrast: a row that is missing is missed.
#[test]
fn a_missing_row_is_missed() {
    let shorter = PAGE.replace("| `contact` |", "| contact |");
    let found = documented(&shorter, "Trace").len() + 1;
    assert_eq!(found, documented(PAGE, "Trace").len());
}
