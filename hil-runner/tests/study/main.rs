//! `hil-runner study`: what its rows are, that nothing of them gets lost, and
//! what it says to bad input.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

mod any_axis;
mod around_base;
mod bad_input;
#[path = "../pictures/check.rs"]
mod check;
mod origin;
mod parquet;
mod ready;
mod repeat;
mod resume;
mod row;
mod rows;
mod schema;
mod shards;
mod support;
#[path = "../table/mod.rs"]
mod table;
