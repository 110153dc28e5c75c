//! `hil-runner schema`: JSON schemas for editors, and the line of a file that names its
//! own.

use clap::{Args, ValueEnum};
use hil_core::runfile;
use hil_runner::study;

use super::terminal::print_json;

/// Print the JSON schema of run files or study files
///
/// Editors that know TOML complete and check a file with it. The files of `init` and of
/// `study --print` name the schema in their first line, beside themselves.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  hil-runner schema > run-file.schema.json\n  \
    hil-runner schema study > study.schema.json"
)]
pub(crate) struct Schema {
    /// The files that it is of
    #[arg(value_enum, default_value_t = SchemaOf::RunFile)]
    of: SchemaOf,
}

/// Files that have a schema.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum SchemaOf {
    /// Run files
    RunFile,
    /// Study files
    Study,
}

impl SchemaOf {
    /// The first line of a file: the place of its schema, for editors, and how it gets
    /// there.
    pub(super) fn line(self) -> String {
        let (words, name) = match self {
            Self::RunFile => ("schema", "run-file.schema.json"),
            Self::Study => ("schema study", "study.schema.json"),
        };
        format!(
            "#:schema ./{name}\n\
             # Editors look for the schema there; hil-runner {words} > {name} makes it.\n\n"
        )
    }
}

impl Schema {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        print_json(&match self.of {
            SchemaOf::RunFile => runfile::schema(),
            SchemaOf::Study => study::schema(),
        })?;
        Ok(true)
    }
}
