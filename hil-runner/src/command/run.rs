//! `hil-runner run`: one or more cases with their outputs; without a verb the
//! paper's four.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use hil_core::budget::Verdict;
use hil_core::controllers::IoKind;
use hil_core::measured::Comparison;
use hil_core::quantise::from_plant;
use hil_core::reservation::kept_but;
use hil_core::run::{CaseRun, RunOptions};
use hil_core::runfile::RunFile;
use hil_core::{figures, number};
use hil_runner::files::OutputFile;
use hil_runner::host::timed_run;
use hil_runner::report::{self, command_line, each_with};

use super::junit::Junit;
use super::measured::{self, LogOption};
use super::options::{
    Cases, LINK_HELP, LinkName, Sets, explain, live_case, live_if, make_out_folder, of_cases,
    once_each, refuse_other_laws, refuse_replaced, warn,
};
use super::terminal::{self, Progress, TimeLimit};
use super::trace::TraceFile;

/// The cases of the program without a verb, and its page.
const PAPER: [&str; 4] = ["paper-1", "paper-2", "paper-3", "paper-4"];
const PAPER_PAGE: &str = "out/report.html";

/// The paper's four simulations on the firmware rung.
pub(super) fn main_job(junit: Option<PathBuf>) -> anyhow::Result<bool> {
    make_out_folder()?;
    let run = Run {
        cases: Cases {
            cases: PAPER.map(str::to_owned).into(),
        },
        report: Some(PAPER_PAGE.into()),
        junit,
        ..Run::default()
    };
    let title = ["The paper's four simulations", "hil-runner"].map(str::to_owned);
    let end = format!("plots and all figures: {PAPER_PAGE}\n");
    run.make(run.sets.load(&run.cases.cases), Some(title), &end)
}

/// Run one or more cases and check their budgets
#[derive(Debug, Default, Args)]
#[command(after_help = include_str!("help/run.txt").trim_ascii_end())]
pub(crate) struct Run {
    #[command(flatten)]
    cases: Cases,
    /// Write every row as CSV, or as Parquet to a name that ends in .parquet; `-` is standard
    /// output
    #[arg(long, value_name = "F.csv")]
    trace: Option<PathBuf>,
    /// Write the key figures as JSON, of several cases a list; `-` is standard output
    #[arg(long, value_name = "F.json")]
    summary: Option<PathBuf>,
    /// Print what --summary writes, in place of the tables
    #[arg(long)]
    json: bool,
    /// Write a self-contained page with plots, all cases side by side
    #[arg(long, value_name = "F.html")]
    report: Option<PathBuf>,
    /// Carry the simulator of the case in the page, of several cases that of the first
    #[arg(long, requires = "report", conflicts_with = "link")]
    live: bool,
    /// Write the verdicts as JUnit's XML, a suite a case
    #[arg(long, value_name = "F.xml")]
    junit: Option<PathBuf>,
    #[command(flatten)]
    log: LogOption,
    #[command(flatten)]
    sets: Sets,
    #[arg(long, help = LINK_HELP, default_value_t)]
    link: LinkName,
    /// How the firmware reaches encoder and converter; the results are the same
    #[arg(long, value_enum, default_value_t = IoName::Direct)]
    io: IoName,
    /// Wall-clock time that the runs may take; a run that takes longer fails, and its trace is kept
    #[arg(long, value_name = "SECONDS", value_parser = time_limit, allow_negative_numbers = true)]
    time_limit: Option<f64>,
}

/// A time limit of the command line.
fn time_limit(words: &str) -> Result<f64, String> {
    let seconds = measured::seconds(words).ok().filter(|s| *s > 0.0);
    seconds.ok_or_else(|| "a finite number of seconds greater than 0 is allowed".to_owned())
}

/// Names of the electronics on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum IoName {
    #[default]
    /// Registers and codes as numbers
    Direct,
    /// The firmware's drivers over models of an LS7366R and an AD5721R or AD5761R
    Spi,
}

