//! The needs of several verbs: cases with their overrides, remarks, errors in the
//! words of the run file.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use hil_core::case::Law;
use hil_core::error::RunError;
use hil_core::runfile::{self, RunFile};
use hil_runner::files;
use hil_runner::files::output::same_file;

use super::terminal::tell;

// A documented structure would put its words into the help of every verb.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct Sets {
    /// Override a key of the run file; the value is TOML, a bare word a string
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    pub(super) sets: Vec<String>,
}

// As above.
#[derive(Debug, Default, Args)]
pub(super) struct Cases {
    /// Run files or built-in cases (paper-1 … paper-4, paper-2-12bit)
    #[arg(required = true)]
    pub(super) cases: Vec<String>,
}

impl Sets {
    /// Reads the run files; all that is wrong with any of them in one message.
    pub(super) fn load(&self, cases: &[String]) -> anyhow::Result<Vec<RunFile>> {
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
    pub(super) fn load_one(&self, case: &str) -> anyhow::Result<RunFile> {
        let files = self.load(&[case.to_owned()])?;
        files.into_iter().next().context("a case has a file")
    }

    /// The same with one override more, which comes last.
    pub(super) fn and(&self, set: String) -> Self {
        let sets = self.sets.iter().cloned().chain([set]);
        Self {
            sets: sets.collect(),
        }
    }
}

/// Refuses every law but the firmware's.
pub(super) fn refuse_other_laws(files: &[RunFile], because: &str) -> anyhow::Result<()> {
    let other = |file: &&RunFile| file.case.controller.law != Law::Firmware;
    if let Some(file) = files.iter().find(other) {
        let because = format!("{because}; the law must be \"firmware\"");
        bail!("{}", file.refuse("controller", "law", &because));
    }
    Ok(())
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

/// The folder of the outputs that nobody has given a path for.
pub(super) fn make_out_folder() -> anyhow::Result<()> {
    std::fs::create_dir_all("out").context("the folder out cannot be made")
}

/// The error of a run of this file as the user should read it.
pub(super) fn explain(file: &RunFile, error: RunError) -> anyhow::Error {
    anyhow::Error::msg(hil_core::explain::explain(file, &error))
}

/// Tells on stderr what the user should know besides the figures.
pub(super) fn warn(name: &str, warnings: impl IntoIterator<Item = impl std::fmt::Display>) {
    for warning in warnings {
        tell(&format!("{name}: warning: {warning}\n"));
    }
}
