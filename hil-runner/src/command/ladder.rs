//! `hil-runner ladder`: one case on every rung.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use hil_core::case::{Case, ComputationDelay, Law};
use hil_core::case_run::keys_without_effect;
use hil_core::ladder::{climb, climb_over, confirm};
use hil_core::run::RunOptions;
use hil_core::runfile::RunFile;
use hil_runner::chip::spec::ChipLink;
use hil_runner::command_line::{command_line, each_with};
use hil_runner::output::OutputFile;
use hil_runner::report;

use super::explain;
use super::link::OpenChip;
use super::progress::Progress;
use super::terminal;

const REPORT: &str = "out/ladder.html";

/// Run one case on every rung and show what each rung adds
///
/// Each rung adds one effect to the one below it, so the difference of two
/// neighbours is what that effect costs: sampling, encoder and DAC steps,
/// word lengths. Differences are taken on common 1 ms rows. A ladder judges
/// nothing: budgets are for `run`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
                  hil-runner ladder paper-1\n  \
                  hil-runner ladder paper-1 --link qemu:m0\n  \
                  hil-runner ladder axis.toml --report out/axis-ladder.html --set controller.sample_time_s=2e-4")]
pub(crate) struct Ladder {
    /// Run file or built-in case
    case: String,
    /// Page with the plots
    #[arg(long, value_name = "F.html", default_value = REPORT)]
    report: PathBuf,
    /// A chip for one rung more: qemu[:m4|m0|m3|rv32], qemu-uart[:…] or serial:PORT[@BAUD]
    #[arg(long, value_name = "LINK")]
    link: Option<ChipLink>,
    /// Override a key of the run file; the value is TOML, a bare word a string
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,
}

impl Ladder {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let files = self.load_rungs()?;
        super::run::refuse_shared_paths(std::slice::from_ref(&self.case), &[&self.report])?;
        // The folder that this program makes by itself.
        if self.report.parent() == Path::new(REPORT).parent() {
            std::fs::create_dir_all("out").context("the folder out cannot be made")?;
        }
        let mut page = OutputFile::create(&self.report)?;
        let mut chip = self.link.as_ref().map(OpenChip::open).transpose()?;
        let on_chip = self.case_on_chip()?;
        let cases: Vec<Case> = files.iter().map(|file| file.case.clone()).collect();
        let first = files.first().context("a ladder has rungs")?;
        let mut progress = Progress::of(&first.case);
        let mut sink = |row: &_| progress.row(row);
        // The needles of the acceleration stand between the common rows.
        let options = RunOptions {
            plot: true,
            ..RunOptions::default()
        };
        let mut rungs = climb(&cases, options, &mut sink);
        if let (Ok(rungs), Some(chip), Some(case)) = (&mut rungs, &mut chip, &on_chip) {
            let climbed = chip
                .law(case)
                .and_then(|mut law| climb_over(rungs, case, options, &mut law, &mut sink));
            if let Err(error) = climbed {
                drop(progress);
                return Err(explain(files.last().unwrap_or(first), error));
            }
        }
        drop(progress);
        let mut progress = Progress::labelled(&first.case, &format!("{}, again", first.case.name));
        let mut sink = |row: &_| progress.row(row);
        let rungs = rungs.and_then(|mut rungs| {
            confirm(&mut rungs, &cases, &mut sink)?;
            Ok(rungs)
        });
        drop(progress);
        let rungs = rungs.map_err(|(number, error)| {
            let Some(file) = files.get(number) else {
                return anyhow!("{error}");
            };
            let rung = format!("rung {}", file.case.controller.law.name());
            explain(file, error).context(rung)
        })?;
        let data = hil_core::report::ladder_report(&self.command_line(), &rungs);
        page.write_all(report::render(&data)?.as_bytes())?;
        page.commit()?;
        for rung in &rungs {
            let (case, law) = (&rung.case.name, rung.name());
            for warning in rung.warnings() {
                terminal::tell(&format!("{case}: rung {law}: warning: {warning}\n"));
            }
        }
        if let (Some(warning), Some(case)) = (keys_without_effect(&cases), cases.first()) {
            terminal::tell(&format!("{}: warning: {warning}\n", case.name));
        }
        if self.report.as_os_str() == "-" {
            terminal::tell(&terminal::ladder_table(&rungs));
        } else {
            terminal::print(&terminal::ladder_table(&rungs))?;
            terminal::tell(&format!("plots: {}\n", self.report.display()));
        }
        Ok(true)
    }

    /// The case that the chip gets: the one that was asked for, on rung
    /// `firmware`.
    fn case_on_chip(&self) -> anyhow::Result<Option<Case>> {
        let mut sets = self.sets.clone();
        sets.push(format!("controller.law={}", Law::Firmware.name()));
        let files = super::run::load(std::slice::from_ref(&self.case), &sets)?;
        Ok(files.into_iter().next().map(|file| file.case))
    }

    /// The case with each law, checked as if the run file had asked for it.
    fn load_rungs(&self) -> anyhow::Result<Vec<RunFile>> {
        // What is wrong on any rung is said without naming one.
        let asked = super::run::load(std::slice::from_ref(&self.case), &self.sets)?;
        let mut files = Vec::with_capacity(Law::ALL.len());
        for law in Law::ALL {
            let mut sets = self.sets.clone();
            if self.link.is_some() && asked.iter().any(is_measured) {
                // No rung on this host has a time of its own: the chip adds it.
                sets.push("controller.computation_delay_s=0".to_owned());
            }
            sets.push(format!("controller.law={}", law.name()));
            let rung = super::run::load(std::slice::from_ref(&self.case), &sets)
                .with_context(|| format!("rung {}", law.name()))?;
            files.extend(rung);
        }
        Ok(files)
    }

    fn command_line(&self) -> String {
        let link = self.link.as_ref().map(ToString::to_string);
        let words = ["ladder", &self.case]
            .into_iter()
            .chain(each_with("--set", &self.sets))
            .chain(each_with("--link", &link));
        command_line(words)
    }
}

/// Whether the delay is that of each step.
fn is_measured(file: &RunFile) -> bool {
    file.case.controller.computation_delay == ComputationDelay::Measured
}