impl Run {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        if self.cases.cases.len() > 1 && self.trace.is_some() {
            bail!("--trace takes one case; --summary, --report and --junit take several");
        }
        self.make(self.sets.load(&self.cases.cases), None, "")
    }

    /// A row of a study's results, with its report and its trace.
    pub(super) fn of_row(case: String, sets: Sets, report: PathBuf, trace: PathBuf) -> Self {
        Self {
            cases: Cases { cases: vec![case] },
            trace: Some(trace),
            report: Some(report),
            sets,
            ..Self::default()
        }
    }

    /// Heading and command of a page: the names of the cases, and this command.
    fn title(&self, files: &[RunFile]) -> [String; 2] {
        let names = files.iter().map(|file| file.case.name.as_str());
        let names = names.collect::<Vec<_>>().join(", ");
        [names, self.command_line()]
    }

    /// Runs the files of the cases, if they could be read; heading and command of the
    /// page are those of the cases unless `title` has others, `end` stands below
    /// the tables.
    pub(super) fn make(
        &self,
        files: anyhow::Result<Vec<RunFile>>,
        title: Option<[String; 2]>,
        end: &str,
    ) -> anyhow::Result<bool> {
        let cases = &self.cases.cases;
        let read = files.as_deref().unwrap_or_default();
        refuse_replaced(&self.outputs(), cases, read, self.log.log.as_deref())?;
        let Some(mut junit) = Junit::create(self.junit.as_deref())? else {
            return self.make_all(&files?, title, end, &mut Vec::new());
        };
        let mut runs = Vec::with_capacity(cases.len());
        let made = files.and_then(|files| self.make_all(&files, title, end, &mut runs));
        for run in &runs {
            let summary = &run.outcome.summary;
            junit.verdicts(&summary.name, summary, run.verdicts());
        }
        if let Err(error) = &made {
            self.add_unmade(&mut junit, runs.len(), error);
        }
        let written = junit.write();
        made.and_then(|passes| written.map(|()| passes))
    }

    /// Adds the cases after those that were made: an error where the reason is the case's,
    /// else skipped. Of an error after all runs the case is the program.
    fn add_unmade(&self, junit: &mut Junit, made: usize, error: &anyhow::Error) {
        let cases = &self.cases.cases;
        let unreadable = cases.iter().map(|case| self.sets.load_one(case).err());
        let unreadable: Vec<_> = unreadable.collect();
        let all_read = unreadable.iter().all(Option::is_none);
        for (i, (case, own)) in cases.iter().zip(&unreadable).enumerate().skip(made) {
            let here = (all_read && i == made).then_some(error);
            junit.unmade(case, own.as_ref().or(here));
        }
        if made == cases.len() {
            junit.unmade(env!("CARGO_PKG_NAME"), Some(error));
        }
    }

    /// The same without the verdicts' file; the runs that were made go to `runs`.
    fn make_all(
        &self,
        files: &[RunFile],
        title: Option<[String; 2]>,
        end: &str,
        runs: &mut Vec<CaseRun>,
    ) -> anyhow::Result<bool> {
        let log = self.log.load(files.iter().map(|file| &file.case))?;
        let cases = &self.cases.cases;
        let [heading, command_line] = title.unwrap_or_else(|| self.title(files));
        self.refuse_laws(files)?;
        // Every path is opened before the first run.
        let open = |path: &Option<PathBuf>| path.as_deref().map(OutputFile::create).transpose();
        let mut trace = self.trace.as_deref().map(TraceFile::create).transpose()?;
        let summary = open(&self.summary)?;
        let report = open(&self.report)?;
        let case = || live_case(cases.first().context("a run has a case")?, &self.sets);
        let live = live_if(self.live, case)?;
        let (kind, mut chip) = self.link.open()?;
        let options = RunOptions {
            io: match self.io {
                IoName::Direct => IoKind::Direct,
                IoName::Spi => IoKind::Spi,
            },
            plot: report.is_some(),
            ..RunOptions::default()
        };
        let limit = self.time_limit.and_then(TimeLimit::new);
        let mut differences = Vec::new();
        for file in files {
            let mut progress = Progress::of(&file.case).within(limit);
            let mut comparison = log.as_ref().map(|log| Comparison::new(log, &file.case));
            let mut sink = |row: &_| {
                trace.as_mut().map_or(Ok(()), |trace| trace.row(row))?;
                if let Some(comparison) = &mut comparison {
                    comparison.row(row);
                }
                progress.row(row)
            };
            let run = match &mut chip {
                Some(chip) => chip.run(&file.case, options, &mut sink),
                None => timed_run(&file.case, kind, options, &mut sink),
            };
            drop(progress);
            // What was traced before an error is kept all the same; a run that was
            // refused has no rows and replaces nothing.
            if let Some(trace) = trace.take() {
                trace.finish()?;
            }
            let mut run = run.map_err(|error| explain(file, error))?;
            // Again, to see which digits of its figures hold.
            let mut progress = Progress::again(&file.case).within(limit);
            let confirmed = run.confirm(options, &mut |row| progress.row(row));
            confirmed.map_err(|error| explain(file, error))?;
            runs.push(run);
            differences.extend(comparison.map(|comparison| comparison.differences()));
        }
        if let Some(chip) = &chip {
            chip.tell();
        }
        let summaries = of_cases(runs.iter().map(|run| &run.outcome.summary))?;
        if let Some(file) = summary {
            file.write_json(&summaries)?;
        }
        let names = runs.iter().map(|run| run.outcome.summary.name.as_str());
        let compared = log
            .as_ref()
            .map(|log| measured::table(log, names, &differences));
        if let Some(file) = report {
            let mut data = hil_core::report::report(&heading, &command_line, runs);
            if let Some(log) = log {
                data = data.with_log(log, differences);
            }
            file.write_whole(&report::render(&data, live.as_ref())?)?;
        }
        if self.json {
            terminal::print_json(&summaries)?;
            terminal::print_error(&compared.unwrap_or_default());
        } else {
            let text = figure_table(runs)
                + &verdict_table(runs)
                + &compared.unwrap_or_default()
                + &gain_tables(runs)
                + &timing_lines(runs)
                + &chip_lines(runs)
                + end;
            terminal::print_beside(&self.outputs(), &text)?;
        }
        for run in runs.iter() {
            warn(&run.outcome.summary.name, &run.warnings);
        }
        Ok(runs.iter().all(CaseRun::passes))
    }

    /// Refuses laws that electronics and link do not have.
    fn refuse_laws(&self, files: &[RunFile]) -> anyhow::Result<()> {
        if self.io == IoName::Spi {
            refuse_other_laws(files, "--io spi runs the firmware's drivers")?;
        }
        if let LinkName::Chip(link) = &self.link {
            refuse_other_laws(files, &format!("--link {link} runs the firmware"))?;
            if self.io == IoName::Spi {
                bail!(
                    "--io spi is for a controller on this host; a chip has electronics of its own \
                     (--link {link})"
                );
            }
        }
        Ok(())
    }

    pub(super) fn outputs(&self) -> Vec<&Path> {
        let files = [&self.trace, &self.summary, &self.report, &self.junit].into_iter();
        let json = self.json.then_some(Path::new("-"));
        let files = files.flatten().map(PathBuf::as_path);
        files.chain(json).collect()
    }

    /// The command without its outputs.
    pub(super) fn command_line(&self) -> String {
        let link = (self.link != LinkName::default()).then(|| self.link.to_string());
        let io = (self.io == IoName::Spi).then(|| "spi".to_owned());
        let log = self.log.words();
        let words = core::iter::once("run")
            .chain(self.cases.cases.iter().map(String::as_str))
            .chain(log.iter().map(String::as_str))
            .chain(each_with("--set", &self.sets.sets))
            .chain(each_with("--link", &link))
            .chain(each_with("--io", &io));
        command_line(words)
    }
}

