//! The verbs, one file each but for the shortest, which stand here.

mod budget;
mod c_axis;
mod certify;
#[cfg(unix)]
mod flips;
mod junit;
mod ladder;
mod live;
mod margins;
mod measured;
mod options;
mod run;
mod rust_axis;
mod scaling;
mod schema;
mod study;
mod terminal;
mod trace;
mod tune;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{CommandFactory, Parser, Subcommand};
use hil_core::controllers::measure_gap;
use hil_core::error::RunError;
use hil_core::remarks::gap_under_load;
use hil_core::{number, runfile};
use hil_runner::report::command_line;

use options::{Sets, explain, warn};

pub(crate) use terminal::print_error;
use terminal::say;

/// Position-controlled servo axis on the bench: the controller firmware runs
/// in lockstep with motor, gear, joint with backlash, screw and carriage.
#[derive(Debug, Parser)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    after_help = include_str!("help/main.txt").trim_ascii_end()
)]
pub(crate) struct CommandLine {
    /// Write the verdicts on the four simulations as JUnit's XML
    #[arg(long, value_name = "F.xml")]
    junit: Option<PathBuf>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run one or more cases and check their budgets
    Run(run::Run),
    /// Run one case on every rung and show what each rung adds
    Ladder(ladder::Ladder),
    /// Make a page in which every key of a case can be moved: the simulator in one file
    Live(live::LivePage),
    /// Show the margins of a case's linear loop, without a run
    Margins(margins::Margins),
    /// Show a case's fixed-point gains: lengths, headroom, rounding, and what fits
    Scaling(scaling::Scaling),
    /// Measure the joint's gap as the firmware does: creep until the load follows
    #[command(after_help = include_str!("help/measure-backlash.txt").trim_ascii_end())]
    MeasureBacklash {
        /// Run file, built-in case or `-`, a run file from standard input
        case: String,
        #[command(flatten)]
        sets: Sets,
    },
    /// Hold the controller on chips against the host's, bit for bit
    Certify(certify::Certify),
    /// Measure what the controller costs on chips, and hold it against the goldens
    Budget(budget::Budget),
    /// Run one case over many values of its keys, and draw what comes out
    Study(study::StudyCommand),
    /// Search the setting of some keys that serves best
    Tune(tune::Tune),
    /// Print a commented run file to start from
    #[command(
        after_help = "Examples:\n  hil-runner init paper-4 > axis.toml\n  hil-runner init --template belt > axis.toml"
    )]
    Init {
        /// Built-in case to start from
        #[arg(default_value = "paper-2", conflicts_with = "template")]
        case: String,
        /// An axis of data sheets to start from: ballscrew, belt, rack or gearbox
        #[arg(long, value_name = "NAME")]
        template: Option<String>,
    },
    /// Print the JSON schema of run files or study files, for editors
    Schema(schema::Schema),
    /// Print the completions of commands and options for a shell
    #[command(after_help = "Examples:
  hil-runner completions bash > ~/.local/share/bash-completion/completions/hil-runner
  hil-runner completions zsh > ~/.zfunc/_hil-runner
  hil-runner completions fish > ~/.config/fish/completions/hil-runner.fish")]
    Completions {
        /// Shell
        shell: clap_complete::Shell,
    },
    /// Write man pages, one for each command
    #[command(after_help = "Example:
  hil-runner man ~/.local/share/man/man1 && man hil-runner-run")]
    Man {
        /// Folder of the pages; it is made if it is not there
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
}

/// Verbs of earlier versions, and what they are called now.
const RENAMED: [(&str, &str); 2] = [("words", "scaling"), ("home", "measure-backlash")];

impl CommandLine {
    /// Takes the program's arguments and does what is asked. `Ok(false)` if a
    /// verdict fails.
    pub(crate) fn execute() -> anyhow::Result<bool> {
        refuse_old_verb(std::env::args_os().skip(1))?;
        let line = Self::parse();
        match line.command {
            None => run::main_job(line.junit),
            Some(Command::Run(run)) => run.execute(),
            Some(Command::Ladder(ladder)) => ladder.execute(),
            Some(Command::Live(live)) => live.execute(),
            Some(Command::Margins(margins)) => margins.execute(),
            Some(Command::Scaling(scaling)) => scaling.execute(),
            Some(Command::MeasureBacklash { case, sets }) => measure_backlash(&case, &sets),
            Some(Command::Certify(certify)) => certify.execute(),
            Some(Command::Budget(budget)) => budget.execute(),
            Some(Command::Study(study)) => study.execute(),
            Some(Command::Tune(tune)) => tune.execute(),
            Some(Command::Init { case, template }) => init(&case, template.as_deref()),
            Some(Command::Schema(schema)) => schema.execute(),
            Some(Command::Completions { shell }) => completions(shell),
            Some(Command::Man { folder }) => man(&folder),
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

fn measure_backlash(case: &str, sets: &Sets) -> anyhow::Result<bool> {
    let file = sets.load_one(case)?;
    let gap = measure_gap(&file.case).map_err(|error| explain(&file, RunError::Quantise(error)))?;
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
    warn(&file.case.name, gap_under_load(&file.case));
    Ok(true)
}

fn init(case: &str, template: Option<&str>) -> anyhow::Result<bool> {
    if let Some(name) = template {
        let Some(text) = runfile::template_text(name) else {
            let names = runfile::template_names().collect::<Vec<_>>().join(", ");
            bail!("there is no template {name:?}; there are {names}");
        };
        terminal::print(text)?;
        return Ok(true);
    }
    let Some(text) = runfile::builtin_text(case) else {
        let names = runfile::builtin_names().collect::<Vec<_>>().join(", ");
        bail!("there is no built-in case {case:?}; there are {names}");
    };
    say!("{}{text}", schema::SchemaOf::RunFile.line())?;
    Ok(true)
}

/// The program as its help, its completions and its man pages name it.
const PROGRAM: &str = env!("CARGO_PKG_NAME");

fn completions(shell: clap_complete::Shell) -> anyhow::Result<bool> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut CommandLine::command(), PROGRAM, &mut text);
    // For bash, clap_complete 4.6 looks for commands of a program with a hyphen under two
    // names: clap-rs/clap#6421.
    let text = String::from_utf8(text)?.replace("hil__subcmd__runner", "hil__runner");
    terminal::print(&text)?;
    Ok(true)
}

fn man(folder: &Path) -> anyhow::Result<bool> {
    let place = folder.display();
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(CommandLine::command(), folder))
        .with_context(|| format!("{place} cannot be written"))?;
    Ok(true)
}
