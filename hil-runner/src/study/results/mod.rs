//! The results of a study on the disk, of which nothing gets lost.
//!
//! ```text
//! OUT/study.toml        the study file as it was run
//! OUT/base.toml         the run file of the base case
//! OUT/study.json        which study, which part of it, and checksums of these: before the first row
//! OUT/results.csv       a row a run, in the order of the plan; only ever appended to
//! OUT/results.journal   a line a block: where it ends in the CSV, and its checksum
//! OUT/results.parquet   the same rows, once all are there; until then results.parquet.part
//! ```
//!
//! A row counts once its block stands in the journal, which happens after the
//! block is in the CSV. So whenever a study is killed, what stands in the
//! journal is whole, what follows it in the CSV is cut off, and the study goes
//! on with the block after it: to the same bytes as if nothing had happened.
//! The Parquet file follows from the CSV and is made again then.

mod folder;
mod journal;
mod origin;
mod parquet;

use std::path::Path;

pub use folder::{Progress, Results, merge};
pub use origin::{Origin, Shard, shards_in_order};
pub use parquet::Parquet;

/// Results that cannot be written or read, a sentence. Nothing that lay there
/// before has been changed.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ResultsError(String);

/// An error of the system, or of a format, with the file that it is about.
fn io<E: core::fmt::Display>(path: &Path) -> impl Fn(E) -> ResultsError {
    move |error| ResultsError(format!("{}: {error}", path.display()))
}

/// A file that is not what was written.
fn damaged(path: &Path, words: impl core::fmt::Display) -> ResultsError {
    damaged_at(path.display(), format_args!(" {words}"))
}

/// The same at a place of the file.
fn damaged_at(place: impl core::fmt::Display, words: impl core::fmt::Display) -> ResultsError {
    ResultsError(format!(
        "{place}{words}; nothing was changed: give another folder, or remove this one and start again"
    ))
}
