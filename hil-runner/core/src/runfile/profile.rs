//! The points of a profile, from a CSV file beside the run file.

use std::path::{Path, PathBuf};

use csv::{ReaderBuilder, StringRecord};

use super::errors::one_line;
use super::keys::LARGEST_MAGNITUDE;

/// Reader of a file that a run file names: the run file's own name and the path that
/// it gives, relative to it, make the text or a sentence that says why there is none.
pub type Beside = fn(run_file: &str, path: &str) -> Result<String, String>;

/// The file at a path that a run file gives: relative to the folder of the run file.
pub fn file_beside(run_file: &str, path: &str) -> PathBuf {
    let folder = Path::new(run_file).parent();
    folder.unwrap_or(Path::new("")).join(path)
}

/// Of a run file without a folder.
pub(super) fn nothing_beside(_: &str, _: &str) -> Result<String, String> {
    Err("it cannot be read here; a run file on disk may name files".to_owned())
}

/// The line of a record of `text`, from 1: a reader's position is before the empty lines that
/// it passes over.
pub(crate) fn csv_line(text: &str, position: Option<&csv::Position>) -> u64 {
    let Some(position) = position else { return 1 };
    let start = usize::try_from(position.byte()).unwrap_or(0);
    let rest = text.as_bytes().get(start..).unwrap_or_default();
    let empty = rest.iter().take_while(|byte| b"\r\n".contains(byte));
    position.line() + empty.filter(|byte| **byte == b'\n').count() as u64
}

const COLUMNS: [&str; 2] = ["t_s", "x_mm"];

/// Time \[s\] and displacement \[m\] of every point in the text of the file at `path`.
///
/// # Errors
/// The sentence that names file, line, column and what is allowed.
pub(super) fn points(path: &str, text: &str) -> Result<Vec<(f64, f64)>, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(text.as_bytes());
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (place, record) in reader.records().enumerate() {
        let record = record.map_err(|error| format!("{path}: {error}"))?;
        let line = csv_line(text, record.position());
        let located = |because: String| format!("{path}:{line}: {because}");
        let refuse = |because| Err(located(because));
        let shown = || one_line(&record.iter().collect::<Vec<_>>().join(","), 60);
        if place == 0 {
            if !record.iter().map(str::trim).eq(COLUMNS) {
                return refuse(format!("the columns must be t_s,x_mm, not {}", shown()));
            }
            continue;
        }
        if record.len() != COLUMNS.len() {
            return refuse(format!("{} must be two numbers t_s,x_mm", shown()));
        }
        let number = |column| finite(&record, column).map_err(located);
        let (t_s, x_mm) = (number(0)?, number(1)?);
        match points.last() {
            None if (t_s, x_mm) != (0.0, 0.0) => {
                return refuse(format!("the first row must be 0,0, not {}", shown()));
            }
            Some((last_s, _)) if t_s <= *last_s => {
                return refuse(format!(
                    "t_s = {t_s} must be greater than {last_s}, that of the row before"
                ));
            }
            _ => points.push((t_s, 1e-3 * x_mm)),
        }
    }
    match points.len() {
        0 | 1 => Err(format!(
            "{path}: a profile needs the columns t_s,x_mm and at least two rows"
        )),
        _ => Ok(points),
    }
}

/// # Errors
/// The sentence that says what the number must be.
fn finite(record: &StringRecord, column: usize) -> Result<f64, String> {
    let text = record.get(column).unwrap_or_default().trim();
    let number = text.parse::<f64>().ok();
    let number = number.filter(|number| number.abs() <= LARGEST_MAGNITUDE);
    number.ok_or_else(|| {
        let (name, text) = (COLUMNS[column], one_line(text, 60));
        format!("{name} = {text} is not allowed: it must be a number from -1e50 to 1e50")
    })
}
