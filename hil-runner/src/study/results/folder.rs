//! A folder of results that is being filled.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::journal::{Entry, Journal};
use super::manifest::Manifest;
use super::origin::Origin;
use super::parts::Parts;
use super::read::{Reading, header};
use super::{ResultsError, io};
use crate::study::cell::{Cell, Column};
use crate::study::engine::Block;

/// Longest time between two entries in the journal: work that a killed study
/// does again.
const JOURNAL_INTERVAL: Duration = Duration::from_millis(500);

/// Bytes that a cell takes on the disk at most, CSV and Parquet together, in
/// the mean: 18 and a comma, and 8.
const BYTES_A_CELL: u64 = 27;

/// How far a folder is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Rows that are there.
    pub done: u64,
    /// Rows that will be there.
    pub of: u64,
}

/// The results of a study, or of a part of it, on the disk.
#[derive(Debug)]
pub struct Results {
    folder: PathBuf,
    manifest: Manifest,
    csv: File,
    journal: Journal,
    parts: Parts,
    end_byte: u64,
    next_block: u64,
    /// Blocks that are in the CSV and not yet in the journal.
    waiting: Vec<Entry>,
    last_journal: Instant,
}

impl Results {
    /// Opens a folder for a study or a part of it: a new one, or one that holds
    /// the first rows already. `each` gets those rows; the command line stands
    /// in the Parquet copy.
    ///
    /// # Errors
    /// [`ResultsError`]; nothing that lay there has been changed then.
    pub fn open(
        folder: &Path,
        origin: &Origin,
        columns: &[Column],
        command_line: &str,
        mut each: impl FnMut(&[Cell]),
    ) -> Result<Self, ResultsError> {
        let manifest = &origin.manifest;
        refuse_other_contents(folder, origin)?;
        if folder.join("study.json").exists() {
            refuse_other_study(folder, manifest)?;
        } else {
            fs::create_dir_all(folder).map_err(|error| io(folder, &error))?;
            refuse_small_disk(folder, manifest, columns.len(), 0)?;
            origin.write(folder)?;
        }
        let journal_path = folder.join("results.journal");
        let csv_path = folder.join("results.csv");
        let size = |path: &Path| fs::metadata(path).map_or(0, |it| it.len());
        if size(&csv_path) > 0 && size(&journal_path) == 0 {
            let (csv, journal) = (csv_path.display(), journal_path.display());
            return Err(ResultsError::Damaged(format!(
                "{csv} is there without {journal}"
            )));
        }
        // A study that is killed here has an empty journal and no CSV.
        if !csv_path.exists() && size(&journal_path) > 0 {
            let (csv, journal) = (csv_path.display(), journal_path.display());
            return Err(ResultsError::Damaged(format!(
                "{journal} is there without {csv}"
            )));
        }
        let journal_file = open(&journal_path)?;
        match journal_file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(ResultsError::InUse(folder.to_owned())),
            Err(TryLockError::Error(error)) => return Err(io(&journal_path, &error)),
        }
        let blocks = manifest.own_blocks();
        let first_row = manifest.own_rows().start;
        let mut csv = open(&csv_path)?;
        let length = csv.metadata().map_err(|error| io(&csv_path, &error))?.len();
        let header = header(columns);
        let (mut end_byte, mut next_block) = (header.len() as u64, blocks.start);
        let mut reading = None;
        let mut parts = Parts::new(
            &folder.join("parquet"),
            columns,
            first_row,
            &origin.metadata(command_line),
        )?;
        let journal = Journal::open(journal_file, &journal_path, |entry| {
            if entry.block != next_block || entry.block >= blocks.end {
                let path = journal_path.display();
                return Err(ResultsError::Damaged(format!(
                    "{path}: block {} stands where block {next_block} should",
                    entry.block
                )));
            }
            let reading = match &mut reading {
                Some(reading) => reading,
                none => none.insert(Reading::open(&csv_path, columns)?),
            };
            reading.rows(entry, |row| {
                each(row);
                parts.add(row)
            })?;
            (end_byte, next_block) = (entry.end_byte, next_block + 1);
            Ok(())
        })?;
        if next_block == blocks.end && length > end_byte && !blocks.is_empty() {
            let path = csv_path.display();
            return Err(ResultsError::Damaged(format!(
                "{path} goes on after its last row"
            )));
        }
        let done_rows = (next_block * manifest.block_rows).min(manifest.own_rows().end) - first_row;
        refuse_small_disk(folder, manifest, columns.len(), done_rows)?;
        // What follows the last whole block was being written.
        if next_block == blocks.start {
            csv.set_len(0).map_err(|error| io(&csv_path, &error))?;
            csv.seek(SeekFrom::Start(0))
                .map_err(|error| io(&csv_path, &error))?;
            csv.write_all(header.as_bytes())
                .map_err(|error| io(&csv_path, &error))?;
        } else {
            csv.set_len(end_byte)
                .map_err(|error| io(&csv_path, &error))?;
            csv.seek(SeekFrom::Start(end_byte))
                .map_err(|error| io(&csv_path, &error))?;
        }
        Ok(Self {
            folder: folder.to_owned(),
            manifest: manifest.clone(),
            csv,
            journal,
            parts,
            end_byte,
            next_block,
            waiting: Vec::new(),
            last_journal: Instant::now(),
        })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Which study, and which part of it.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Blocks that are not there yet.
    pub fn missing_blocks(&self) -> core::ops::Range<u64> {
        self.next_block..self.manifest.own_blocks().end
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        let rows = self.manifest.own_rows();
        let done = (self.next_block * self.manifest.block_rows).min(rows.end);
        Progress {
            done: done - rows.start,
            of: rows.end - rows.start,
        }
    }

