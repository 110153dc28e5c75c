//! `hil-runner ladder`: one case on every rung.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use hil_core::case::{Case, ComputationDelay, Law};
use hil_core::error::RunError;
use hil_core::ladder::{Rung, climb, climb_over, confirm};
use hil_core::measured::Comparison;
use hil_core::number;
use hil_core::run::{RunOptions, keys_without_effect};
use hil_core::runfile::{RunFile, values_of_template};
use hil_core::trace::Row;
use hil_runner::chip::spec::ChipLink;
use hil_runner::files::OutputFile;
use hil_runner::live::LiveCase;
use hil_runner::report::{self, command_line, each_with};
use serde_json::{Value, json};

use super::junit::Junit;
use super::measured::{self, LogOption};
use super::options::{
    OpenChip, Sets, explain, live_case, live_if, make_out_folder, refuse_replaced, warn,
};
use super::terminal::{self, Progress, tell};

const REPORT: &str = "out/ladder.html";

/// Run one case on every rung and show what each rung adds
///
/// Each rung adds one effect to the one below it, so the difference of two
/// neighbours is what that effect costs: sampling, encoder and DAC steps,
/// word lengths. Differences are taken on common 1 ms rows. A ladder judges
/// nothing: budgets are for `run`.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/ladder.txt").trim_ascii_end())]
pub(crate) struct Ladder {
    /// Run file, built-in case or `-`, a run file from standard input
    case: String,
    /// Page with the plots
    #[arg(long, value_name = "F.html", default_value = REPORT)]
    report: PathBuf,
    /// Carry the simulator in the page, with all rungs over each other
    #[arg(long, conflicts_with = "link")]
    live: bool,
    /// A chip for one rung more: qemu[:m4|m0|m3|rv32], qemu-uart[:…] or serial:PORT[@BAUD]
    #[arg(long, value_name = "LINK")]
    link: Option<ChipLink>,
    /// Print every rung as JSON in place of the table: its summary, and its difference to the
    /// rung below
    #[arg(long)]
    json: bool,
    /// Write the verdicts on every rung as JUnit's XML; the exit status knows none of them
    #[arg(long, value_name = "F.xml")]
    junit: Option<PathBuf>,
    #[command(flatten)]
    log: LogOption,
    #[command(flatten)]
    sets: Sets,
}

