//! `hil-runner live`: a page with the simulator of a case.

use std::path::{Path, PathBuf};
use std::slice::from_ref;

use clap::Args;
use hil_runner::files::OutputFile;

use super::options::{Sets, live, live_case, make_out_folder, refuse_replaced};
use super::terminal::print_beside;

/// Make a page in which every key of a case can be moved: the simulator in one file
///
/// Firmware and axis run in the page as WebAssembly, with the figures of `run` to the last bit.
/// It loads nothing and needs no network; a file to be mailed or to lie on any server.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/live.txt").trim_ascii_end())]
pub(crate) struct LivePage {
    /// Run file, built-in case or `-`, a run file from standard input
    case: String,
    /// The page; `-` is standard output [default: out/NAME-live.html]
    #[arg(long, value_name = "F.html")]
    out: Option<PathBuf>,
    #[command(flatten)]
    sets: Sets,
}

impl LivePage {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let file = self.sets.load_one(&self.case)?;
        let name = file.case.name.replace(['/', '\\'], "_");
        let usual = || Path::new("out").join(format!("{name}-live.html"));
        let out = self.out.clone().unwrap_or_else(usual);
        refuse_replaced(&[&out], from_ref(&self.case), from_ref(&file), None)?;
        if self.out.is_none() {
            make_out_folder()?;
        }
        let page = OutputFile::create(&out)?;
        let live = live(live_case(&self.case, &self.sets)?)?;
        let html = live.page()?;
        page.write_whole(&html)?;
        let (place, kilobytes) = (out.display(), html.len() / 1000);
        let told = format!("{place}: {kilobytes} kB, open it in a browser\n");
        print_beside(&[&out], &told)?;
        Ok(true)
    }
}
