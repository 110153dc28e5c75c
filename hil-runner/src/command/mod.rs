//! The verbs, one file each.

mod budget;
mod cases;
mod certify;
mod ladder;
mod link_option;
mod measure_backlash;
mod run;
mod run_file;
mod scaling;
mod study;
mod terminal;

use std::ffi::OsString;

use anyhow::bail;
use clap::{Parser, Subcommand};
use hil_runner::command_line::command_line;

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
