//! The file of a trace: CSV, or Parquet where its name ends so.

use std::io::{self, Error};
use std::path::Path;

use hil_core::trace::{Row, TraceWriter, Value};
use hil_runner::files::OutputFile;
use hil_runner::study::results::Parquet;
use hil_runner::study::{Cell, Column, ColumnKind};

/// A trace that appears under its name when it is finished.
#[derive(Debug)]
pub(super) enum TraceFile {
    Csv(TraceWriter<OutputFile>),
    /// A file until the first row, which has the columns.
    Parquet(Option<OutputFile>, Option<Parquet<OutputFile>>),
}

impl TraceFile {
    /// Prepares to write to a path.
    ///
    /// # Errors
    /// As [`OutputFile::create`].
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        let file = OutputFile::create(path)?;
        let extension = path.extension().unwrap_or_default();
        Ok(match extension.eq_ignore_ascii_case("parquet") {
            true => Self::Parquet(Some(file), None),
            false => Self::Csv(TraceWriter::new(file)),
        })
    }

    /// Writes one row.
    pub(super) fn row(&mut self, row: &Row) -> io::Result<()> {
        match self {
            Self::Csv(csv) => csv.row(row),
            Self::Parquet(file, rows) => {
                if let Some(file) = file.take() {
                    let columns: Vec<Column> = row.columns().map(column).collect();
                    let begun = Parquet::new(file, "trace", &columns, &[]);
                    *rows = Some(begun.map_err(Error::other)?);
                }
                let cells: Vec<Cell> = row.columns().map(|(_, value)| cell(value)).collect();
                let added = rows.as_mut().map_or(Ok(()), |rows| rows.add(&cells));
                added.map_err(Error::other)
            }
        }
    }

    /// Makes the rows so far appear; without any, nothing is replaced.
    pub(super) fn finish(self) -> io::Result<()> {
        match self {
            Self::Csv(csv) if !csv.is_empty() => csv.finish()?.commit(),
            Self::Parquet(_, Some(rows)) => rows.finish().map_err(Error::other)?.commit(),
            _ => Ok(()),
        }
    }
}

fn column((name, value): (&'static str, Value)) -> Column {
    Column {
        name: name.to_owned(),
        kind: match value {
            Value::Number(_) => ColumnKind::Number,
            Value::Whole(_) => ColumnKind::Whole,
            Value::Word(_) => ColumnKind::Text,
        },
    }
}

fn cell(value: Value) -> Cell {
    match value {
        Value::Number(number) => Cell::number(number),
        Value::Whole(whole) => Cell::number(f64::from(whole)),
        Value::Word(word) => Cell::text(word),
    }
}
