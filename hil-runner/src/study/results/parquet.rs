//! Rows as Apache Parquet, in groups of 32,768: those of results once more,
//! `results.parquet`, which appears under its name when it is complete.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};

use super::{ResultsError, io};
use crate::study::rows::cell::{Cell, Column, ColumnKind};

/// Rows of a group.
const GROUP_ROWS: usize = 32_768;

/// One column in the group that is being filled: values of its kind, and for
/// every row 1 where one is there, 0 where the cell is empty.
#[derive(Debug, Default)]
struct Filled {
    kind: ColumnKind,
    numbers: Vec<f64>,
    whole: Vec<i64>,
    flags: Vec<bool>,
    texts: Vec<ByteArray>,
    levels: Vec<i16>,
}

impl Filled {
    fn of(kind: ColumnKind) -> Self {
        Self {
            kind,
            ..Self::default()
        }
    }

    fn add(&mut self, cell: &Cell) {
        match (self.kind, cell) {
            (ColumnKind::Number, Cell::Number(number)) => self.numbers.push(*number),
            // A value that its key refuses may be too large: the reason has it.
            (ColumnKind::Whole, cell) => match cell.as_whole() {
                Some(whole) => self.whole.push(whole),
                None => return self.levels.push(0),
            },
            (ColumnKind::Flag, Cell::Flag(flag)) => self.flags.push(*flag),
            (ColumnKind::Text, Cell::Text(text)) => {
                self.texts.push(text.as_bytes().to_vec().into())
            }
            _ => return self.levels.push(0),
        }
        self.levels.push(1);
    }
}

/// Writes rows of cells in their order.
#[derive(Debug)]
pub struct Parquet<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    columns: Vec<Filled>,
    rows: usize,
}

impl<W: Write + Send> Parquet<W> {
    /// Begins a file with these columns, which says of itself its name and what the
    /// metadata have.
    ///
    /// # Errors
    /// Whatever the sink reports.
    pub fn new(
        sink: W,
        name: &str,
        columns: &[Column],
        metadata: &[(&str, String)],
    ) -> Result<Self, ParquetError> {
        let filled = |column: &Column| Filled::of(column.kind);
        let pair = |(key, value): &(&str, String)| KeyValue::new((*key).to_owned(), value.clone());
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by("hil-runner".to_owned())
            // Numbers hardly ever repeat: a dictionary would cost more time than
            // it saves space.
            .set_dictionary_enabled(false)
            .set_key_value_metadata(Some(metadata.iter().map(pair).collect()))
            .build();
        Ok(Self {
            writer: SerializedFileWriter::new(sink, schema(name, columns)?, Arc::new(properties))?,
            columns: columns.iter().map(filled).collect(),
            rows: 0,
        })
    }

    /// Adds a row; the last one of a group writes it.
    ///
    /// # Errors
    /// Whatever the sink reports.
    pub fn add<'c>(&mut self, row: impl IntoIterator<Item = &'c Cell>) -> Result<(), ParquetError> {
        for (cell, column) in row.into_iter().zip(&mut self.columns) {
            column.add(cell);
        }
        self.rows += 1;
        match self.rows {
            GROUP_ROWS => self.write_group(),
            _ => Ok(()),
        }
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for filled in &mut self.columns {
            let Some(mut column) = group.next_column()? else {
                break;
            };
            let levels = &filled.levels;
            match filled.kind {
                ColumnKind::Number => write::<DoubleType>(&mut column, &filled.numbers, levels),
                ColumnKind::Whole => write::<Int64Type>(&mut column, &filled.whole, levels),
                ColumnKind::Flag => write::<BoolType>(&mut column, &filled.flags, levels),
                ColumnKind::Text => write::<ByteArrayType>(&mut column, &filled.texts, levels),
            }?;
            column.close()?;
            *filled = Filled::of(filled.kind);
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }

    /// Writes what is left, and returns the sink.
    ///
    /// # Errors
    /// Whatever the sink reports.
    pub fn finish(mut self) -> Result<W, ParquetError> {
        if self.rows > 0 {
            self.write_group()?;
        }
        self.writer.into_inner()
    }
}

/// `results.parquet` of a folder.
#[derive(Debug)]
pub(super) struct ParquetFile {
    path: PathBuf,
    /// Name until it is complete; one that is left over is written anew.
    unfinished: PathBuf,
    rows: Parquet<File>,
}

impl ParquetFile {
    /// The file of a folder, which says of itself what the metadata have.
    pub(super) fn create(
        folder: &Path,
        columns: &[Column],
        metadata: &[(&str, String)],
    ) -> Result<Self, ResultsError> {
        let unfinished = folder.join("results.parquet.part");
        let file = File::create(&unfinished).map_err(io(&unfinished))?;
        let rows = Parquet::new(file, "study", columns, metadata);
        Ok(Self {
            path: folder.join("results.parquet"),
            rows: rows.map_err(io(&unfinished))?,
            unfinished,
        })
    }

    /// Adds a row.
    pub(super) fn add(&mut self, row: &[Cell]) -> Result<(), ResultsError> {
        self.rows.add(row).map_err(io(&self.unfinished))
    }

    /// Ends the file: under its name if it is complete, else there is none.
    pub(super) fn close(self, is_complete: bool) -> Result<(), ResultsError> {
        if !is_complete {
            return fs::remove_file(&self.unfinished).map_err(io(&self.unfinished));
        }
        self.rows.finish().map_err(io(&self.unfinished))?;
        fs::rename(&self.unfinished, &self.path).map_err(io(&self.path))
    }
}

fn write<T: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    values: &[T::T],
    levels: &[i16],
) -> Result<usize, ParquetError> {
    column.typed::<T>().write_batch(values, Some(levels), None)
}

fn schema(name: &str, columns: &[Column]) -> Result<TypePtr, ParquetError> {
    let field = |column: &Column| {
        let (physical, logical) = match column.kind {
            ColumnKind::Number => (PhysicalType::DOUBLE, None),
            ColumnKind::Whole => (PhysicalType::INT64, None),
            ColumnKind::Flag => (PhysicalType::BOOLEAN, None),
            ColumnKind::Text => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
        };
        Type::primitive_type_builder(&column.name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical)
            .build()
            .map(Arc::new)
    };
    let fields: Result<Vec<TypePtr>, ParquetError> = columns.iter().map(field).collect();
    let schema = Type::group_type_builder(name).with_fields(fields?);
    Ok(Arc::new(schema.build()?))
}
