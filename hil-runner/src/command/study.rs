//! `hil-runner study`: one case over many values of its keys.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::{Args, Subcommand};
use hil_core::case::Law;
use hil_runner::study::results::{
    Origin, Progress, Results, ResultsError, Shard, merge, shards_in_order,
};
use hil_runner::study::{Changes, Study, Tally, columns, make, ready};
use indicatif::{ProgressBar, ProgressStyle};

use super::interrupt;
use super::study_end;
use super::study_row;
use super::terminal;

/// Run one case over many values of its keys
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Started again with the same folder, a study that was ended goes on; its results are those of \
                  a study that was not.\n\n\
                  Exit status: 0 all rows are there (and enough of them pass, where the study says how many must), \
                  1 too few pass, 2 the study could not be made or was interrupted.\n\n\
                  Examples:\n  \
                  hil-runner study --list\n  \
                  hil-runner study sample-time\n  \
                  hil-runner study backlash --base axis.toml --set controller.kp=4\n  \
                  hil-runner study --print tolerance > my-study.toml\n  \
                  hil-runner study my-study.toml --out results --threads 8\n  \
                  hil-runner study my-study.toml --shard 2/8 --out part-2\n  \
                  hil-runner study merge results part-1 part-2 part-3 part-4 part-5 part-6 part-7 part-8\n  \
                  hil-runner study results --row 17"
)]
pub(crate) struct StudyCommand {
    #[command(subcommand)]
    command: Option<StudySubcommand>,
    /// Study file, or a ready study (see --list); with --row a folder of results
    #[arg(value_name = "STUDY", required_unless_present = "list")]
    study: Option<String>,
    /// List the ready studies
    #[arg(long)]
    list: bool,
    /// Print the file of a ready study around its base, to start from
    #[arg(long, conflicts_with_all = ["list", "sets", "rungs", "out", "threads", "shard"])]
    print: bool,
    /// Case to study instead of the study's own: run file or built-in case
    #[arg(long, value_name = "CASE")]
    base: Option<String>,
    /// Override a key of the case in every run
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,
    /// Run every point on these rungs instead of the study's: continuous, sampled, quantised,
    /// firmware, separated by commas
    #[arg(long, value_name = "RUNG,…", value_delimiter = ',', value_parser = rung)]
    rungs: Option<Vec<Law>>,
    /// Folder of the results [default: out/study-NAME, with --base out/study-NAME-BASE]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads that compute, at most 1024 [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Make only part I of N of the rows, to be merged later
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Run row N of a folder of results (from 0) once more, with report and trace
    #[arg(long, value_name = "N",
          conflicts_with_all = ["list", "print", "base", "sets", "rungs", "out", "threads", "shard"])]
    row: Option<u64>,
    /// Page with the plots of the row [default: row-N.html in the folder]
    #[arg(long, value_name = "F.html", requires = "row")]
    report: Option<PathBuf>,
    /// Trace of the row as CSV [default: row-N.csv in the folder]
    #[arg(long, value_name = "F.csv", requires = "row")]
    trace: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum StudySubcommand {
    /// Put the shards of a study together
    Merge(Merge),
}

/// Put the shards of a study together
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  hil-runner study merge results part-1 part-2")]
struct Merge {
    /// Folder of the whole results
    out: PathBuf,
    /// Folders of all shards, in any order
    #[arg(required = true)]
    shards: Vec<PathBuf>,
}

impl StudyCommand {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        match (&self.command, &self.study) {
            (Some(StudySubcommand::Merge(merge)), _) => merge.execute(),
            (None, _) if self.list => {
                terminal::print(&list())?;
                Ok(true)
            }
            (None, Some(name)) if self.print => {
                if !ready::is_ready(name) {
                    bail!("{name} is no ready study; --list shows them");
                }
                terminal::print(&Study::text(name, &self.changes())?)?;
                Ok(true)
            }
            (None, Some(name)) => match self.row {
                Some(row) => study_row::execute(
                    Path::new(name),
                    row,
                    self.report.clone(),
                    self.trace.clone(),
                ),
                None => self.run(name),
            },
            (None, None) => bail!("give a study file or a ready study; --list shows them"),
        }
    }

    fn changes(&self) -> Changes {
        Changes {
            base: self.base.clone(),
            sets: self.sets.clone(),
            rungs: self.rungs.clone(),
            ..Changes::default()
        }
    }

    fn run(&self, name: &str) -> anyhow::Result<bool> {
        let changes = self.changes();
        let study = Study::load(name, &changes)?;
        let shard = self.shard.unwrap_or(Shard::WHOLE);
        let folder = self
            .out
            .clone()
            .unwrap_or_else(|| default_folder(&study, self.base.as_deref(), shard));
        let columns = columns(&study);
        let mut tally = Tally::new(&study, &columns);
        let origin = Origin::new(&study, shard, name, &changes);
        let command_line = origin.manifest.command_line(self.out.as_deref());
        let mut results = Results::open(&folder, &origin, &columns, &command_line, |row| {
            tally.add(row)
        })?;
        let threads = match self.threads {
            Some(threads) => usize::from(threads),
            None => std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get),
        };
        let progress = fill(&study, &mut results, &mut tally, threads, &command_line)?;
        let end = results.close()?;
        progress?;
        debug_assert_eq!(end.done, end.of);
        if shard != Shard::WHOLE {
            terminal::tell(&format!(
                "shard {shard} is complete: {} rows in {}\n",
                end.of,
                folder.display()
            ));
            return Ok(true);
        }
        study_end::finish(&study, &folder, &tally, &command_line)
    }
}