/// The figures that a reader looks for first, a line a run.
fn figure_table(runs: &[CaseRun]) -> String {
    const FIGURES: [(&str, &str); 7] = [
        ("peak acc\nm/s²", "peak_abs_acc_mps2"),
        ("following\nerror mm", "peak_following_error_mm"),
        ("final\nerror µm", "final_error_um"),
        ("settled\nafter s", "settling_time_s"),
        ("contact\nchanges", "contact_changes"),
        ("peak\nvolts", "peak_abs_voltage_v"),
        ("peak\ncode", "max_abs_dac_code"),
    ];
    let heads = FIGURES.map(|(head, _)| head);
    let header = ["case", "law", "solver"].into_iter().chain(heads);
    let rows = runs.iter().map(|run| {
        let summary = &run.outcome.summary;
        let name = terminal::short(&summary.name);
        let own = [name, summary.law.to_owned(), summary.solver.to_owned()];
        let figures = FIGURES.map(|(_, key)| summary.shown(key));
        own.into_iter().chain(figures).collect::<Vec<_>>()
    });
    terminal::table(header, 3, rows)
}

/// Every verdict of every run.
fn verdict_table(runs: &[CaseRun]) -> String {
    if runs.iter().all(|run| run.verdicts().next().is_none()) {
        return "no limits in the budget, no verdicts\n".to_owned();
    }
    let header = "case|figure|value|limit|margin|unit|verdict".split('|');
    let of = |run: &CaseRun, verdict: &Verdict| {
        let digits = run.outcome.summary.digits(verdict.figure);
        let default = if verdict.default { " (default)" } else { "" };
        let at_least = if verdict.at_least { "≥ " } else { "" };
        [
            terminal::short(&run.outcome.summary.name),
            verdict.figure.to_owned(),
            number::shown(verdict.value, digits),
            format!("{at_least}{}{default}", number::table(verdict.limit)),
            number::shown(verdict.margin, verdict.margin_digits(digits)),
            figures::unit(verdict.figure).to_owned(),
            if verdict.pass { "pass" } else { "FAIL" }.to_owned(),
        ]
    };
    let rows = runs
        .iter()
        .flat_map(|run| run.verdicts().map(move |verdict| of(run, verdict)));
    terminal::table(header, 2, rows) + &standing(runs)
}

