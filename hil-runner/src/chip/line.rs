//! A line to a chip: bytes out, bytes in, no more; and the reasons for which
//! there is none.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use thiserror::Error;

use super::spec::Target;

/// A line to a chip. Bytes may be damaged, lost or doubled on it; what is built
/// on it has to find that out.
pub trait Line: fmt::Debug + Send {
    /// Hands bytes to the line.
    ///
    /// # Errors
    /// [`LineError`] if the other end is gone.
    fn send(&mut self, bytes: &[u8]) -> Result<(), LineError>;

    /// Waits for bytes, at most for `timeout`; gives how many there are now in
    /// `buffer`, 0 if none came.
    ///
    /// # Errors
    /// [`LineError`] if the other end is gone.
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, LineError>;

    /// Time that an answer may take before it counts as lost and is asked for
    /// again.
    fn patience(&self) -> Duration;
}

/// A line that has ended.
#[derive(Debug, Error)]
#[error("{because}")]
pub struct LineError {
    /// The event, a sentence without its stop: "QEMU has ended with signal 9".
    pub because: String,
}

/// A reason for which there is no line to a chip. Nothing has been started, or it has been
/// ended again; the run cannot be made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ChipError {
    /// The folder of ready images has none for this target.
    #[error(
        "{} is not there; MCU_IMAGE_DIR must name a folder that has it, or be unset",
        path.display()
    )]
    NoReadyImage {
        /// The path that must have it.
        path: PathBuf,
    },
    /// There is no image and nothing to build it from.
    #[error(
        "there is no image for {} and no firmware in {} to build it from; MCU_IMAGE_DIR may name a \
         folder with ready images",
        target.name(),
        folder.display()
    )]
    NoSources {
        /// The target.
        target: Target,
        /// The folder that had the sources.
        folder: PathBuf,
    },
    /// No compiler here builds for the target.
    #[error(
        "no compiler here builds for {triple}; install its core with `rustup target add {triple}`, or \
         Debian's compiler and the core's sources with \
         `apt-get install --no-install-recommends rustc-web cargo-web rust-web-src lld`",
        triple = target.triple()
    )]
    NoCompiler {
        /// The target.
        target: Target,
    },
    /// No linker here links for the target.
    #[error(
        "no linker here links for {}; install one, for example with \
         `apt-get install --no-install-recommends lld`",
        target.triple()
    )]
    NoLinker {
        /// The target.
        target: Target,
    },
    /// The image could not be built.
    #[error(
        "the image for {} could not be built; the compiler says:\n{}",
        target.name(),
        output.trim_end()
    )]
    Build {
        /// The target.
        target: Target,
        /// The words of the compiler.
        output: String,
    },
    /// A file that is no image for a chip.
    #[error("{} is no image for a chip: {because}", path.display())]
    NotAnImage {
        /// The file.
        path: PathBuf,
        /// Its mistake, a sentence without its stop.
        because: String,
    },
    /// A program is not installed.
    #[error(
        "{program} is missing; install it, for example with \
         `apt-get install --no-install-recommends {package}`"
    )]
    NoProgram {
        /// The program.
        program: &'static str,
        /// Debian's package that has it.
        package: &'static str,
    },
    /// A program could not be started, or ended before the line was open.
    #[error("{program} could not be started: {because}")]
    Start {
        /// The program.
        program: String,
        /// The event, a sentence without its stop.
        because: String,
    },
    /// The program runs, but has not opened its end of the line.
    #[error("{program} runs, but its image has not opened the line within {waited_s} s")]
    NotOpened {
        /// The program.
        program: String,
        /// Time that it was waited for \[s\].
        waited_s: f64,
    },
    /// A serial port could not be opened.
    #[error("the serial port {path} cannot be opened: {because}")]
    Port {
        /// The port.
        path: String,
        /// The words of the system.
        because: String,
    },
    /// QEMU's lines need a system with FIFOs and pseudo-terminals.
    #[error(
        "a chip in QEMU needs FIFOs and pseudo-terminals, which this system does not have; \
         serial:PORT[@BAUD] works here"
    )]
    NotUnix,
}
