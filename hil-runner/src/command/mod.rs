//! The verbs, one file each but for the shortest, which stand here.

mod budget;
mod c_axis;
mod certify;
#[cfg(unix)]
mod flips;
mod ladder;
mod options;
mod run;
mod rust_axis;
mod scaling;
mod study;
mod terminal;

use std::ffi::OsString;

use anyhow::bail;
use clap::{Args, Parser, Subcommand};
use hil_core::controllers::measure_gap;
use hil_core::error::RunError;
use hil_core::{number, runfile};
use hil_runner::report::command_line;

use options::{Sets, explain};

pub(crate) use terminal::print_error;
use terminal::say;

/// Position-controlled servo axis on the bench: the controller firmware runs
/// in lockstep with motor, gear, joint with backlash, screw and carriage.
#[derive(Debug, Parser)]
#[command(version, after_help = include_str!("help/main.txt").trim_ascii_end())]
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
    MeasureBacklash(MeasureBacklash),
    /// Hold the controller on chips against the host's, bit for bit
    Certify(certify::Certify),
    /// Measure what the controller costs on chips, and hold it against the goldens
    Budget(budget::Budget),
    /// Run one case over many values of its keys, and draw what comes out
    Study(study::StudyCommand),
    /// Print a commented run file to start from
    Init(Init),
    /// Print the JSON schema of run files, for editors
    Schema(Schema),
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

/// Measure the joint's gap as the firmware does: creep until the load follows
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/measure-backlash.txt").trim_ascii_end())]
struct MeasureBacklash {
    /// Run file or built-in case
    case: String,
    #[command(flatten)]
    sets: Sets,
}

impl MeasureBacklash {
    fn execute(&self) -> anyhow::Result<bool> {
        let file = self.sets.load_one(&self.case)?;
        let gap =
            measure_gap(&file.case).map_err(|error| explain(&file, RunError::Quantise(error)))?;
        let [first, second, third] = gap.full_counts;
        say!(
            "{}: half gap {} motor counts; the joint's own is {}\n\
        whole gap at three crossings: {first}, {second}, {third} motor counts; \
        {} s of simulated time\n",
            file.case.name,
            gap.half_counts,
            number::table(gap.true_half_counts),
            number::table(gap.duration_s),
        )?;
        Ok(true)
    }
}

/// Print a commented run file to start from
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  hil-runner init paper-4 > axis.toml")]
struct Init {
    /// Built-in case to start from
    #[arg(default_value = "paper-2")]
    case: String,
}

impl Init {
    fn execute(&self) -> anyhow::Result<bool> {
        let Some(text) = runfile::builtin_text(&self.case) else {
            let names: Vec<&str> = runfile::builtin_names().collect();
            let (case, names) = (&self.case, names.join(", "));
            bail!("there is no built-in case {case:?}; there are {names}");
        };
        terminal::print(&runfile::commented(&self.case, text))?;
        Ok(true)
    }
}

/// Print the JSON schema of run files
///
/// Editors with TOML support (taplo and others) complete and check run files
/// with it.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  hil-runner schema > run-file.schema.json")]
struct Schema {}

impl Schema {
    fn execute(&self) -> anyhow::Result<bool> {
        let schema = serde_json::to_string_pretty(&runfile::schema())?;
        say!("{schema}\n")?;
        Ok(true)
    }
}
