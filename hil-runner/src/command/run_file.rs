//! `hil-runner init` and `hil-runner schema`: run files to start from, and what
//! may stand in them.

use anyhow::bail;
use clap::Args;
use hil_core::runfile;

use super::terminal;

/// Print a commented run file to start from
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  hil-runner init paper-4 > axis.toml")]
pub(crate) struct Init {
    /// Built-in case to start from
    #[arg(default_value = "paper-2")]
    case: String,
}

impl Init {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let Some(text) = runfile::builtin_text(&self.case) else {
            let names: Vec<&str> = runfile::builtin_names().collect();
            bail!(
                "there is no built-in case {:?}; there are {}",
                self.case,
                names.join(", ")
            );
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
pub(crate) struct Schema {}

impl Schema {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let schema = serde_json::to_string_pretty(&runfile::schema())?;
        terminal::print(&format!("{schema}\n"))?;
        Ok(true)
    }
}