/// Makes the rows that are missing. The outer error is the folder's, the inner
/// one the user's who ended it.
fn fill(
    study: &Study,
    results: &mut Results,
    tally: &mut Tally,
    threads: usize,
    command_line: &str,
) -> anyhow::Result<anyhow::Result<()>> {
    let start = results.progress();
    if start.done > 0 {
        terminal::tell(&format!(
            "{}: {} of {} rows are there already\n",
            results.folder().display(),
            start.done,
            start.of
        ));
    }
    interrupt::watch_aloud(
        "ending after the runs under way; a second signal (Ctrl-C) ends at once, and loses nothing either\n",
    );
    let bar = bar(study, start);
    let blocks = results.missing_blocks();
    let outcome = make(study, blocks, threads, |block| {
        if let Err(error) = interrupt::check() {
            return ControlFlow::Break(Err(error));
        }
        block.rows.iter().for_each(|row| tally.add(row));
        match results.add(&block) {
            Ok(()) => {
                bar.set_position(results.progress().done);
                ControlFlow::Continue(())
            }
            Err(error) => ControlFlow::Break(Ok(error)),
        }
    });
    bar.finish_and_clear();
    match outcome? {
        ControlFlow::Continue(()) => Ok(Ok(())),
        ControlFlow::Break(Ok(error)) => Err(ResultsError::into(error)),
        ControlFlow::Break(Err(interrupted)) => Ok(Err(anyhow::anyhow!(
            "{interrupted}: {} of {} rows are in {}; to go on: {command_line}",
            results.progress().done,
            start.of,
            results.folder().display()
        ))),
    }
}

fn bar(study: &Study, start: Progress) -> ProgressBar {
    let bar = ProgressBar::new(start.of)
        .with_prefix(study.name.clone())
        .with_position(start.done);
    // A template that does not parse would leave the plain bar.
    if let Ok(style) = ProgressStyle::with_template(
        "{prefix}: {bar:30} {human_pos} of {human_len} runs, {per_sec}, {eta} left",
    ) {
        bar.set_style(style);
    }
    bar.reset_eta();
    bar
}

/// A rung of the command line.
fn rung(name: &str) -> Result<Law, String> {
    let known = || Law::ALL.map(Law::name).join(", ");
    Law::find(name).ok_or_else(|| format!("a rung is one of {}", known()))
}

/// `out/study-NAME`, of another base `out/study-NAME-BASE`.
fn default_folder(study: &Study, base: Option<&str>, shard: Shard) -> PathBuf {
    let mut name = format!("study-{}", study.name);
    if let Some(stem) = base.and_then(|base| Path::new(base).file_stem()) {
        name += &format!("-{}", stem.to_string_lossy());
    }
    if shard != Shard::WHOLE {
        let Shard { number, of } = shard;
        name += &format!("-{number}-of-{of}");
    }
    Path::new("out").join(name)
}

/// The ready studies, a line each.
fn list() -> String {
    let mut table = terminal::table(&["study", "rows", "rungs", "what it asks"], 1);
    for name in ready::names() {
        if let Ok(study) = Study::load(name, &Changes::default()) {
            let rungs: Vec<&str> = study.rungs.iter().map(|(law, _)| law.name()).collect();
            table.add_row([
                name.to_owned(),
                study.rows().to_string(),
                rungs.join(", "),
                study.title,
            ]);
        }
    }
    terminal::text(&table)
}

impl Merge {
    fn execute(&self) -> anyhow::Result<bool> {
        let shards = shards_in_order(&self.shards)?;
        let Some((folder, first)) = shards.first() else {
            bail!("give the folders of all shards");
        };
        let study = first.study(folder)?;
        let columns = columns(&study);
        let mut tally = Tally::new(&study, &columns);
        let command_line = first.whole().manifest.command_line(Some(&self.out));
        let done = merge(&self.out, &shards, &columns, &command_line, |row| {
            tally.add(row)
        })?;
        terminal::tell(&format!("{} rows in {}\n", done.of, self.out.display()));
        study_end::finish(&study, &self.out, &tally, &command_line)
    }
}
