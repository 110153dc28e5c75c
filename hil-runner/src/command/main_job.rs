//! Without a command: the paper's four simulations on the firmware rung.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use hil_core::case_run::CaseRun;
use hil_core::run::RunOptions;
use hil_runner::channel::LinkKind;
use hil_runner::output::OutputFile;
use hil_runner::report;
use hil_runner::timing::timed_run;

use super::explain;
use super::progress::Progress;
use super::terminal;

const CASES: [&str; 4] = ["paper-1", "paper-2", "paper-3", "paper-4"];
const REPORT: &str = "out/report.html";

pub(crate) fn execute() -> anyhow::Result<bool> {
    let folder = Path::new("out");
    std::fs::create_dir_all(folder).with_context(|| "the folder out cannot be made".to_owned())?;
    let mut page = OutputFile::create(Path::new(REPORT))?;
    let options = RunOptions {
        plot: true,
        ..RunOptions::default()
    };
    let mut runs = Vec::with_capacity(CASES.len());
    for file in super::run::load(&CASES.map(str::to_owned), &[])? {
        let mut progress = Progress::of(&file.case);
        let run = timed_run(&file.case, LinkKind::InProcess, options, &mut |row| {
            progress.row(row)
        });
        drop(progress);
        let mut run = run.map_err(|error| explain(&file, error))?;
        super::confirm(&mut run, options).map_err(|error| explain(&file, error))?;
        runs.push(run);
    }
    let title = "The paper's four simulations";
    let data = hil_core::report::report(title, "hil-runner", &runs);
    page.write_all(report::render(&data)?.as_bytes())?;
    page.commit()?;
    terminal::print(
        &(terminal::figure_table(&runs)
            + &terminal::verdict_table(&runs)
            + &terminal::word_tables(&runs)
            + &terminal::timing_lines(&runs)
            + &format!("plots and all figures: {REPORT}\n")),
    )?;
    super::warn(&runs);
    Ok(runs.iter().all(CaseRun::passes))
}
