//! `hil-runner study OUT --row N`: one row of a study's results as a run of its
//! own, from what lies in the folder alone.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::bail;
use hil_core::runfile::Template;
use hil_runner::output::same_file;
use hil_runner::study::results::Origin;

use super::run::Run;
use super::terminal;

/// Makes report and trace of a row, beside the results unless a path is given;
/// whether the run passes.
pub(super) fn execute(
    folder: &Path,
    number: u64,
    report: Option<PathBuf>,
    trace: Option<PathBuf>,
) -> anyhow::Result<bool> {
    let origin = Origin::read(folder)?;
    let study = origin.study(folder)?;
    let (name, rows) = (&study.name, study.rows());
    if number >= rows {
        bail!(
            "row {number} is not allowed: the rows of study {name} are 0 to {}",
            rows - 1
        );
    }
    let row = study.planned_row(number);
    if let Err((status, reason)) = row.case {
        bail!(
            "row {number} of study {name} is {}: {reason}",
            status.name()
        );
    }
    let mut sets = study.row_sets(&row.point, row.rung);
    sets.push(format!("name={name} row {number}"));
    let beside = |extension: &str| folder.join(format!("row-{number}.{extension}"));
    let report = report.unwrap_or_else(|| beside("html"));
    let trace = trace.unwrap_or_else(|| beside("csv"));
    refuse_results(folder, &[&report, &trace])?;
    let written = format!(
        "plots and all figures: {}\ntrace: {}\n",
        report.display(),
        trace.display()
    );
    let base = folder.join("base.toml").to_string_lossy().into_owned();
    let file = Template::parse(&base, &origin.base_text, &sets)?.into_file();
    let run = Run::of_row(base, sets, report, trace);
    let passes = run.make(&[file])?;
    let text = written + &format!("the same run: {}\n", run.command_line());
    if run.has_data_on_stdout() {
        terminal::tell(&text);
    } else {
        terminal::print(&text)?;
    }
    Ok(passes)
}

/// What lies in the folder is not to be replaced, but for files of rows.
fn refuse_results(folder: &Path, outputs: &[&PathBuf]) -> anyhow::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let of_row = path
            .file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with("row-"));
        if !of_row && let Some(output) = outputs.iter().find(|output| same_file(output, &path)) {
            let output = output.display();
            bail!("{output} is part of the results of the study; an output would replace it");
        }
    }
    Ok(())
}
