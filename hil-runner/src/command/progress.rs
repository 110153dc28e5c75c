//! Progress of a long run on the terminal; silent where stderr is none.

use std::io;

use hil_core::case::Case;
use hil_core::time::seconds;
use hil_core::trace::Row;
use indicatif::{ProgressBar, ProgressStyle};

use super::interrupt;

/// Rows between two looks at the bar: a look costs more than a sample.
const ROWS_A_LOOK: u32 = 256;

/// Follows a run by its rows; gone when dropped.
#[derive(Debug)]
pub(super) struct Progress {
    bar: ProgressBar,
    rows: u32,
}

impl Progress {
    pub(super) fn of(case: &Case) -> Self {
        Self::labelled(case, &case.name)
    }

    /// The same under another name than that of the case.
    pub(super) fn labelled(case: &Case, label: &str) -> Self {
        let microseconds = case.run.duration_ns / 1000;
        Self::new(
            label,
            microseconds,
            "{prefix}: {bar:30} t = {msg} s, {eta} left",
        )
    }

    /// Follows so many rows that are no rows of a run.
    pub(super) fn of_rows(label: &str, rows: u64) -> Self {
        Self::new(label, rows, "{prefix}: {bar:30} {pos} rows, {eta} left")
    }

    fn new(label: &str, length: u64, template: &str) -> Self {
        interrupt::watch();
        let bar = ProgressBar::new(length).with_prefix(label.to_owned());
        // A template that does not parse would leave the plain bar.
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self { bar, rows: 0 }
    }

    /// A row was computed.
    ///
    /// # Errors
    /// If the run was interrupted.
    pub(super) fn row(&mut self, row: &Row) -> io::Result<()> {
        self.rows += 1;
        if self.rows.is_multiple_of(ROWS_A_LOOK) {
            let share = row.t_s / seconds(1000);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a time of the run in whole microseconds"
            )]
            self.bar.set_position(share as u64);
            self.bar.set_message(format!("{:.3}", row.t_s));
        }
        interrupt::check()
    }

    /// One of the rows that are no rows of a run.
    ///
    /// # Errors
    /// If the program was interrupted.
    pub(super) fn one(&mut self) -> io::Result<()> {
        self.rows += 1;
        if self.rows.is_multiple_of(ROWS_A_LOOK) {
            self.bar.set_position(self.rows.into());
        }
        interrupt::check()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
