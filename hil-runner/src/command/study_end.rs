//! What a study shows once all its rows are there.

use std::io::Write;
use std::path::Path;

use hil_runner::output::OutputFile;
use hil_runner::report::number;
use hil_runner::study::report::render;
use hil_runner::study::{MOST_ROWS, Study, Tally, columns, draw, enough_pass, figure_rows, page};

use super::terminal;

/// Prints the table, writes pictures and report; whether enough runs pass.
pub(super) fn finish(
    study: &Study,
    folder: &Path,
    tally: &Tally,
    command_line: &str,
) -> anyhow::Result<bool> {
    terminal::print(&table(tally))?;
    if let Some(warning) = study.keys_without_effect() {
        terminal::tell(&format!("{}: warning: {warning}\n", study.name));
    }
    let drawn = draw(study, folder, &columns(study))?;
    if study.rows() > MOST_ROWS && !drawn.is_empty() {
        terminal::tell(&format!("the pictures show the first {MOST_ROWS} rows\n"));
    }
    for drawn in &drawn {
        match &drawn.svg {
            Ok(svg) => write(&folder.join(format!("{}.svg", drawn.picture.file)), svg)?,
            Err(error) => terminal::tell(&format!("{error}\n")),
        }
    }
    let report = folder.join("report.html");
    write(&report, &render(&page(study, tally, &drawn, command_line))?)?;
    terminal::print(&format!(
        "pictures, plan and all figures: {}\n",
        report.display()
    ))?;
    let enough = enough_pass(study, tally).unwrap_or(true);
    if let (false, Some(required)) = (enough, study.required_yield_percent) {
        terminal::print(&format!(
            "FAIL: less than the required {} % are within the limits\n",
            number::table(required)
        ))?;
    }
    Ok(enough)
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    let mut file = OutputFile::create(path)?;
    file.write_all(text.as_bytes())?;
    file.commit()?;
    Ok(())
}

/// For each rung what its runs span.
fn table(tally: &Tally) -> String {
    let mut text = String::new();
    for rung in &tally.rungs {
        let percent = rung.yield_percent();
        let percent = percent.map_or_else(|| number::MISSING.to_owned(), number::table);
        text += &format!(
            "{}: {} of {} runs within the limits ({percent} %)",
            rung.rung,
            rung.passed,
            rung.made + rung.not_made
        );
        if rung.excluded > 0 {
            text += &format!(", {} left out by a constraint", rung.excluded);
        }
        text += "\n";
        if let Some((row, reason)) = &rung.first_reason {
            text += &format!("{} not made; row {row}: {reason}\n", rung.not_made);
        }
        let header = [
            "figure", "least", "in row", "mean", "most", "in row", "unit", "none",
        ];
        let mut table = terminal::table(&header, 1);
        for cells in figure_rows(rung) {
            table.add_row(cells);
        }
        text += &terminal::text(&table);
    }
    text
}
