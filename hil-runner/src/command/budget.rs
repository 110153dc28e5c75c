//! `hil-runner budget`: what the controller costs on each target, held against
//! what it has cost before.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use hil_core::case::TargetSettings;
use hil_runner::chip::budget::goldens::{self, Goldens};
use hil_runner::chip::budget::{TargetFigures, measure};
use hil_runner::chip::image::Finder;
use hil_runner::chip::installed;
use hil_runner::chip::spec::{Target, Transport};
use hil_runner::output::OutputFile;

use super::{budget_tables, terminal};

/// Measure what the controller costs on chips, and hold it against the goldens
///
/// Counts the instructions of every sample in QEMU: of axes that are constants
/// of an image, feature by feature, and of an axis that comes in words, state by
/// state; asks the images for their flash, RAM and deepest stack. Figures beyond
/// the tolerance of firmware/cortex-m/goldens/<TARGET>.toml fail, better ones too.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit status: 0 all figures are within their tolerance, 1 one is not, 2 a target could not be run.\n\n\
                  Examples:\n  \
                  hil-runner budget\n  \
                  hil-runner budget m4 m0\n  \
                  hil-runner budget m4 --bless"
)]
pub(crate) struct Budget {
    /// Targets: m4, m0, m3, rv32; without any, all that can be run in QEMU here
    #[arg(value_name = "TARGET", value_parser = target)]
    targets: Vec<Target>,
    /// Write the figures down as the new goldens, and say what has changed
    #[arg(long)]
    bless: bool,
    /// The folder of the goldens, in place of the project's
    #[arg(long, value_name = "FOLDER")]
    goldens: Option<PathBuf>,
}

fn target(name: &str) -> Result<Target, String> {
    let known = Target::ALL.into_iter().find(|target| target.name() == name);
    known.ok_or_else(|| format!("{name} is no target; it must be m4, m0, m3 or rv32"))
}

impl Budget {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let folder = self.goldens.clone().unwrap_or_else(goldens_folder);
        let mut pass = true;
        for target in self.here()? {
            let mut tell = |text: &str| terminal::tell(&format!("{text}\n"));
            let measured = measure(target, TargetSettings::default(), &mut tell)
                .with_context(|| target.name())?;
            let path = folder.join(format!("{}.toml", target.name()));
            let known = Goldens::read(&path)?;
            if self.bless {
                bless(&measured, &known, &path)?;
                continue;
            }
            let judgements = known.judge(&measured.figures);
            terminal::print(&budget_tables::tables(&measured, &judgements))?;
            if judgements.iter().any(|judgement| !judgement.pass) {
                pass = false;
                terminal::tell(&format!(
                    "{}: not as in {}; `hil-runner budget {0} --bless` writes down what is meant \
                     to stay\n",
                    target.name(),
                    path.display()
                ));
            }
        }
        Ok(pass)
    }

    /// The targets to measure. One that was named must be there; of the others
    /// it is told what they lack.
    fn here(&self) -> anyhow::Result<Vec<Target>> {
        let mut here = Vec::new();
        for (target, there) in installed(Transport::Fifo) {
            let named = self.targets.contains(&target);
            match there {
                Ok(()) if named || self.targets.is_empty() => here.push(target),
                Ok(()) => {}
                Err(error) if named => bail!("{}: {error}", target.name()),
                Err(error) if self.targets.is_empty() => {
                    terminal::tell(&format!("{} is left out: {error}\n", target.name()));
                }
                Err(_) => {}
            }
        }
        if here.is_empty() {
            bail!("no target can be run here");
        }
        Ok(here)
    }
}

/// The goldens among the firmware's sources.
fn goldens_folder() -> PathBuf {
    let project = Finder::from_environment().project;
    project.join("firmware").join("cortex-m").join("goldens")
}

/// Writes the goldens, and what is no longer as it was.
fn bless(measured: &TargetFigures, known: &Goldens, path: &Path) -> anyhow::Result<()> {
    let name = measured.target.name();
    let text = goldens::text(measured.target, &measured.figures);
    let mut file = OutputFile::create(path)?;
    file.write_all(text.as_bytes())?;
    file.commit()?;
    let judgements = known.judge(&measured.figures);
    let changes = budget_tables::changes(measured.target, &judgements);
    let changes = if changes.is_empty() {
        format!("{name}: nothing has changed\n")
    } else {
        changes
    };
    Ok(terminal::print(&changes)?)
}
