//! `hil-runner study`: one case over many values of its keys.

use std::collections::BTreeMap;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use clap::{Args, Subcommand};
use hil_core::case::Law;
use hil_core::lanes::OneByOne;
use hil_core::number;
use hil_core::runfile::RunFile;
use hil_runner::files::{OutputFile, profile, same_file};
use hil_runner::live::{Live, LiveCase};
use hil_runner::study::results::{Origin, Progress, Results, Shard, merge, shards_in_order};
use hil_runner::study::{
    Changes, MOST_ROWS, Study, Tally, base_sentences, best_table, columns, enough_pass,
    figure_rows, make, ready, render, specify, unstable_words,
};

use plant::Course;
use serde_json::{Value, json};

use super::options::{Sets, live_if, warn};
use super::run::Run;
use super::schema::SchemaOf;
use super::terminal::{self, check_signals, say, tell, watch_signals};

/// Run one case over many values of its keys
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = include_str!("help/study.txt").trim_ascii_end()
)]
pub(crate) struct StudyCommand {
    #[command(subcommand)]
    command: Option<StudySubcommand>,
    /// Study file, or a ready study (see --list); with --row a folder of results
    #[arg(value_name = "STUDY", required_unless_present = "list")]
    study: Option<String>,
    /// List the ready studies
    #[arg(long, conflicts_with_all = ["study", "base", "sets", "rungs", "out", "threads", "shard"])]
    list: bool,
    /// Print the list of --list as JSON
    #[arg(long, requires = "list", conflicts_with = "study")]
    json: bool,
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
    /// Carry the simulator in the report: a click on a row of a picture opens that run
    #[arg(long, conflicts_with_all = ["list", "print", "shard", "row"])]
    live: bool,
    /// Run row N of a folder of results (from 0) once more, with report and trace
    #[arg(long, value_name = "N",
          conflicts_with_all = ["list", "print", "base", "sets", "rungs", "out", "threads", "shard"])]
    row: Option<u64>,
    /// Page with the plots of the row [default: row-N.html in the folder]
    #[arg(long, value_name = "F.html", requires = "row")]
    report: Option<PathBuf>,
    /// Trace of the row as CSV, or as Parquet [default: row-N.csv in the folder]
    #[arg(long, value_name = "F.csv", requires = "row")]
    trace: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum StudySubcommand {
    /// Put the shards of a study together
    #[command(
        after_help = "Examples:\n  hil-runner study merge results part-1 part-2\n  hil-runner study merge --live results part-1 part-2"
    )]
    Merge {
        /// Folder of the whole results
        out: PathBuf,
        /// Folders of all shards, in any order
        #[arg(required = true)]
        shards: Vec<PathBuf>,
        /// Carry the simulator in the report: a click on a row of a picture opens that run
        #[arg(long)]
        live: bool,
    },
}

impl StudyCommand {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        match (&self.command, &self.study) {
            (Some(StudySubcommand::Merge { out, shards, live }), _) => join(out, shards, *live),
            (None, _) if self.list => {
                let studies = ready::names()
                    .map(|name| Study::load(name, &Changes::default()))
                    .collect::<Result<Vec<_>, _>>()?;
                match self.json {
                    true => terminal::print_json(&json_of(&studies))?,
                    false => terminal::print(&list(&studies))?,
                }
                Ok(true)
            }
            (None, Some(name)) if self.print => {
                if !ready::is_ready(name) {
                    bail!("{name} is no ready study; --list shows them");
                }
                let text = Study::text(name, &self.changes())?;
                say!("{}{text}", SchemaOf::Study.line())?;
                Ok(true)
            }
            (None, Some(name)) => match self.row {
                Some(row) => self.make_row(Path::new(name), row),
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
        let usual = || default_folder(&study, self.base.as_deref(), shard);
        let folder = self.out.clone().unwrap_or_else(usual);
        let columns = columns(&study);
        let mut tally = Tally::new(&study, &columns);
        let live = live_of(&study, self.live)?;
        let origin = Origin::new(&study, shard, name, &changes);
        let command_line = origin.command_line(self.out.as_deref());
        let mut results = Results::open(&folder, &origin, &columns, &command_line, |row| {
            tally.add(row)
        })?;
        let cores = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        let threads = self.threads.map_or_else(cores, usize::from);
        let is_complete = fill(&study, &mut results, &mut tally, threads)?;
        let Progress { done, of } = results.close()?;
        let place = folder.display();
        if !is_complete {
            bail!("interrupted: {done} of {of} rows are in {place}; to go on: {command_line}");
        }
        if shard != Shard::WHOLE {
            tell!("shard {shard} is complete: {of} rows in {place}\n");
            return Ok(true);
        }
        finish(&study, &folder, &tally, &command_line, live)
    }

