//! The rows once more as Apache Parquet, in parts: `parquet/part-00000.parquet`
//! holds rows 0 to 32,767. A part appears under its name when it is complete.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{WriterProperties, WriterPropertiesPtr};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};

use super::{ResultsError, io};
use crate::study::cell::{Cell, Column, ColumnKind};

/// Rows of a part.
pub(super) const PART_ROWS: u64 = 32_768;

/// The values of one column in the part that is being filled.
#[derive(Debug)]
enum Values {
    Number(Vec<f64>),
    Whole(Vec<i64>),
    Flag(Vec<bool>),
    Text(Vec<ByteArray>),
}

/// Writes rows in their order into parts.
#[derive(Debug)]
pub(super) struct Parts {
    folder: PathBuf,
    schema: TypePtr,
    properties: WriterPropertiesPtr,
    values: Vec<Values>,
    /// 1 where a value is there, 0 where the cell is empty.
    levels: Vec<Vec<i16>>,
    rows: u64,
    /// Number of the row that comes next.
    next_row: u64,
}

impl Parts {
    /// Parts in a folder, from a row on, which begins a part or the study; every
    /// part has the metadata.
    pub(super) fn new(
        folder: &Path,
        columns: &[Column],
        first_row: u64,
        metadata: &[(&str, String)],
    ) -> Result<Self, ResultsError> {
        fs::create_dir_all(folder).map_err(|error| io(folder, &error))?;
        let failed = |error: ParquetError| named(folder, &error);
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
        let schema = Type::group_type_builder("study")
            .with_fields(fields.map_err(failed)?)
            .build();
        let metadata = metadata
            .iter()
            .map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone()));
        Ok(Self {
            folder: folder.to_owned(),
            schema: Arc::new(schema.map_err(failed)?),
            properties: Arc::new(
                WriterProperties::builder()
                    .set_compression(Compression::SNAPPY)
                    .set_created_by("hil-runner".to_owned())
                    // Numbers hardly ever repeat: a dictionary would cost more
                    // time than it saves space.
                    .set_dictionary_enabled(false)
                    .set_key_value_metadata(Some(metadata.collect()))
                    .build(),
            ),
            values: columns
                .iter()
                .map(|column| match column.kind {
                    ColumnKind::Number => Values::Number(Vec::new()),
                    ColumnKind::Whole => Values::Whole(Vec::new()),
                    ColumnKind::Flag => Values::Flag(Vec::new()),
                    ColumnKind::Text => Values::Text(Vec::new()),
                })
                .collect(),
            levels: vec![Vec::new(); columns.len()],
            rows: 0,
            next_row: first_row,
        })
    }

    /// Adds a row; the last one of a part completes it.
    pub(super) fn add(&mut self, row: &[Cell]) -> Result<(), ResultsError> {
        for ((cell, values), levels) in row.iter().zip(&mut self.values).zip(&mut self.levels) {
            let there = match (cell, values) {
                (Cell::Number(number), Values::Number(numbers)) => {
                    numbers.push(*number);
                    true
                }
                // A value that its key refuses may be too large: the reason has it.
                (cell, Values::Whole(numbers)) => {
                    numbers.extend(cell.as_whole());
                    cell.as_whole().is_some()
                }
                (Cell::Flag(flag), Values::Flag(flags)) => {
                    flags.push(*flag);
                    true
                }
                (Cell::Text(text), Values::Text(texts)) => {
                    texts.push(ByteArray::from(text.as_bytes().to_vec()));
                    true
                }
                _ => false,
            };
            levels.push(i16::from(there));
        }
        self.rows += 1;
        self.next_row += 1;
        if self.next_row.is_multiple_of(PART_ROWS) {
            self.complete()?;
        }
        Ok(())
    }

    /// Completes the part that is being filled, if it has rows.
    pub(super) fn complete(&mut self) -> Result<(), ResultsError> {
        if self.rows == 0 {
            return Ok(());
        }
        let number = (self.next_row - 1) / PART_ROWS;
        let path = self.folder.join(format!("part-{number:05}.parquet"));
        let unfinished = self.folder.join(format!("part-{number:05}.unfinished"));
        let file = File::create(&unfinished).map_err(|error| io(&unfinished, &error))?;
        self.write(file)
            .map_err(|error| named(&unfinished, &error))?;
        fs::rename(&unfinished, &path).map_err(|error| io(&path, &error))?;
        self.rows = 0;
        for values in &mut self.values {
            match values {
                Values::Number(numbers) => numbers.clear(),
                Values::Whole(numbers) => numbers.clear(),
                Values::Flag(flags) => flags.clear(),
                Values::Text(texts) => texts.clear(),
            }
        }
        self.levels.iter_mut().for_each(Vec::clear);
        Ok(())
    }

    fn write(&self, file: File) -> Result<(), ParquetError> {
        let schema = Arc::clone(&self.schema);
        let mut writer = SerializedFileWriter::new(file, schema, Arc::clone(&self.properties))?;
        let mut group = writer.next_row_group()?;
        for (values, levels) in self.values.iter().zip(&self.levels) {
            let Some(mut column) = group.next_column()? else {
                break;
            };
            let levels = Some(levels.as_slice());
            match values {
                Values::Number(numbers) => {
                    column
                        .typed::<DoubleType>()
                        .write_batch(numbers, levels, None)?;
                }
                Values::Whole(numbers) => {
                    column
                        .typed::<Int64Type>()
                        .write_batch(numbers, levels, None)?;
                }
                Values::Flag(flags) => {
                    column
                        .typed::<BoolType>()
                        .write_batch(flags, levels, None)?;
                }
                Values::Text(texts) => {
                    column
                        .typed::<ByteArrayType>()
                        .write_batch(texts, levels, None)?;
                }
            }
            column.close()?;
        }
        group.close()?;
        writer.close()?;
        Ok(())
    }
}

fn named(path: &Path, error: &ParquetError) -> ResultsError {
    ResultsError::Io(format!("{}: {error}", path.display()))
}
