//! `hil-runner schema`: the JSON schema of run files.

use clap::Args;
use hil_core::runfile;

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
        super::terminal::print(&format!("{schema}\n"))?;
        Ok(true)
    }
}
