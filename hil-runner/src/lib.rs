//! Runs the controller and the plant in lockstep and reports what came out.
//!
//! ```text
//! run file ──► Case ──► run ──► rows ──► trace (CSV)
//!                        │ └──► Outcome ──► summary (JSON), verdicts, report (HTML)
//!          controller ◄──┴──► plant
//! ```
//!
//! This crate is the only place that knows both the controller, in counts and
//! codes, and the plant, in SI units; [`link`] joins them.

pub mod bench;
pub mod budget;
pub mod case;
pub mod chip;
pub mod command_line;
pub mod digits;
pub mod error;
pub mod explain;
pub mod figures;
pub mod io;
pub mod ladder;
pub mod lanes;
pub mod law;
pub mod link;
pub mod message;
pub mod output;
mod parameters;
mod parameters_servo;
pub mod quantise;
pub mod record;
pub mod report;
mod report_chip;
pub mod report_data;
pub mod reservation;
pub mod rest;
pub mod run;
pub mod runfile;
pub mod servo;
pub mod study;
pub mod summary;
pub mod theory;
pub mod time;
pub mod timing;
pub mod trace;
pub mod words;
