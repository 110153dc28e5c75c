//! A log measured on a real axis, laid over the runs of a command.

use std::path::PathBuf;

use anyhow::{anyhow, bail};
use clap::Args;
use hil_core::case::Case;
use hil_core::measured::{LogDifference, MeasuredLog};
use hil_core::number;
use hil_runner::files::log_text;

use super::terminal;

// A documented structure would put its words into the help of every verb.
#[derive(Debug, Default, Args)]
pub(super) struct LogOption {
    /// Lay a measured log over the run: CSV with t_s and columns of the trace or the report
    #[arg(long, value_name = "F.csv")]
    pub(super) log: Option<PathBuf>,
    /// Seconds to add to the times of the log
    #[arg(long, value_name = "SECONDS", requires = "log", value_parser = seconds, allow_negative_numbers = true)]
    log_offset: Option<f64>,
}

/// An offset of the command line.
pub(super) fn seconds(words: &str) -> Result<f64, String> {
    let seconds = words.parse().ok().filter(|s: &f64| s.is_finite());
    seconds.ok_or_else(|| "a finite number of seconds is allowed".to_owned())
}

impl LogOption {
    /// Reads the log, of which at least one instant must lie within each run.
    pub(super) fn load<'c>(
        &self,
        cases: impl IntoIterator<Item = &'c Case>,
    ) -> anyhow::Result<Option<MeasuredLog>> {
        let Some(path) = &self.log else {
            return Ok(None);
        };
        let name = path.display().to_string();
        let text = log_text(path).map_err(|error| anyhow!("{name} cannot be read: {error}"))?;
        let log = MeasuredLog::parse(&name, &text, self.log_offset.unwrap_or(0.0))?;
        match cases.into_iter().find_map(|case| log.is_apart_from(case)) {
            Some(apart) => bail!("{apart}; --log-offset moves it"),
            None => Ok(Some(log)),
        }
    }

    /// Its words on the command line, option and value in turn.
    pub(super) fn words(&self) -> Vec<String> {
        let log = self.log.iter();
        let log = log.flat_map(|path| ["--log".to_owned(), path.display().to_string()]);
        let offset = self.log_offset.iter();
        let offset = offset.flat_map(|s| ["--log-offset".to_owned(), s.to_string()]);
        log.chain(offset).collect()
    }
}

/// The differences of runs to the log, and what was used of it.
pub(super) fn table<'n>(
    log: &MeasuredLog,
    names: impl IntoIterator<Item = &'n str>,
    differences: &[Vec<LogDifference>],
) -> String {
    let used: Vec<&str> = log.columns.iter().map(|column| column.name).collect();
    let (used, name) = (used.join(", "), &log.name);
    let mut text = format!("simulated less measured: {used} of {name}");
    if !log.ignored.is_empty() {
        text += &format!("\nignored: {}", log.ignored.join(", "));
    }
    let header = "run|column|instants|rms|largest|unit|at s".split('|');
    let row = |name: &str, difference: &LogDifference| {
        [
            terminal::short(name),
            difference.column.to_owned(),
            format!("{} of {}", difference.samples, log.t_s.len()),
            number::shown(difference.rms, None),
            number::shown(difference.largest, None),
            difference.unit.to_owned(),
            number::shown(difference.largest_at_s, None),
        ]
    };
    let each = names.into_iter().zip(differences);
    let rows = each.flat_map(|(name, of_run)| of_run.iter().map(move |own| row(name, own)));
    text + "\n" + &terminal::table(header, 2, rows)
}
