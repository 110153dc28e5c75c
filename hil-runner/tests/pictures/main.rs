//! Pictures of studies, read back from their SVG.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![allow(clippy::panic, reason = "a test that cannot go on has failed")]

mod keys;
mod lines;
mod map;
mod mistakes;
mod others;
mod rules;
mod samples;
mod sheet;
#[path = "../table/mod.rs"]
mod table;
mod tables;
