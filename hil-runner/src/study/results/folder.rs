//! A folder of results that is being filled, by runs or from shards.

use core::fmt::Write as _;
use core::ops::Range;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::journal::{CSV, Entry, HEADER, JOURNAL, csv_header, for_each_block};
use super::origin::Origin;
use super::parquet::ParquetFile;
use super::{ResultsError, damaged, io};
use crate::study::rows::cell::{Cell, Column};
use crate::study::rows::engine::Block;

/// Longest time between two entries in the journal: work that a killed study
/// does again.
const JOURNAL_INTERVAL: Duration = Duration::from_millis(500);

/// Bytes that a cell takes on the disk at most, CSV and Parquet together, in
/// the mean: 18 and a comma, and 8.
const BYTES_A_CELL: u64 = 27;

/// Progress of a folder.
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
    origin: Origin,
    csv: File,
    journal: File,
    parquet: ParquetFile,
    end_byte: u64,
    next_block: u64,
    /// Lines of blocks that are in the CSV and not yet in the journal.
    waiting: String,
    last_journal: Instant,
}

impl Results {
    /// Opens a folder for a study or a part of it: a new one, or one that holds
    /// the first rows already. `each` gets those rows; the command line stands
    /// in the Parquet file.
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
        if folder.join("study.json").exists() {
            refuse_other_study(folder, origin)?;
        } else {
            refuse_other_contents(folder, origin)?;
            fs::create_dir_all(folder).map_err(io(folder))?;
            refuse_small_disk(folder, origin, columns.len(), 0)?;
            origin.write(folder)?;
        }
        let (csv_path, journal_path) = (folder.join(CSV), folder.join(JOURNAL));
        let size = |path: &Path| fs::metadata(path).map(|it| it.len()).ok();
        let (csv_size, journal_size) = (size(&csv_path), size(&journal_path));
        // A study that is killed here has an empty journal and no CSV.
        let alone = match (csv_size, journal_size) {
            (Some(1..), None | Some(0)) => Some((&csv_path, &journal_path)),
            (None, Some(1..)) => Some((&journal_path, &csv_path)),
            _ => None,
        };
        if let Some((one, other)) = alone {
            return Err(damaged(
                one,
                format!("is there without {}", other.display()),
            ));
        }
        let mut journal = open(&journal_path)?;
        journal.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => ResultsError(format!(
                "{}: another process is at work on these results; wait for it, or give another folder with --out",
                folder.display()
            )),
            TryLockError::Error(error) => io(&journal_path)(error),
        })?;
        let mut csv = open(&csv_path)?;
        let blocks = origin.own_blocks();
        let mut parquet = ParquetFile::create(folder, columns, &origin.metadata(command_line))?;
        let whole = for_each_block(&journal, folder, columns, &blocks, |block| {
            block.rows.iter().try_for_each(|row| {
                each(row);
                parquet.add(row)
            })
        });
        let whole = match whole {
            Ok(whole) => whole,
            Err(error) => {
                parquet.close(false)?;
                return Err(error);
            }
        };
        let done = origin.rows_before(whole.next_block);
        refuse_small_disk(folder, origin, columns.len(), done)?;
        // What follows the last whole block was being written.
        let csv_bytes = match whole.next_block == blocks.start {
            true => 0,
            false => whole.csv_bytes,
        };
        let cut = |file: &mut File, bytes: u64, header: &str| {
            file.set_len(bytes)?;
            file.seek(SeekFrom::Start(bytes))?;
            file.write_all(if bytes == 0 { header.as_bytes() } else { &[] })
        };
        // The journal first: killed in between, a CSV without it would be no study.
        cut(&mut journal, whole.journal_bytes, HEADER).map_err(io(&journal_path))?;
        cut(&mut csv, csv_bytes, &csv_header(columns)).map_err(io(&csv_path))?;
        Ok(Self {
            folder: folder.to_owned(),
            origin: origin.clone(),
            csv,
            journal,
            parquet,
            end_byte: whole.csv_bytes,
            next_block: whole.next_block,
            waiting: String::new(),
            last_journal: Instant::now(),
        })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Blocks that are not there yet.
    pub fn missing_blocks(&self) -> Range<u64> {
        self.next_block..self.origin.own_blocks().end
    }

    /// Its progress.
    pub fn progress(&self) -> Progress {
        Progress {
            done: self.origin.rows_before(self.next_block),
            of: self.origin.rows_before(self.origin.own_blocks().end),
        }
    }

    /// Adds the next block.
    ///
    /// # Errors
    /// Those of the system; what was added before stays.
    pub fn add(&mut self, block: &Block) -> Result<(), ResultsError> {
        let written = self.csv.write_all(&block.csv);
        written.map_err(io(&self.folder.join(CSV)))?;
        self.end_byte += block.csv.len() as u64;
        let entry = Entry {
            block: self.next_block,
            end_byte: self.end_byte,
            crc: block.crc,
        };
        // A text takes it; nothing can fail.
        let _ = write!(self.waiting, "{entry}");
        self.next_block += 1;
        if self.last_journal.elapsed() >= JOURNAL_INTERVAL {
            self.write_journal()?;
        }
        block.rows.iter().try_for_each(|row| self.parquet.add(row))
    }

    /// Notes what is in the CSV. The CSV is on the disk before the journal says
    /// so: not even a power failure leaves a journal that says too much.
    fn write_journal(&mut self) -> Result<(), ResultsError> {
        self.csv
            .sync_data()
            .and_then(|()| self.journal.write_all(self.waiting.as_bytes()))
            .map_err(io(&self.folder.join(JOURNAL)))?;
        self.waiting.clear();
        self.last_journal = Instant::now();
        Ok(())
    }

    /// Ends the work for now: everything is on the disk; the Parquet file is
    /// there if the results are complete.
    ///
    /// # Errors
    /// Those of the system.
    pub fn close(mut self) -> Result<Progress, ResultsError> {
        self.write_journal()?;
        let synced = self.journal.sync_data();
        synced.map_err(io(&self.folder.join(JOURNAL)))?;
        let progress = self.progress();
        self.parquet.close(progress.done == progress.of)?;
        Ok(progress)
    }
}

