//! docs/LINE.md says what the line is: its numbers are those of the program, and
//! the session that it shows is one of [`Server`], byte by byte.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test stops where its setup fails"
)]

#[path = "line_page/dump.rs"]
mod dump;
#[path = "line_page/session.rs"]
mod session;
#[path = "line_page/tables.rs"]
mod tables;

const PAGE: &str = include_str!("../../../docs/LINE.md");

/// The lines below a heading, up to the next one.
fn section<'p>(page: &'p str, heading: &str) -> &'p str {
    let (_, rest) = page
        .split_once(&format!("\n{heading}\n"))
        .unwrap_or_else(|| panic!("docs/LINE.md has no {heading}"));
    rest.split_once("\n## ").map_or(rest, |(front, _)| front)
}
