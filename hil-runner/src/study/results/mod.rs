//! Where the results of a study lie, and how nothing of them gets lost.
//!
//! ```text
//! OUT/study.toml        the study file as it was run
//! OUT/base.toml         the run file of the base case
//! OUT/study.json        which study, which part of it, and checksums of these: before the first row
//! OUT/results.csv       a row a run, in the order of the plan; only ever appended to
//! OUT/results.journal   a line a block: where it ends in the CSV, and its checksum
//! OUT/parquet/          the same rows in parts of 32,768, each complete or not there
//! ```
//!
//! A row counts once its block stands in the journal, which happens after the
//! block is in the CSV. So whenever a study is killed, what stands in the
//! journal is whole, what follows it in the CSV is cut off, and the study goes
//! on with the block after it: to the same bytes as if nothing had happened.

mod folder;
mod journal;
mod manifest;
mod merge;
mod origin;
#[path = "parquet.rs"]
mod parts;
mod read;

use core::fmt;
use std::path::{Path, PathBuf};

pub use folder::{Progress, Results};
pub(super) use journal::checksum as journal_checksum;
pub use manifest::{Manifest, Shard};
pub use merge::{merge, shards_in_order};
pub use origin::Origin;
pub use read::for_each_row;

/// Why results cannot be written or read. Nothing that lay there before has
/// been changed.
#[derive(Debug)]
#[non_exhaustive]
pub enum ResultsError {
    /// A file could not be read or written; says which and why.
    Io(String),
    /// The folder holds the results of another study, or something else.
    Other(String),
    /// What was written before is no longer what it was.
    Damaged(String),
    /// The disk has no room for all rows.
    DiskFull(String),
    /// Another process works on the folder.
    InUse(PathBuf),
}

impl fmt::Display for ResultsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(words) | Self::Other(words) | Self::DiskFull(words) => f.write_str(words),
            Self::Damaged(words) => write!(
                f,
                "{words}; nothing was changed: give another folder, or remove this one and start again"
            ),
            Self::InUse(path) => write!(
                f,
                "{}: another process is at work on these results; wait for it, or give another folder with --out",
                path.display()
            ),
        }
    }
}

impl std::error::Error for ResultsError {}

/// An error of the system with the file that it is about.
fn io(path: &Path, error: &std::io::Error) -> ResultsError {
    ResultsError::Io(format!("{}: {error}", path.display()))
}
