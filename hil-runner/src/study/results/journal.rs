//! `results.journal`, one line for each block that is whole, and the rows of
//! those blocks, read back from `results.csv`.
//!
//! ```text
//! block,end_byte,crc32
//! 0,18233,9a03c1f2
//! ```

use core::ops::Range;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::{Path, PathBuf};

use super::{ResultsError, damaged, damaged_at, io};
use crate::study::rows::cell::{Cell, Column, checksum};
use crate::study::rows::engine::Block;

/// Names of the files.
pub(super) const CSV: &str = "results.csv";
pub(super) const JOURNAL: &str = "results.journal";

/// First line of the journal.
pub(super) const HEADER: &str = "block,end_byte,crc32\n";

/// More bytes than a line has.
const LONGEST_LINE: u64 = 1 << 10;

/// A line of the journal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// Number of the block in the study.
    pub(super) block: u64,
    /// Its end in the CSV.
    pub(super) end_byte: u64,
    /// Checksum of its bytes.
    pub(super) crc: u32,
}

impl core::fmt::Display for Entry {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        writeln!(f, "{},{},{:08x}", self.block, self.end_byte, self.crc)
    }
}

impl Entry {
    fn parse(line: &[u8]) -> Option<Self> {
        let mut fields = core::str::from_utf8(line).ok()?.trim_end().split(',');
        let entry = Self {
            block: fields.next()?.parse().ok()?,
            end_byte: fields.next()?.parse().ok()?,
            crc: u32::from_str_radix(fields.next()?, 16).ok()?,
        };
        fields.next().is_none().then_some(entry)
    }
}

/// The first line of a CSV with these columns.
pub(super) fn csv_header(columns: &[Column]) -> String {
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    names.join(",") + "\n"
}

/// The whole part of a folder.
#[derive(Debug)]
pub(super) struct Whole {
    /// The block that comes next.
    pub(super) next_block: u64,
    /// End of the last whole block in the CSV.
    pub(super) csv_bytes: u64,
    /// End of the last whole line in the journal; a line that was begun and
    /// not ended may follow.
    pub(super) journal_bytes: u64,
}

/// Goes through the whole blocks of a folder, of which there are `blocks` at
/// the end, in their order.
///
/// # Errors
/// [`ResultsError`] if something is not what was written, and those of
/// `each`.
pub(super) fn for_each_block(
    mut journal: &File,
    folder: &Path,
    columns: &[Column],
    blocks: &Range<u64>,
    mut each: impl FnMut(&Block) -> Result<(), ResultsError>,
) -> Result<Whole, ResultsError> {
    let (path, csv_path) = (folder.join(JOURNAL), folder.join(CSV));
    journal.rewind().map_err(io(&path))?;
    let mut lines = BufReader::new(journal);
    let mut whole = Whole {
        next_block: blocks.start,
        csv_bytes: csv_header(columns).len() as u64,
        journal_bytes: 0,
    };
    let mut csv = None;
    let mut line = Vec::new();
    for number in 1_u64.. {
        let wrong = |words| damaged_at(path.display(), format_args!(":{number}: {words}"));
        let no_line = || wrong("this is no line of a journal");
        line.clear();
        let limited = &mut lines.by_ref().take(LONGEST_LINE);
        let read = limited.read_until(b'\n', &mut line).map_err(io(&path))? as u64;
        if !line.ends_with(b"\n") && read < LONGEST_LINE {
            // Nothing more, or a line that was being written; one that begins
            // like no line of a journal is no accident.
            let of_entry = |byte: &u8| byte.is_ascii_hexdigit() || *byte == b',';
            let begun = match number {
                1 => HEADER.as_bytes().starts_with(&line),
                _ => line.iter().all(of_entry),
            };
            if !begun {
                return Err(no_line());
            }
            break;
        }
        if number == 1 {
            if line != HEADER.as_bytes() {
                return Err(wrong("this is no journal of results"));
            }
        } else {
            let entry = Entry::parse(&line).ok_or_else(no_line)?;
            let (found, next) = (entry.block, whole.next_block);
            if found != next || found >= blocks.end {
                let words = format!(": block {found} stands where block {next} should");
                return Err(damaged_at(path.display(), words));
            }
            let csv = match &mut csv {
                Some(csv) => csv,
                none => none.insert(CsvReader::open(&csv_path, columns)?),
            };
            each(&csv.block(entry)?)?;
            (whole.next_block, whole.csv_bytes) = (next + 1, entry.end_byte);
        }
        whole.journal_bytes += read;
    }
    if whole.next_block == blocks.end && !blocks.is_empty() {
        let csv = std::fs::metadata(&csv_path).map_err(io(&csv_path))?;
        if csv.len() > whole.csv_bytes {
            return Err(damaged(&csv_path, "goes on after its last row"));
        }
    }
    Ok(whole)
}

/// Reads the CSV of a folder block by block.
#[derive(Debug)]
struct CsvReader<'c> {
    path: PathBuf,
    reader: BufReader<File>,
    columns: &'c [Column],
    at_byte: u64,
}

impl<'c> CsvReader<'c> {
    /// Opens a CSV at its first row.
    fn open(path: &Path, columns: &'c [Column]) -> Result<Self, ResultsError> {
        let file = File::open(path).map_err(io(path))?;
        let mut csv = Self {
            path: path.to_owned(),
            reader: BufReader::with_capacity(1 << 18, file),
            columns,
            at_byte: 0,
        };
        let header = csv_header(columns);
        if csv.take(header.len() as u64)? != header.as_bytes() {
            return Err(damaged(path, "has not the columns of this study"));
        }
        Ok(csv)
    }

    /// The bytes up to `end_byte`.
    fn take(&mut self, end_byte: u64) -> Result<Vec<u8>, ResultsError> {
        let length = end_byte.checked_sub(self.at_byte);
        let length =
            length.ok_or_else(|| damaged(&self.path, "has a block that ends before it begins"))?;
        let mut bytes = Vec::new();
        let read = (&mut self.reader).take(length).read_to_end(&mut bytes);
        if read.map_err(io(&self.path))? as u64 != length {
            let words = format!("ends before byte {end_byte}, to which the journal has it");
            return Err(damaged(&self.path, words));
        }
        self.at_byte = end_byte;
        Ok(bytes)
    }

    /// A block, which must be what was written.
    fn block(&mut self, entry: Entry) -> Result<Block, ResultsError> {
        let Entry { block, crc, .. } = entry;
        let from = self.at_byte;
        let csv = self.take(entry.end_byte)?;
        if checksum(&csv) != crc {
            let end = entry.end_byte;
            let words = format!("bytes {from} to {end}, block {block}, are not what was written");
            return Err(damaged(&self.path, words));
        }
        let mut reader = csv::ReaderBuilder::new();
        let mut reader = reader.has_headers(false).from_reader(csv.as_slice());
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| damaged(&self.path, error))?;
            let fields = record.iter().zip(self.columns).map(|(field, column)| {
                Cell::read(field, column.kind).ok_or_else(|| {
                    let words = format!("{field:?} is no value of {}", column.name);
                    damaged(&self.path, words)
                })
            });
            rows.push(fields.collect::<Result<Vec<Cell>, _>>()?);
        }
        Ok(Block {
            number: block,
            rows,
            csv,
            crc,
            one_by_one: BTreeMap::new(),
        })
    }
}
