//! What images are made of, and the reasons for which there is none.

use thiserror::Error;

/// Images that are built together, and what they are made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recipe {
    /// What one of them is, in sentences.
    pub what: String,
    /// The compiler's name of the machine.
    pub triple: &'static str,
    /// The part of Rust's own library that they need: `core` or `std`.
    pub library: &'static str,
    /// The folder of their workspace, from the project's.
    pub workspace: &'static str,
    /// Their packages.
    pub packages: &'static [&'static str],
    /// The profile that they are built in.
    pub profile: &'static str,
    /// The folder that they are built in, below the target folder.
    pub folder: &'static str,
    /// All that they are made of, from the project's folder.
    pub sources: &'static [&'static str],
    /// The file without which there are no sources for this machine.
    pub own_source: String,
    /// Where else an image may come from, in the sentence that there is none.
    pub elsewhere: &'static str,
    /// Their files.
    pub images: &'static [&'static str],
}

/// A reason for which there is no image: a sentence without its stop.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct ImageError(pub String);

impl Recipe {
    /// The build failed with this output.
    pub(super) fn not_built(&self, output: &str) -> ImageError {
        ImageError(format!(
            "the {} could not be built; the compiler says:\n{}",
            self.what,
            output.trim_end()
        ))
    }
}