    /// Runs one row of a folder of results from what lies there alone. Makes its
    /// report and trace, beside the results unless a path is given;
    /// whether the run passes.
    fn make_row(&self, folder: &Path, number: u64) -> anyhow::Result<bool> {
        let origin = Origin::read(folder)?;
        let study = origin.study(folder)?;
        let (name, rows) = (&study.name, study.rows());
        if number >= rows {
            let last = rows - 1;
            bail!("row {number} is not allowed: the rows of study {name} are 0 to {last}");
        }
        let row = study.planned_row(number);
        if let Err((status, reason)) = row.case {
            let status = status.name();
            bail!("row {number} of study {name} is {status}: {reason}");
        }
        let mut sets = study.row_sets(&row.point, row.rung);
        sets.push(format!("name={name} row {number}"));
        let beside = |extension: &str| folder.join(format!("row-{number}.{extension}"));
        let report = self.report.clone().unwrap_or_else(|| beside("html"));
        let trace = self.trace.clone().unwrap_or_else(|| beside("csv"));
        refuse_results(folder, &[&report, &trace])?;
        let (page, rows) = (report.display(), trace.display());
        let written = format!("plots and all figures: {page}\ntrace: {rows}\n");
        let template = study.template();
        let base = match template.base().motion.course() {
            // Its points lie beside the first base.
            Course::Profile(_) => template.source_name().to_owned(),
            _ => folder.join("base.toml").to_string_lossy().into_owned(),
        };
        let file = RunFile::parse(&base, &origin.base_text, &sets, profile)?;
        let run = Run::of_row(base, Sets { sets }, report, trace);
        let passes = run.make(Ok(vec![file]), None, "")?;
        let again = format!("the same run: {}\n", run.command_line());
        terminal::print_beside(&run.outputs(), &(written + &again))?;
        Ok(passes)
    }
}

/// Makes the rows that are missing; false if the user has ended it.
fn fill(
    study: &Study,
    results: &mut Results,
    tally: &mut Tally,
    threads: usize,
) -> anyhow::Result<bool> {
    let Progress { done, of } = results.progress();
    if done > 0 {
        let folder = results.folder().display();
        tell!("{folder}: {done} of {of} rows are there already\n");
    }
    watch_signals(
        "ending after the runs under way; a second signal (Ctrl-C) ends at once, and loses nothing either\n",
    );
    let template = "{prefix}: {bar:30} {human_pos} of {human_len} runs, {per_sec}, {eta} left";
    let bar = terminal::bar(&study.name, of, template).with_position(done);
    bar.reset_eta();
    let start = Instant::now();
    let mut one_by_one = BTreeMap::new();
    let made = make(study, results.missing_blocks(), threads, |block| {
        if check_signals().is_err() {
            return Ok(false);
        }
        block.rows.iter().for_each(|row| tally.add(row));
        results.add(&block)?;
        for (why, runs) in block.one_by_one {
            *one_by_one.entry(why).or_default() += runs;
        }
        bar.set_position(results.progress().done);
        Ok(true)
    });
    bar.finish_and_clear();
    let taken_s = start.elapsed().as_secs_f64();
    let runs = results.progress().done - done;
    if runs > 0 {
        let (rate, alone) = (runs as f64 / taken_s, by_themselves(&one_by_one));
        tell!("{runs} runs in {taken_s:.1} s{alone}, {rate:.0} runs/s\n");
    }
    made
}

/// How many runs were not made side by side with others, and why; nothing if all were.
fn by_themselves(one_by_one: &BTreeMap<OneByOne, u64>) -> String {
    let reason = |(why, runs): (&OneByOne, &u64)| format!("{runs} for {why}");
    let reasons: Vec<String> = one_by_one.iter().map(reason).collect();
    match one_by_one.values().sum::<u64>() {
        0 => String::new(),
        all => format!(", {all} of them one by one ({})", reasons.join(", ")),
    }
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
fn list(studies: &[Study]) -> String {
    let rows = studies.iter().map(|study| {
        let (rows, rungs) = (study.rows().to_string(), study.rung_names());
        [study.name.clone(), rows, rungs, study.title.clone()]
    });
    terminal::table(["study", "rows", "rungs", "what it asks"], 1, rows)
}

/// The same as JSON.
fn json_of(studies: &[Study]) -> Value {
    let study = |study: &Study| {
        let rungs = study.rungs.iter().map(|(law, _)| law.name());
        json!({
            "name": study.name,
            "title": study.title,
            "description": study.description,
            "rows": study.rows(),
            "rungs": rungs.collect::<Vec<_>>(),
        })
    };
    studies.iter().map(study).collect()
}

/// Puts the shards of a study together.
fn join(out: &Path, shards: &[PathBuf], is_live: bool) -> anyhow::Result<bool> {
    let shards = shards_in_order(shards)?;
    let Some((folder, first)) = shards.first() else {
        bail!("give the folders of all shards");
    };
    let study = first.study(folder)?;
    let live = live_of(&study, is_live)?;
    let columns = columns(&study);
    let mut tally = Tally::new(&study, &columns);
    let command_line = first.whole().command_line(Some(out));
    let add = |row: &_| tally.add(row);
    let done = merge(out, &shards, &columns, &command_line, add)?;
    tell!("{} rows in {}\n", done.of, out.display());
    finish(&study, out, &tally, &command_line, live)
}

/// The simulator of a study's base for its report, where it is asked for.
fn live_of(study: &Study, is_asked: bool) -> anyhow::Result<Option<Live>> {
    let template = study.template();
    let (file, text) = (template.source_name(), template.text());
    live_if(is_asked, || Ok(LiveCase::new(file, text, &study.sets)?))
}

/// Prints the table, writes pictures and report; whether enough runs pass.
fn finish(
    study: &Study,
    folder: &Path,
    tally: &Tally,
    command_line: &str,
    live: Option<Live>,
) -> anyhow::Result<bool> {
    let sentences = base_sentences(study).into_iter();
    let sentences: String = sentences.map(|sentence| sentence + "\n").collect();
    terminal::print(&(sentences + &table(tally)))?;
    warn(&study.name, study.warnings());
    let pictures = specify(study, &tally.pictures);
    if study.rows() > MOST_ROWS && !pictures.is_empty() {
        tell!("the pictures show the first {MOST_ROWS} rows\n");
    }
    for drawn in &pictures {
        let path = folder.join(format!("{}.vl.json", drawn.picture.file));
        match &drawn.specification {
            Ok(specification) => write(&path, &format!("{specification}\n"))?,
            Err(error) => tell!("{error}\n"),
        }
    }
    let report = folder.join("report.html");
    let page = render(study, tally, &pictures, command_line, live.as_ref())?;
    write(&report, &page)?;
    say!("pictures, plan and all figures: {}\n", report.display())?;
    if tally.rungs.iter().all(|rung| rung.made == 0) {
        let results = folder.join("results.csv");
        let results = results.display();
        bail!("no run of the study could be made; {results} says why of every row");
    }
    let enough = enough_pass(study, tally).unwrap_or(true);
    if let (false, Some(required)) = (enough, study.required_yield_percent) {
        let required = number::table(required);
        say!("FAIL: less than the required {required} % are within the limits\n")?;
    }
    Ok(enough)
}

fn write(path: &Path, text: &str) -> std::io::Result<()> {
    OutputFile::create(path)?.write_whole(text)
}

/// For each rung the span of its runs.
fn table(tally: &Tally) -> String {
    let mut text = String::new();
    for rung in &tally.rungs {
        let percent = rung.yield_percent();
        let percent = percent.map_or_else(|| number::MISSING.to_owned(), number::table);
        text += &format!(
            "{}: {} of {} runs within the limits ({percent} %)",
            rung.rung,
            rung.passed,
            rung.made + rung.not_made
        );
        if rung.excluded > 0 {
            text += &format!(", {} left out by a constraint", rung.excluded);
        }
        text += "\n";
        if let Some((row, reason)) = &rung.first_reason {
            text += &format!("{} not made; row {row}: {reason}\n", rung.not_made);
        }
        let header = "figure|least|in row|mean|most|in row|unit|none";
        text += &terminal::table(header.split('|'), 1, figure_rows(rung));
        if let Some(words) = unstable_words(rung) {
            text += &(words + "\n");
        }
    }
    let best = best_table(tally);
    if !best.rows.is_empty() {
        text += "best of the runs within all limits, by what is left of the tightest\n";
        text += &terminal::table(&best.heads, 1, best.rows);
    }
    text
}

/// Refuses to replace files of the folder, but for those of rows.
fn refuse_results(folder: &Path, outputs: &[&PathBuf]) -> anyhow::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let of_row = name.starts_with("row-");
        if !of_row && let Some(output) = outputs.iter().find(|output| same_file(output, &path)) {
            let output = output.display();
            bail!("{output} is part of the results of the study; an output would replace it");
        }
    }
    Ok(())
}
