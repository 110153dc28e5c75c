//! The report: one HTML file that needs no network, drawn from plain data.
//!
//! A [`Report`](hil_core::report::Report) holds the contents of the page and
//! nothing else: no clock, no file, no simulation. [`render`] fills the
//! templates in `assets` with its serialised form, and the same report gives the
//! same bytes. Only the step time on the host depends on the machine, which is
//! why it is optional and the page shows it apart.
//!
//! ```
//! use hil_core::report::Report;
//! use hil_runner::report::render;
//!
//! let report = Report {
//!     title: "Servo bench".into(),
//!     command_line: "hil-runner".into(),
//!     generated_by: "hil-runner 0.1.0".into(),
//!     reserved: None,
//!     cases: Vec::new(),
//!     ladder: None,
//! };
//! assert!(render(&report)?.starts_with("<!doctype html>"));
//! # Ok::<(), hil_runner::report::ReportError>(())
//! ```
//!
//! # Contents of the file
//!
//! * Tables are plain HTML, legible with scripts switched off. They show five
//!   significant digits; each number carries its full value (`<data value>`).
//! * Plots are drawn by uPlot (`assets/uplot`, MIT, copied in unchanged) from
//!   the report as JSON in the page. Curves are rounded to
//!   [`PLOT_DIGITS`](hil_core::number::PLOT_DIGITS) significant digits, which no screen can tell from
//!   the original and which halves the file.
//! * A content security policy forbids every load, so that "no network" does
//!   not rest on our word.

mod page;
#[cfg(test)]
mod tests;

pub(crate) use page::environment;
pub use page::{ReportError, render};
