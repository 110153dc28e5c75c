//! The verbs, one file each, and what several of them need: cases with their
//! overrides, remarks, errors in the words of the run file.

mod budget;
mod certify;
mod ladder;
mod link_option;
mod measure_backlash;
mod run;
mod run_file;
mod scaling;
mod study;
mod terminal;

use std::collections::HashSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{Args, Parser, Subcommand};
use hil_core::case::Law;
use hil_core::error::RunError;
use hil_core::runfile::{self, RunFile};
use hil_runner::command_line::command_line;
use hil_runner::files;
use hil_runner::files::output::same_file;

pub(crate) use terminal::tell;

/// Position-controlled servo axis on the bench: the controller firmware runs
/// in lockstep with motor, gear, joint with backlash, screw and carriage.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Without a command: the paper's four simulations on the firmware rung, budgets \
                  checked, out/report.html written.\n\n\
                  Built-in cases: paper-1, paper-2, paper-3, paper-4, paper-2-12bit. \
                  Exit status: 0 all verdicts pass, 1 a verdict fails, 2 the run could not be made.\n\n\
                  Examples:\n  \
                  hil-runner\n  \
                  hil-runner run paper-2 --trace trace.csv --summary summary.json\n  \
                  hil-runner run paper-2 --link qemu\n  \
                  hil-runner ladder paper-1\n  \
                  hil-runner scaling paper-1\n  \
                  hil-runner certify paper-1 paper-2 paper-3 paper-4\n  \
                  hil-runner budget m4 m0\n  \
                  hil-runner study sample-time\n  \
                  hil-runner init paper-2 > axis.toml"
)]
pub(crate) struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run one or more cases and check their budgets
    Run(run::Run),
    /// Run one case on every rung and show what each rung adds
    Ladder(ladder::Ladder),
    /// Show a case's fixed-point gains: lengths, headroom, rounding, and what fits
    Scaling(scaling::Scaling),
    /// Measure the joint's gap as the firmware does: creep until the load follows
    MeasureBacklash(measure_backlash::MeasureBacklash),
    /// Hold the controller on chips against the host's, bit for bit
    Certify(certify::Certify),
    /// Measure what the controller costs on chips, and hold it against the goldens
    Budget(budget::Budget),
    /// Run one case over many values of its keys, and draw what comes out
    Study(study::StudyCommand),
    /// Print a commented run file to start from
    Init(run_file::Init),
    /// Print the JSON schema of run files, for editors
    Schema(run_file::Schema),
}

/// Verbs of earlier versions, and what they are called now.
const RENAMED: [(&str, &str); 2] = [("words", "scaling"), ("home", "measure-backlash")];

impl CommandLine {
    /// Takes the program's arguments and does what is asked. `Ok(false)` if a
    /// verdict fails.
    pub(crate) fn execute() -> anyhow::Result<bool> {
        refuse_old_verb(std::env::args_os().skip(1))?;
        match Self::parse().command {
            None => run::main_job(),
            Some(Command::Run(run)) => run.execute(),
            Some(Command::Ladder(ladder)) => ladder.execute(),
            Some(Command::Scaling(scaling)) => scaling.execute(),
            Some(Command::MeasureBacklash(measurement)) => measurement.execute(),
            Some(Command::Certify(certify)) => certify.execute(),
            Some(Command::Budget(budget)) => budget.execute(),
            Some(Command::Study(study)) => study.execute(),
            Some(Command::Init(init)) => init.execute(),
            Some(Command::Schema(schema)) => schema.execute(),
        }
    }
}

/// Says the new verb in place of an old one, with the line that has it.
fn refuse_old_verb(arguments: impl Iterator<Item = OsString>) -> anyhow::Result<()> {
    let mut words: Vec<String> = arguments
        .map(|word| word.to_string_lossy().into_owned())
        .collect();
    let renamed = |word: &String| RENAMED.into_iter().find(|(old, _)| old == word);
    if let Some(verb) = words.first_mut()
        && let Some((old, new)) = renamed(verb)
    {
        *verb = new.to_owned();
        let line = command_line(words.iter().map(String::as_str));
        bail!("{old} is now {new}: {line}");
    }
    Ok(())
}

// A documented structure would put its words into the help of every verb.
#[derive(Debug, Clone, Default, Args)]
struct Sets {
    /// Override a key of the run file; the value is TOML, a bare word a string
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,
}

// As above.
#[derive(Debug, Default, Args)]
struct Cases {
    /// Run files or built-in cases (paper-1 … paper-4, paper-2-12bit)
    #[arg(required = true)]
    cases: Vec<String>,
}

impl Sets {
    /// Reads the run files; all that is wrong with any of them in one message.
    fn load(&self, cases: &[String]) -> anyhow::Result<Vec<RunFile>> {
        let mut found = Vec::with_capacity(cases.len());
        let mut mistakes = Vec::new();
        let mut told = HashSet::new();
        for case in cases {
            match files::run_file(case, &self.sets) {
                Ok(file) => found.push(file),
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
        Ok(found)
    }

    /// Reads one run file.
    fn load_one(&self, case: &str) -> anyhow::Result<RunFile> {
        let files = self.load(&[case.to_owned()])?;
        files.into_iter().next().context("a case has a file")
    }

    /// The same with one override more, which comes last.
    fn and(&self, set: String) -> Self {
        let sets = self.sets.iter().cloned().chain([set]);
        Self {
            sets: sets.collect(),
        }
    }
}

/// Refuses every law but the firmware's.
fn refuse_other_laws(files: &[RunFile], because: &str) -> anyhow::Result<()> {
    let other = |file: &&RunFile| file.case.controller.law != Law::Firmware;
    if let Some(file) = files.iter().find(other) {
        let because = format!("{because}; the law must be \"firmware\"");
        bail!("{}", file.refuse("controller", "law", &because));
    }
    Ok(())
}

/// An output must not replace a run file that is read, nor another output.
fn refuse_shared_paths(cases: &[String], outputs: &[&PathBuf]) -> anyhow::Result<()> {
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

/// The folder of the outputs that nobody has given a path for.
fn make_out_folder() -> anyhow::Result<()> {
    std::fs::create_dir_all("out").context("the folder out cannot be made")
}

/// The error of a run of this file as the user should read it.
fn explain(file: &RunFile, error: RunError) -> anyhow::Error {
    anyhow::Error::msg(hil_core::explain::explain(file, &error))
}

/// Tells on stderr what the user should know besides the figures.
fn warn(name: &str, warnings: impl IntoIterator<Item = impl std::fmt::Display>) {
    for warning in warnings {
        tell(&format!("{name}: warning: {warning}\n"));
    }
}