/// Puts shards, in their order, together in `folder`: to the bytes of the study
/// made at once; `each` gets every row. Goes on where an earlier merge was
/// ended.
///
/// # Errors
/// If a shard is not complete, and those of the folder.
pub fn merge(
    folder: &Path,
    ordered: &[(PathBuf, Origin)],
    columns: &[Column],
    command_line: &str,
    mut each: impl FnMut(&[Cell]),
) -> Result<Progress, ResultsError> {
    let first = ordered.first().map(|(_, origin)| origin.whole());
    let first = first.ok_or_else(|| ResultsError("there are no shards to merge".to_owned()))?;
    let mut results = Results::open(folder, &first, columns, command_line, &mut each)?;
    for (path, origin) in ordered {
        let blocks = origin.own_blocks();
        let journal_path = path.join(JOURNAL);
        let journal = File::open(&journal_path).map_err(io(&journal_path))?;
        let whole = for_each_block(&journal, path, columns, &blocks, |block| {
            if block.number < results.next_block {
                return Ok(());
            }
            block.rows.iter().for_each(|row| each(row));
            results.add(block)
        })?;
        if whole.next_block != blocks.end {
            return Err(ResultsError(format!(
                "{}: shard {} is not complete; run it again and it goes on",
                path.display(),
                origin.shard
            )));
        }
    }
    results.close()
}

fn open(path: &Path) -> Result<File, ResultsError> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    options.open(path).map_err(io(path))
}

/// A folder without `study.json` is new, empty, or what a study leaves that was
/// killed before its manifest was complete.
fn refuse_other_contents(folder: &Path, origin: &Origin) -> Result<(), ResultsError> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(io(folder)(error)),
    };
    let names = entries.flatten().map(|entry| entry.file_name());
    let mut names = names.map(|name| name.to_string_lossy().into_owned());
    match names.find(|name| !origin.has_begun(folder, name)) {
        Some(other) => Err(ResultsError(format!(
            "{} holds {other} and no results of a study (study.json is missing); give an empty or new folder with --out",
            folder.display()
        ))),
        None => Ok(()),
    }
}

fn refuse_other_study(folder: &Path, wanted: &Origin) -> Result<(), ResultsError> {
    let found = Origin::read(folder)?;
    let what = if found.study != wanted.study {
        format!("study {}, not {}", found.study, wanted.study)
    } else if !found.is_same_study(wanted) {
        let study = &found.study;
        format!("another study {study}: its file, its base case, a profile or a --set differs")
    } else if found.shard != wanted.shard {
        format!("shard {}, not {}", found.shard, wanted.shard)
    } else {
        return Ok(());
    };
    Err(ResultsError(format!(
        "{} holds results of {what}; give another folder with --out, or remove this one",
        folder.display()
    )))
}

/// Refuses a study whose rows the disk cannot hold.
fn refuse_small_disk(
    folder: &Path,
    origin: &Origin,
    columns: usize,
    done_rows: u64,
) -> Result<(), ResultsError> {
    let missing = origin.rows_before(origin.own_blocks().end) - done_rows;
    let bytes = u128::from(missing) * columns as u128 * u128::from(BYTES_A_CELL);
    let free = free_bytes(folder)?;
    if bytes <= free {
        return Ok(());
    }
    let gigabytes = |bytes: u128| bytes as f64 / 1e9;
    Err(ResultsError(format!(
        "{}: {missing} rows need about {:.3} GB, and the disk has {:.3} GB free; make the plan smaller, or give another disk with --out",
        folder.display(),
        gigabytes(bytes),
        gigabytes(free),
    )))
}

#[cfg(unix)]
fn free_bytes(folder: &Path) -> Result<u128, ResultsError> {
    let disk = rustix::fs::statvfs(folder).map_err(io(folder))?;
    Ok(u128::from(disk.f_bavail) * u128::from(disk.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_: &Path) -> Result<u128, ResultsError> {
    Ok(u128::MAX)
}
