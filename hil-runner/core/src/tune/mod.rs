//! Tuning: from a run file and what `[tune]` asks for to the setting that serves best.
//!
//! ```text
//! [tune] ──► settings ──► prepare ──► problem ◄──► search (cma) ──► archive: front, prices, …
//!                         start, corners   ▲
//!                                          └── runs, made by whoever has threads
//! ```

pub mod archive;
pub mod cma;
pub mod corners;
pub mod outcome;
pub mod prepare;
pub mod problem;
pub mod relay;
pub mod search;
pub mod start;
pub mod variable;
