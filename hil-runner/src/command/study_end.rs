//! What a study shows once all its rows are there.

use std::io::Write;
use std::path::Path;

use anyhow::bail;
use hil_core::number;
use hil_runner::output::OutputFile;
use hil_runner::study::{
    MOST_ROWS, Study, Tally, base_sentences, best_table, draw, enough_pass, figure_rows, page,
    render, unstable_words,
};

use super::terminal;

/// Prints the table, writes pictures and report; whether enough runs pass.
pub(super) fn finish(
    study: &Study,
    folder: &Path,
    tally: &Tally,
    command_line: &str,
) -> anyhow::Result<bool> {
    let words: Vec<String> = base_sentences(study)
        .into_iter()
        .map(|sentence| sentence + "\n")
        .collect();
    terminal::print(&words.concat())?;
    terminal::print(&table(tally))?;
    for warning in study.warnings() {
        terminal::tell(&format!("{}: warning: {warning}\n", study.name));
    }
    let drawn = draw(study, &tally.pictures);
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
    if tally.rungs.iter().all(|rung| rung.made == 0) {
        bail!(
            "no run of the study could be made; {} says why of every row",
            folder.join("results.csv").display()
        );
    }
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
        if let Some(words) = unstable_words(rung) {
            text += &(words + "\n");
        }
    }
    let best = best_table(tally);
    if !best.rows.is_empty() {
        text += "best of the runs within all limits, by what is left of the tightest\n";
        let heads: Vec<&str> = best.heads.iter().map(String::as_str).collect();
        let mut table = terminal::table(&heads, 1);
        for cells in best.rows {
            table.add_row(cells);
        }
        text += &terminal::text(&table);
    }
    text
}
