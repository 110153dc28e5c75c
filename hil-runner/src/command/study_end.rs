//! What a study shows once all its rows are there.

use std::io::Write;
use std::path::Path;

use hil_runner::figures;
use hil_runner::output::OutputFile;
use hil_runner::report::number;
use hil_runner::study::{Study, Tally, columns, draw};

use super::terminal;

/// Prints the table; whether enough runs pass.
pub(super) fn finish(
    study: &Study,
    folder: &Path,
    tally: &Tally,
    _command_line: &str,
) -> anyhow::Result<bool> {
    terminal::print(&table(tally))?;
    for drawn in draw(study, folder, &columns(study))? {
        let path = folder.join(format!("{}.svg", drawn.picture.file));
        match &drawn.svg {
            Ok(svg) => {
                let mut file = OutputFile::create(&path)?;
                file.write_all(svg.as_bytes())?;
                file.commit()?;
            }
            Err(error) => terminal::tell(&format!("{error}\n")),
        }
    }
    let enough = study.required_yield_percent.is_none_or(|required| {
        tally
            .yield_percent()
            .is_some_and(|percent| percent >= required)
    });
    terminal::print(&format!("results: {}\n", folder.display()))?;
    Ok(enough)
}

fn table(tally: &Tally) -> String {
    let mut text = String::new();
    for rung in &tally.rungs {
        let percent = rung
            .yield_percent()
            .map_or_else(|| number::MISSING.to_owned(), number::table);
        text += &format!(
            "{}: {} runs, {} within the limits ({percent} %)",
            rung.rung, rung.made, rung.passed
        );
        if rung.excluded > 0 {
            text += &format!(", {} left out by a constraint", rung.excluded);
        }
        text += "\n";
        if let Some((row, reason)) = &rung.first_reason {
            text += &format!("{} not made; row {row}: {reason}\n", rung.not_made);
        }
        let mut table = terminal::table(
            &[
                "figure", "least", "in row", "mean", "most", "in row", "unit", "none",
            ],
            1,
        );
        for figure in &rung.figures {
            let (Some(least), Some(mean), Some(most)) = (figure.least, figure.mean(), figure.most)
            else {
                continue;
            };
            table.add_row([
                figure.column.clone(),
                number::table(least.0),
                least.1.to_string(),
                number::table(mean),
                number::table(most.0),
                most.1.to_string(),
                figures::unit(&figure.column).to_owned(),
                figure.empty.to_string(),
            ]);
        }
        text += &terminal::text(&table);
    }
    text
}
