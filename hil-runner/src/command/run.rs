//! `hil-runner run`: one or more cases with their outputs.

use std::collections::HashSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::{Args, ValueEnum};
use hil_core::case::Law;
use hil_core::case_run::CaseRun;
use hil_core::controllers::IoKind;
use hil_core::run::RunOptions;
use hil_core::runfile::{self, RunFile};
use hil_core::trace::TraceWriter;
use hil_runner::command_line::{command_line, each_with};
use hil_runner::output::{OutputFile, same_file};
use hil_runner::{files, report};

use super::explain;
use super::link::{self, LinkName};
use super::progress::Progress;
use super::terminal;

/// Run one or more cases and check their budgets
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
                  hil-runner run paper-2 --trace trace.csv --summary summary.json\n  \
                  hil-runner run axis.toml --report axis.html --set controller.kp=4\n  \
                  hil-runner run paper-2 paper-2-12bit --report compare.html\n  \
                  hil-runner run paper-2-12bit --io spi\n  \
                  hil-runner run paper-2 --link qemu:m0\n  \
                  hil-runner run paper-2 --link qemu --set controller.computation_delay_s=measured --set budget.flash_bytes=32768\n  \
                  hil-runner run axis.toml --link serial:/dev/ttyACM0@921600\n  \
                  hil-runner run paper-1 --set controller.law=quantised --set budget.final_error_um=50")]
pub(crate) struct Run {
    /// Run files or built-in cases (paper-1 … paper-4, paper-2-12bit)
    #[arg(required = true)]
    cases: Vec<String>,
    /// Write every row as CSV; `-` is standard output
    #[arg(long, value_name = "F.csv")]
    trace: Option<PathBuf>,
    /// Write the key figures as JSON; `-` is standard output
    #[arg(long, value_name = "F.json")]
    summary: Option<PathBuf>,
    /// Write a self-contained page with plots, all cases side by side
    #[arg(long, value_name = "F.html")]
    report: Option<PathBuf>,
    /// Override a key of the run file; the value is TOML, a bare word a string
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,
    #[arg(long, help = link::HELP, default_value_t = LinkName::InProcess)]
    link: LinkName,
    /// How the firmware reaches encoder and converter; the results are the same
    #[arg(long, value_enum, default_value_t = IoName::Direct)]
    io: IoName,
}

/// Names of the electronics on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum IoName {
    /// Registers and codes as numbers
    Direct,
    /// The firmware's drivers over models of an LS7366R and an AD5721R or AD5761R
    Spi,
}