impl Ladder {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let outputs = self.outputs();
        let files = self.load_rungs();
        let (case, log) = (std::slice::from_ref(&self.case), self.log.log.as_deref());
        refuse_replaced(&outputs, case, files.as_deref().unwrap_or_default(), log)?;
        let junit = Junit::create(self.junit.as_deref())?;
        let made = files.and_then(|files| self.make(&files));
        let Some(mut junit) = junit else {
            return made.map(|_| true);
        };
        for rung in made.iter().flatten() {
            let summary = &rung.outcome.summary;
            let name = format!("{}, {}", summary.name, rung.name());
            junit.verdicts(&name, summary, summary.verdicts.iter());
        }
        if let Err(error) = &made {
            junit.unmade(&self.case, Some(error));
        }
        made.and(junit.write()).map(|()| true)
    }

    fn outputs(&self) -> Vec<&Path> {
        let json = self.json.then_some(Path::new("-"));
        let files = [Some(self.report.as_path()), self.junit.as_deref(), json];
        files.into_iter().flatten().collect()
    }

    /// Makes the rungs, shows them and writes their page.
    fn make(&self, files: &[RunFile]) -> anyhow::Result<Vec<Rung>> {
        let log = self.log.load(files.iter().map(|file| &file.case))?;
        // The folder that this program makes by itself.
        if self.report.parent() == Path::new(REPORT).parent() {
            make_out_folder()?;
        }
        let page = OutputFile::create(&self.report)?;
        let case = || live_case(&self.case, &self.sets).map(LiveCase::on_all_rungs);
        let live = live_if(self.live, case)?;
        let mut chip = self.link.as_ref().map(OpenChip::open).transpose()?;
        // The one that was asked for, on rung `firmware`.
        let on_chip = self.sets.and(on_rung(Law::Firmware));
        let on_chip = on_chip.load_one(&self.case)?.case;
        let cases: Vec<Case> = files.iter().map(|file| file.case.clone()).collect();
        let first = files.first().context("a ladder has rungs")?;
        let mut progress = Progress::of(&first.case);
        let climbed = cases.iter().chain(chip.iter().map(|_| &on_chip));
        let compared = log
            .iter()
            .flat_map(|log| climbed.clone().map(|case| Comparison::new(log, case)));
        let mut compared: Vec<Comparison> = compared.collect();
        let mut begun = 0;
        let mut sink = |row: &Row| {
            // The rungs come one after the other.
            begun += usize::from(row.t_s == 0.0);
            if let Some(comparison) = compared.get_mut(begun.saturating_sub(1)) {
                comparison.row(row);
            }
            progress.row(row)
        };
        // The needles of the acceleration stand between the common rows.
        let options = RunOptions {
            plot: true,
            ..RunOptions::default()
        };
        let refused = |(number, error): (usize, RunError)| {
            let Some(file) = files.get(number) else {
                return anyhow!("{error}");
            };
            let rung = format!("rung {}", file.case.controller.law.name());
            explain(file, error).context(rung)
        };
        let mut rungs = climb(&cases, options, &mut sink).map_err(refused)?;
        if let Some(chip) = &mut chip {
            let law = chip.law(&on_chip);
            let climbed = law
                .and_then(|mut law| climb_over(&mut rungs, &on_chip, options, &mut law, &mut sink));
            climbed.map_err(|error| explain(files.last().unwrap_or(first), error))?;
        }
        drop(progress);
        let mut progress = Progress::again(&first.case);
        confirm(&mut rungs, &cases, &mut |row| progress.row(row)).map_err(refused)?;
        drop(progress);
        let mut data = hil_core::report::ladder_report(&self.command_line(), &rungs);
        let mut compared_text = String::new();
        if let Some(log) = &log {
            let differences = Vec::from_iter(compared.iter().map(Comparison::differences));
            let names: Vec<String> = rungs.iter().map(Rung::name).collect();
            compared_text = measured::table(log, names.iter().map(String::as_str), &differences);
            data = data.with_log(log.clone(), differences);
        }
        page.write_whole(&report::render(&data, live.as_ref())?)?;
        let name = &first.case.name;
        for rung in &rungs {
            warn(&format!("{name}: rung {}", rung.name()), rung.warnings());
        }
        warn(name, keys_without_effect(&cases));
        warn(name, values_of_template(&first.case));
        if self.json {
            terminal::print_json(&rungs.iter().map(json_of).collect::<Vec<_>>())?;
            terminal::print_error(&compared_text);
        } else {
            terminal::print_beside(&self.outputs(), &(table(&rungs) + &compared_text))?;
        }
        if self.report.as_os_str() != "-" {
            tell!("plots: {}\n", self.report.display());
        }
        Ok(rungs)
    }

    /// The case with each law, checked as if the run file had asked for it.
    fn load_rungs(&self) -> anyhow::Result<Vec<RunFile>> {
        // What is wrong on any rung is said without naming one.
        let asked = self.sets.load_one(&self.case)?;
        let mut sets = self.sets.clone();
        if self.link.is_some()
            && asked.case.controller.computation_delay == ComputationDelay::Measured
        {
            // No rung on this host has a time of its own: the chip adds it.
            sets = sets.and("controller.computation_delay_s=0".to_owned());
        }
        let load = |law: Law| {
            let file = sets.and(on_rung(law)).load_one(&self.case);
            file.with_context(|| format!("rung {}", law.name()))
        };
        Law::ALL.into_iter().map(load).collect()
    }

    fn command_line(&self) -> String {
        let link = self.link.as_ref().map(ToString::to_string);
        let log = self.log.words();
        let words = ["ladder", &self.case]
            .into_iter()
            .chain(log.iter().map(String::as_str))
            .chain(each_with("--set", &self.sets.sets))
            .chain(each_with("--link", &link));
        command_line(words)
    }
}

/// The override that asks for a rung.
fn on_rung(law: Law) -> String {
    format!("controller.law={}", law.name())
}

/// A rung as JSON.
fn json_of(rung: &Rung) -> Value {
    json!({
        "rung": rung.name(),
        "adds": rung.adds(),
        "difference_to_rung_below": rung.difference,
        "summary": rung.outcome.summary,
    })
}

/// The rungs of a ladder.
fn table(rungs: &[Rung]) -> String {
    let header = "rung|adds|peak acc\nm/s²|following\nerror mm|final\nerror µm|contact\nchanges\
    |rms Δacc\nm/s²|rms Δx\nµm";
    let rows = rungs.iter().map(|rung| {
        let figure = |key: &str| rung.outcome.summary.shown(key);
        let [acc_digits, position_digits] = rung.difference_digits;
        [
            rung.name(),
            rung.adds().to_owned(),
            figure("peak_abs_acc_mps2"),
            figure("peak_following_error_mm"),
            figure("final_error_um"),
            figure("contact_changes"),
            number::shown(rung.difference.map(|d| d.rms_acc_mps2), acc_digits),
            number::shown(rung.difference.map(|d| d.rms_position_um), position_digits),
        ]
    });
    terminal::table(header.split('|'), 2, rows)
}