/// Their sum, in a line.
fn standing(runs: &[CaseRun]) -> String {
    let of = |pass: bool| {
        let verdicts = runs.iter().flat_map(CaseRun::verdicts);
        verdicts.filter(|verdict| verdict.pass == pass).count()
    };
    let (kept, broken) = (of(true), of(false));
    if broken > 0 {
        return format!("FAIL: {broken} of {} limits broken\n", kept + broken);
    }
    let reservations: Vec<_> = runs.iter().map(CaseRun::named_reservations).collect();
    let words = kept_but(&reservations).unwrap_or_else(|| "PASS: all limits kept".to_owned());
    format!("{words}\n")
}

/// The gains in fixed point, once for cases that agree.
fn gain_tables(runs: &[CaseRun]) -> String {
    let header = ["gain per sample", "codes/count", "fixed point", "rounding"];
    let mut tables = Vec::new();
    for run in runs {
        let Some(gains) = &run.outcome.gains else {
            continue;
        };
        let rows = gains.rows.iter().map(|gain| {
            let name = match gain.unit() {
                "codes/count" => gain.name().to_owned(),
                unit => format!("{} in {unit}", gain.name()),
            };
            [
                name,
                number::table(gain.wanted),
                gain.word.to_string(),
                number::relative_error(gain.relative_error()),
            ]
        });
        let table = terminal::table(header, 1, rows) + &from_plant(&gains.rows);
        tables.push((run.outcome.summary.name.clone(), table));
    }
    let titled = once_each(tables).into_iter();
    let titled = titled.map(|(names, table)| format!("fixed-point gains of {names}\n{table}"));
    titled.collect()
}

/// Host step times, apart from everything that is reproducible.
fn timing_lines(runs: &[CaseRun]) -> String {
    let mut lines = String::new();
    for run in runs {
        let Some(timing) = run.timing else { continue };
        let shown = |time_us| number::rounded(time_us, 3);
        lines += &format!(
            "{}: host step {} µs median, {} p99, {} max of {} µs (clock alone {})\n",
            run.outcome.summary.name,
            shown(timing.median_us),
            shown(timing.p99_us),
            shown(timing.max_us),
            number::table(timing.sample_time_us),
            shown(timing.clock_us),
        );
    }
    lines
}

/// The cost of the controller's part of each run on its chip.
fn chip_lines(runs: &[CaseRun]) -> String {
    let mut lines = String::new();
    for run in runs {
        let summary = &run.outcome.summary;
        let Some(chip) = &summary.chip else { continue };
        let step = match (chip.instructions_per_step_max, chip.cycles_per_step_max) {
            (Some(instructions), Some(cycles)) => {
                format!("a step {instructions} instructions at most, {cycles} cycles allowed")
            }
            (None, Some(cycles)) => format!("a step {cycles} cycles at most"),
            (_, None) => "no time of its steps".to_owned(),
        };
        lines += &format!(
            "{} on {}, image {}: {step}, {} % of Δt at {} MHz; {} bytes of flash, {} of RAM, {} of stack\n",
            summary.name,
            chip.target,
            chip.image_hash,
            number::shown(chip.utilisation_max_percent, None),
            number::table(chip.clock_hz as f64 / 1e6),
            chip.flash_bytes,
            chip.ram_bytes,
            number::shown(chip.stack_bytes.map(f64::from), None),
        );
    }
    lines
}
