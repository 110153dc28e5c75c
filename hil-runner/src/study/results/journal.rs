//! `results.journal`: one line for each block that is whole.
//!
//! ```text
//! block,end_byte,crc32
//! 0,18233,9a03c1f2
//! ```

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use crc::{CRC_32_ISO_HDLC, Crc, Table};

use super::{ResultsError, io};

static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// First line.
const HEADER: &str = "block,end_byte,crc32\n";

/// The checksum of a block's bytes.
pub(crate) fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// A line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Entry {
    /// Number of the block in the study.
    pub(super) block: u64,
    /// Where it ends in the CSV.
    pub(super) end_byte: u64,
    /// Checksum of its bytes.
    pub(super) crc: u32,
}

impl Entry {
    fn parse(line: &str) -> Option<Self> {
        let mut fields = line.split(',');
        let entry = Self {
            block: fields.next()?.parse().ok()?,
            end_byte: fields.next()?.parse().ok()?,
            crc: u32::from_str_radix(fields.next()?, 16).ok()?,
        };
        fields.next().is_none().then_some(entry)
    }
}

/// The journal, open for more lines.
#[derive(Debug)]
pub(super) struct Journal {
    file: File,
}

impl Journal {
    /// Takes over an open file: empty, or a journal. `each` gets every entry;
    /// a line that was begun and not ended is cut off.
    ///
    /// # Errors
    /// As [`read`], and those of the system.
    pub(super) fn open(
        mut file: File,
        path: &Path,
        each: impl FnMut(Entry) -> Result<(), ResultsError>,
    ) -> Result<Self, ResultsError> {
        let failed = |error: std::io::Error| io(path, &error);
        file.seek(SeekFrom::Start(0)).map_err(failed)?;
        let whole_bytes = read(&file, path, each)?;
        file.set_len(whole_bytes).map_err(failed)?;
        file.seek(SeekFrom::Start(whole_bytes)).map_err(failed)?;
        if whole_bytes == 0 {
            file.write_all(HEADER.as_bytes()).map_err(failed)?;
        }
        Ok(Self { file })
    }

    /// Adds lines.
    ///
    /// # Errors
    /// Those of the system.
    pub(super) fn add(&mut self, entries: &[Entry]) -> std::io::Result<()> {
        let mut text = String::new();
        for Entry {
            block,
            end_byte,
            crc,
        } in entries
        {
            text += &format!("{block},{end_byte},{crc:08x}\n");
        }
        self.file.write_all(text.as_bytes())
    }

    /// Waits until all lines are on the disk.
    ///
    /// # Errors
    /// Those of the system.
    pub(super) fn sync(&self) -> std::io::Result<()> {
        self.file.sync_data()
    }
}

/// Goes through the entries of a journal; returns where its last whole line
/// ends.
///
/// # Errors
/// [`ResultsError::Damaged`] with the line that is none, and those of `each`.
pub(super) fn read(
    file: &File,
    path: &Path,
    mut each: impl FnMut(Entry) -> Result<(), ResultsError>,
) -> Result<u64, ResultsError> {
    let mut reader = BufReader::new(file);
    let (mut line, mut whole_bytes, mut number) = (Vec::new(), 0_u64, 0_u64);
    loop {
        line.clear();
        let read = reader
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut line)
            .map_err(|error| io(path, &error))? as u64;
        number += 1;
        let is_whole = line.ends_with(b"\n");
        if !is_whole && read < LONGEST_LINE {
            // Nothing more, or a line that was being written; one that begins
            // like no line of a journal is no accident.
            let begun = if number == 1 {
                HEADER.as_bytes().starts_with(&line)
            } else {
                line.iter()
                    .all(|byte| byte.is_ascii_hexdigit() || *byte == b',')
            };
            return if begun {
                Ok(whole_bytes)
            } else {
                Err(damaged(path, number, "this is no line of a journal"))
            };
        }
        if number == 1 {
            if line != HEADER.as_bytes() {
                return Err(damaged(path, 1, "this is no journal of results"));
            }
        } else {
            let entry = core::str::from_utf8(&line)
                .ok()
                .and_then(|line| Entry::parse(line.trim_end_matches('\n')))
                .ok_or_else(|| damaged(path, number, "this is no line of a journal"))?;
            each(entry)?;
        }
        whole_bytes += read;
    }
}

/// More bytes than a line has.
const LONGEST_LINE: u64 = 1 << 10;

fn damaged(path: &Path, line: u64, words: &str) -> ResultsError {
    ResultsError::Damaged(format!("{}:{line}: {words}", path.display()))
}
