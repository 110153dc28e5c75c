//! The controller at the other end of a line: the same codes, whatever the
//! line does.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test stops where its setup fails"
)]

mod budgets;
mod campaign;
mod certify;
#[cfg(unix)]
mod command;
#[cfg(unix)]
mod command_budget;
mod delay;
#[cfg(unix)]
mod flips;
mod judged;
#[cfg(unix)]
mod line_client;
mod loopback;
mod noise;
mod same_codes;
#[path = "../chip_lines/targets.rs"]
mod targets;
mod vectors;
mod versions;
