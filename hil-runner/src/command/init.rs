//! `hil-runner init`: a run file to start from.

use anyhow::bail;
use clap::Args;
use hil_core::runfile;

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
        super::terminal::print(&runfile::commented(&self.case, text))?;
        Ok(true)
    }
}
