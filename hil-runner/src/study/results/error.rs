//! Errors of results on the disk.

use std::path::{Path, PathBuf};

/// Results that cannot be written or read. Nothing that lay there before has
/// been changed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// A file could not be read or written; says which and why.
    #[error("{0}")]
    Io(String),
    /// The folder holds something else, or the disk has no room.
    #[error("{0}")]
    Refused(String),
    /// A file is no longer what was written.
    #[error("{0}; nothing was changed: give another folder, or remove this one and start again")]
    Damaged(String),
    /// Another process works on the folder.
    #[error(
        "{}: another process is at work on these results; wait for it, or give another folder with --out",
        .0.display()
    )]
    InUse(PathBuf),
}

/// An error of the system, or of a format, with the file that it is about.
pub(super) fn io<E: core::fmt::Display>(path: &Path) -> impl Fn(E) -> ResultsError {
    move |error| ResultsError::Io(format!("{}: {error}", path.display()))
}

/// A file that is not what was written.
pub(super) fn damaged(path: &Path, words: impl core::fmt::Display) -> ResultsError {
    ResultsError::Damaged(format!("{} {words}", path.display()))
}
