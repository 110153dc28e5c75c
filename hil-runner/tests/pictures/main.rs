//! Pictures of studies: their specifications, held against Vega-Lite's grammar and
//! against the rows that they show.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![allow(clippy::panic, reason = "a test that cannot go on has failed")]

mod check;
mod grammar;
mod keys;
mod kinds;
mod mistakes;
mod rows;
mod samples;
#[path = "../table/mod.rs"]
mod table;
mod tables;
