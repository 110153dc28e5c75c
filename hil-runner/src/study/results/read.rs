//! Reads `results.csv` back, row by row, and holds it against the journal.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use super::journal::{self, Entry};
use super::manifest::Manifest;
use super::{ResultsError, io};
use crate::study::cell::{Cell, Column};

/// Reads the CSV of a folder block by block.
#[derive(Debug)]
pub(super) struct Reading<'c> {
    path: PathBuf,
    reader: BufReader<File>,
    columns: &'c [Column],
    at_byte: u64,
    bytes: Vec<u8>,
}

/// The first line of a CSV with these columns.
pub(super) fn header(columns: &[Column]) -> String {
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    names.join(",") + "\n"
}

impl<'c> Reading<'c> {
    /// Opens the CSV of a folder, at its first row.
    ///
    /// # Errors
    /// If it cannot be read, or has other columns.
    pub(super) fn open(path: &Path, columns: &'c [Column]) -> Result<Self, ResultsError> {
        let file = File::open(path).map_err(|error| io(path, &error))?;
        let mut reading = Self {
            path: path.to_owned(),
            reader: BufReader::with_capacity(1 << 18, file),
            columns,
            at_byte: 0,
            bytes: Vec::new(),
        };
        let header = header(columns);
        reading.take(header.len() as u64)?;
        if reading.bytes != header.as_bytes() {
            return Err(reading.damaged("has not the columns of this study"));
        }
        Ok(reading)
    }

    /// The bytes up to `end_byte`.
    fn take(&mut self, end_byte: u64) -> Result<(), ResultsError> {
        let length = end_byte
            .checked_sub(self.at_byte)
            .ok_or_else(|| self.damaged("has a block that ends before it begins"))?;
        self.bytes.clear();
        let read = (&mut self.reader).take(length).read_to_end(&mut self.bytes);
        read.map_err(|error| io(&self.path, &error))?;
        if self.bytes.len() as u64 != length {
            return Err(self.damaged(&format!(
                "ends before byte {end_byte}, to which the journal has it"
            )));
        }
        self.at_byte = end_byte;
        Ok(())
    }

    /// The bytes of a block.
    ///
    /// # Errors
    /// [`ResultsError::Damaged`] if they are not what was written.
    pub(super) fn block(&mut self, entry: Entry) -> Result<&[u8], ResultsError> {
        let from = self.at_byte;
        self.take(entry.end_byte)?;
        if journal::checksum(&self.bytes) != entry.crc {
            let (block, end) = (entry.block, entry.end_byte);
            return Err(self.damaged(&format!(
                "bytes {from} to {end}, block {block}, are not what was written"
            )));
        }
        Ok(&self.bytes)
    }

    /// The bytes of the block that was read last.
    pub(super) fn last(&self) -> &[u8] {
        &self.bytes
    }

    /// The rows of a block.
    ///
    /// # Errors
    /// As [`Reading::block`].
    pub(super) fn rows(
        &mut self,
        entry: Entry,
        mut each: impl FnMut(&[Cell]) -> Result<(), ResultsError>,
    ) -> Result<(), ResultsError> {
        self.block(entry)?;
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .from_reader(self.bytes.as_slice());
        let (mut record, mut row) = (csv::StringRecord::new(), Vec::new());
        loop {
            match reader.read_record(&mut record) {
                Ok(true) => {}
                Ok(false) => return Ok(()),
                Err(error) => return Err(self.damaged(&error.to_string())),
            }
            row.clear();
            for (field, column) in record.iter().zip(self.columns) {
                match Cell::read(field, column.kind) {
                    Some(cell) => row.push(cell),
                    None => {
                        return Err(
                            self.damaged(&format!("{field:?} is no value of {}", column.name))
                        );
                    }
                }
            }
            each(&row)?;
        }
    }

    fn damaged(&self, words: &str) -> ResultsError {
        ResultsError::Damaged(format!("{} {words}", self.path.display()))
    }
}

/// Goes through the rows of a folder that are whole, in their order: the first
/// `most` of them, and to the end of their block.
///
/// # Errors
/// If something is not what was written, and those of `each`.
pub fn for_each_row(
    folder: &Path,
    columns: &[Column],
    most: u64,
    mut each: impl FnMut(&[Cell]) -> Result<(), ResultsError>,
) -> Result<(), ResultsError> {
    let manifest = Manifest::read(folder)?;
    let path = folder.join("results.csv");
    let mut reading = Reading::open(&path, columns)?;
    let (mut next, mut rows) = (manifest.own_blocks().start, 0);
    entries(&folder.join("results.journal"), |entry| {
        if entry.block != next {
            return Err(ResultsError::Damaged(format!(
                "{}: block {next} is missing",
                path.display()
            )));
        }
        next += 1;
        if rows >= most {
            return Ok(());
        }
        reading.rows(entry, |row| {
            rows += 1;
            each(row)
        })
    })
}

/// The entries of a journal, without touching it.
pub(super) fn entries(
    path: &Path,
    each: impl FnMut(Entry) -> Result<(), ResultsError>,
) -> Result<(), ResultsError> {
    let file = File::open(path).map_err(|error| io(path, &error))?;
    journal::read(&file, path, each).map(|_| ())
}