    /// Adds the next block.
    ///
    /// # Errors
    /// Those of the system; what was added before stays.
    pub fn add(&mut self, block: &Block) -> Result<(), ResultsError> {
        self.append(&block.csv, block.crc)?;
        block.rows.iter().try_for_each(|row| self.parts.add(row))
    }

    /// Adds the next block as it stands in a CSV.
    pub(super) fn append(&mut self, bytes: &[u8], crc: u32) -> Result<(), ResultsError> {
        let path = self.folder.join("results.csv");
        self.csv
            .write_all(bytes)
            .map_err(|error| io(&path, &error))?;
        self.end_byte += bytes.len() as u64;
        self.waiting.push(Entry {
            block: self.next_block,
            end_byte: self.end_byte,
            crc,
        });
        self.next_block += 1;
        if self.last_journal.elapsed() >= JOURNAL_INTERVAL {
            self.write_journal()?;
        }
        Ok(())
    }

    /// Adds a row of a block that was appended to the parts.
    pub(super) fn add_to_parts(&mut self, row: &[Cell]) -> Result<(), ResultsError> {
        self.parts.add(row)
    }

    /// Notes what is in the CSV. The CSV is on the disk before the journal says
    /// so: not even a power failure leaves a journal that says too much.
    fn write_journal(&mut self) -> Result<(), ResultsError> {
        let path = self.folder.join("results.journal");
        self.csv
            .sync_data()
            .and_then(|()| self.journal.add(&self.waiting))
            .map_err(|error| io(&path, &error))?;
        self.waiting.clear();
        self.last_journal = Instant::now();
        Ok(())
    }

    /// Ends the work for now: everything is on the disk; the last part of the
    /// Parquet copy is complete if the results are.
    ///
    /// # Errors
    /// Those of the system.
    pub fn close(mut self) -> Result<Progress, ResultsError> {
        self.write_journal()?;
        let path = self.folder.join("results.journal");
        self.journal.sync().map_err(|error| io(&path, &error))?;
        let progress = self.progress();
        if progress.done == progress.of {
            self.parts.complete()?;
        }
        Ok(progress)
    }
}

fn open(path: &Path) -> Result<File, ResultsError> {
    OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)
        .map_err(|error| io(path, &error))
}

/// A folder is new, empty, or one of results.
fn refuse_other_contents(folder: &Path, origin: &Origin) -> Result<(), ResultsError> {
    let shown = folder.display();
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(io(folder, &error)),
    };
    // What a study leaves that was killed before its manifest was complete.
    let unfinished = |name: &std::ffi::OsStr| {
        name.to_str()
            .is_some_and(|name| origin.has_begun(folder, name))
    };
    let mut others = entries
        .flatten()
        .map(|entry| entry.file_name())
        .filter(|name| !unfinished(name));
    if !folder.join("study.json").exists()
        && let Some(other) = others.next()
    {
        let other = other.to_string_lossy();
        return Err(ResultsError::Other(format!(
            "{shown} holds {other} and no results of a study (study.json is missing); give an empty or new folder with --out"
        )));
    }
    Ok(())
}

fn refuse_other_study(folder: &Path, wanted: &Manifest) -> Result<(), ResultsError> {
    let found = Origin::read(folder)?.manifest;
    if found.is_same_study(wanted) && found.shard == wanted.shard {
        return Ok(());
    }
    let shown = folder.display();
    let differs = |what: &str, found: &dyn core::fmt::Display, wanted: &dyn core::fmt::Display| {
        format!("{shown} holds results of {what} {found}, not {wanted}")
    };
    let words = if found.study != wanted.study {
        differs("study", &found.study, &wanted.study)
    } else if !found.is_same_study(wanted) {
        format!(
            "{shown} holds results of another study {}: its file, its base case or a --set differs",
            found.study
        )
    } else {
        differs("shard", &found.shard, &wanted.shard)
    };
    Err(ResultsError::Other(format!(
        "{words}; give another folder with --out, or remove this one"
    )))
}

/// Refuses a study whose rows the disk cannot hold.
#[cfg(unix)]
fn refuse_small_disk(
    folder: &Path,
    manifest: &Manifest,
    columns: usize,
    done_rows: u64,
) -> Result<(), ResultsError> {
    let rows = manifest.own_rows();
    let missing = rows.end - rows.start - done_rows;
    let bytes = u128::from(missing) * columns as u128 * u128::from(BYTES_A_CELL);
    let disk = rustix::fs::statvfs(folder).map_err(|error| io(folder, &error.into()))?;
    let free = u128::from(disk.f_bavail) * u128::from(disk.f_frsize);
    if bytes <= free {
        return Ok(());
    }
    let gigabytes = |bytes: u128| bytes as f64 / 1e9;
    Err(ResultsError::DiskFull(format!(
        "{}: {missing} rows need about {:.3} GB, and the disk has {:.3} GB free; make the plan smaller, or give another disk with --out",
        folder.display(),
        gigabytes(bytes),
        gigabytes(free),
    )))
}

#[cfg(not(unix))]
fn refuse_small_disk(_: &Path, _: &Manifest, _: usize, _: u64) -> Result<(), ResultsError> {
    Ok(())
}
