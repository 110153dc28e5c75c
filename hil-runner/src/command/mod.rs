//! The commands, one file each.

mod budget;
mod budget_tables;
mod certify;
mod home;
mod init;
mod interrupt;
mod ladder;
mod link;
mod main_job;
mod progress;
mod run;
mod schema;
mod study;
mod study_end;
mod study_row;
mod terminal;
mod words;

use clap::{Parser, Subcommand};
use hil_core::case_run::CaseRun;
use hil_core::error::RunError;
use hil_core::run::RunOptions;
use hil_core::runfile::RunFile;
use progress::Progress;

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
                  hil-runner words paper-1\n  \
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
    /// Show the words of a case's law: lengths, headroom, rounding, and what fits
    Words(words::Words),
    /// Measure the joint's gap as the firmware does: creep until the load follows
    Home(home::Home),
    /// Hold the controller on chips against the host's, bit for bit
    Certify(certify::Certify),
    /// Measure what the controller costs on chips, and hold it against the goldens
    Budget(budget::Budget),
    /// Run one case over many values of its keys, and draw what comes out
    Study(study::StudyCommand),
    /// Print a commented run file to start from
    Init(init::Init),
    /// Print the JSON schema of run files, for editors
    Schema(schema::Schema),
}

impl CommandLine {
    /// Does what was asked. `Ok(false)` if a verdict fails.
    pub(crate) fn execute(self) -> anyhow::Result<bool> {
        match self.command {
            None => main_job::execute(),
            Some(Command::Run(run)) => run.execute(),
            Some(Command::Ladder(ladder)) => ladder.execute(),
            Some(Command::Words(words)) => words.execute(),
            Some(Command::Home(home)) => home.execute(),
            Some(Command::Certify(certify)) => certify.execute(),
            Some(Command::Budget(budget)) => budget.execute(),
            Some(Command::Study(study)) => study.execute(),
            Some(Command::Init(init)) => init.execute(),
            Some(Command::Schema(schema)) => schema.execute(),
        }
    }
}

/// The error of a run of this file as the user should read it.
fn explain(file: &RunFile, error: RunError) -> anyhow::Error {
    anyhow::Error::msg(hil_core::explain::explain(file, &error))
}

/// Runs a case again to see which digits of its figures hold.
fn confirm(run: &mut CaseRun, options: RunOptions) -> Result<(), RunError> {
    let mut progress = Progress::labelled(&run.case, &format!("{}, again", run.case.name));
    run.confirm(options, &mut |row| progress.row(row))
}

/// Tells on stderr what the user should know besides the figures.
fn warn(runs: &[CaseRun]) {
    for run in runs {
        for warning in &run.warnings {
            tell(&format!(
                "{}: warning: {warning}\n",
                run.outcome.summary.name
            ));
        }
    }
}