impl Run {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        if self.cases.len() > 1 && (self.trace.is_some() || self.summary.is_some()) {
            bail!("--trace and --summary take one case; give several cases with --report");
        }
        self.make(&load(&self.cases, &self.sets)?)
    }

    /// A row of a study's results, with its report and its trace.
    pub(super) fn of_row(case: String, sets: Vec<String>, report: PathBuf, trace: PathBuf) -> Self {
        Self {
            cases: vec![case],
            trace: Some(trace),
            summary: None,
            report: Some(report),
            sets,
            link: LinkName::InProcess,
            io: IoName::Direct,
        }
    }

    /// Runs the files of the cases.
    pub(super) fn make(&self, files: &[RunFile]) -> anyhow::Result<bool> {
        refuse_shared_paths(&self.cases, &self.outputs().collect::<Vec<_>>())?;
        if self.io == IoName::Spi
            && let Some(file) = files
                .iter()
                .find(|f| f.case.controller.law != Law::Firmware)
        {
            let because = "--io spi runs the firmware's drivers; the law must be \"firmware\"";
            bail!("{}", file.refuse("controller", "law", because));
        }
        self.link.refuse_other_laws(files)?;
        if self.io == IoName::Spi && matches!(self.link, LinkName::Chip(_)) {
            bail!(
                "--io spi is for a controller on this host; a chip has electronics of its own \
                 (--link {})",
                self.link
            );
        }
        // Every path is opened before the first run.
        let mut trace = open(self.trace.as_ref())?.map(TraceWriter::new);
        let summary = open(self.summary.as_ref())?;
        let report = open(self.report.as_ref())?;
        let mut link = self.link.open()?;
        let options = RunOptions {
            io: match self.io {
                IoName::Direct => IoKind::Direct,
                IoName::Spi => IoKind::Spi,
            },
            plot: report.is_some(),
            ..RunOptions::default()
        };
        let mut runs = Vec::with_capacity(files.len());
        for file in files {
            let mut progress = Progress::of(&file.case);
            let mut sink = |row: &_| {
                progress.row(row)?;
                trace.as_mut().map_or(Ok(()), |trace| trace.row(row))
            };
            let run = link.run(&file.case, options, &mut sink);
            drop(progress);
            // What was traced before an error is kept all the same; a run that was
            // refused has no rows and replaces nothing.
            if let Some(trace) = trace.take()
                && !trace.is_empty()
            {
                trace.finish()?.commit()?;
            }
            let mut run = run.map_err(|error| explain(file, error))?;
            super::confirm(&mut run, options).map_err(|error| explain(file, error))?;
            runs.push(run);
        }
        link.tell();
        if let Some(mut file) = summary
            && let Some(run) = runs.first()
        {
            serde_json::to_writer_pretty(&mut file, &run.outcome.summary)?;
            file.write_all(b"\n")?;
            file.commit()?;
        }
        if let Some(mut file) = report {
            let page = report::render(&hil_core::report::report(
                &title(&runs),
                &self.command_line(),
                &runs,
            ))?;
            file.write_all(page.as_bytes())?;
            file.commit()?;
        }
        self.show(&runs)?;
        Ok(runs.iter().all(CaseRun::passes))
    }

    fn show(&self, runs: &[CaseRun]) -> anyhow::Result<()> {
        let text = terminal::figure_table(runs)
            + &terminal::verdict_table(runs)
            + &terminal::word_tables(runs)
            + &terminal::timing_lines(runs)
            + &terminal::chip_lines(runs);
        // Data on standard output stays alone there.
        if self.has_data_on_stdout() {
            terminal::tell(&text);
        } else {
            terminal::print(&text)?;
        }
        super::warn(runs);
        Ok(())
    }

    /// Whether an output goes to standard output.
    pub(super) fn has_data_on_stdout(&self) -> bool {
        self.outputs().any(|path| path.as_os_str() == "-")
    }

    fn outputs(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.trace, &self.summary, &self.report]
            .into_iter()
            .flatten()
    }

    /// The command without its outputs.
    pub(super) fn command_line(&self) -> String {
        let link = match &self.link {
            LinkName::InProcess => None,
            link => Some(link.to_string()),
        };
        let io = (self.io == IoName::Spi).then(|| "spi".to_owned());
        let words = core::iter::once("run")
            .chain(self.cases.iter().map(String::as_str))
            .chain(each_with("--set", &self.sets))
            .chain(each_with("--link", &link))
            .chain(each_with("--io", &io));
        command_line(words)
    }
}

/// An output must not replace a run file that is read, nor another output.
pub(super) fn refuse_shared_paths(cases: &[String], outputs: &[&PathBuf]) -> anyhow::Result<()> {
    for (i, output) in outputs.iter().enumerate() {
        let path = output.display();
        if outputs
            .iter()
            .skip(i + 1)
            .any(|other| same_file(output, other))
        {
            bail!("{path} is given for two outputs; each needs its own");
        }
        let is_read = |case: &&String| {
            runfile::builtin_text(case).is_none() && same_file(Path::new(case), output)
        };
        if cases.iter().any(|case| is_read(&case)) {
            bail!("{path} is a run file of this command; an output would replace it");
        }
    }
    Ok(())
}

/// Reads the run files; all that is wrong with any of them in one message.
pub(super) fn load(cases: &[String], sets: &[String]) -> anyhow::Result<Vec<RunFile>> {
    let mut files = Vec::with_capacity(cases.len());
    let mut mistakes = Vec::new();
    let mut told = HashSet::new();
    for case in cases {
        match files::run_file(case, sets) {
            Ok(file) => files.push(file),
            // The same wrong --set is wrong for every case; once is enough.
            Err(errors) => mistakes.extend(
                errors
                    .entries()
                    .iter()
                    .map(ToString::to_string)
                    .filter(|mistake| told.insert(mistake.clone())),
            ),
        }
    }
    if !mistakes.is_empty() {
        let mut message = String::new();
        runfile::list_mistakes(&mut message, &mistakes)?;
        bail!(message);
    }
    Ok(files)
}

pub(super) fn open(path: Option<&PathBuf>) -> anyhow::Result<Option<OutputFile>> {
    Ok(path.map(|path| OutputFile::create(path)).transpose()?)
}

fn title(runs: &[CaseRun]) -> String {
    let names = runs.iter().map(|run| run.outcome.summary.name.as_str());
    names.collect::<Vec<_>>().join(", ")
}
