//! Runs the controller and the plant in lockstep and tells what came out.
//!
//! ```text
//! run file ──► Case ──► run ──► rows ──► trace (CSV)
//!                        │ └──► Outcome ──► summary, verdicts, report's data
//!          controller ◄──┴──► plant
//! ```
//!
//! This crate is the only place that knows both the controller, in counts and
//! codes, and the plant, in SI units; [`message`] joins them. It opens no file,
//! starts no thread or process and reads no clock, so that it runs in a page as
//! on a command line; whoever calls it brings those.
//!
//! ```
//! use hil_core::{run, runfile};
//!
//! let case = runfile::builtin("paper-2", &["controller.law=sampled".to_owned()])?;
//! let mut rows = 0;
//! let outcome = run::run(&case, run::RunOptions::default(), &mut |_row| {
//!     rows += 1;
//!     Ok(())
//! })?;
//! assert_eq!(rows, 1_501);
//! assert!(outcome.summary.verdicts.iter().all(|verdict| verdict.pass));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod budget;
pub mod case;
pub mod chip_cost;
pub mod controllers;
mod demand;
pub mod distribution;
pub mod error;
mod feed_forward;
pub mod figures;
pub mod io;
pub mod ladder;
#[cfg(feature = "lanes")]
pub mod lanes;
mod lockstep;
pub mod measured;
pub mod message;
pub mod number;
pub mod options;
pub mod quantise;
pub mod record;
pub mod remarks;
pub mod report;
pub mod requests;
pub mod reservation;
pub mod rest;
pub mod run;
pub mod runfile;
pub mod scaling;
pub mod summary;
pub mod theory;
pub mod trace;
pub mod tune;
