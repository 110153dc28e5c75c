//! Why there is no line to a chip.

use core::fmt;
use std::path::PathBuf;

use super::spec::Target;

/// Why there is no line to a chip. Nothing has been started, or it has been
/// ended again; the run cannot be made.
#[derive(Debug)]
#[non_exhaustive]
pub enum ChipError {
    /// The folder of ready images has none for this target.
    NoReadyImage {
        /// Where it must be.
        path: PathBuf,
    },
    /// There is no image and nothing to build it from.
    NoSources {
        /// The target.
        target: Target,
        /// Where the sources were.
        folder: PathBuf,
    },
    /// No compiler here builds for the target.
    NoCompiler {
        /// The target.
        target: Target,
    },
    /// No linker here links for the target.
    NoLinker {
        /// The target.
        target: Target,
    },
    /// The image could not be built.
    Build {
        /// The target.
        target: Target,
        /// What the compiler said.
        output: String,
    },
    /// A file that is no image for a chip.
    NotAnImage {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, a sentence without its stop.
        because: String,
    },
    /// A program is not installed.
    NoProgram {
        /// The program.
        program: &'static str,
        /// Debian's package that has it.
        package: &'static str,
    },
    /// A program could not be started, or ended before the line was open.
    Start {
        /// The program.
        program: String,
        /// What has happened, a sentence without its stop.
        because: String,
    },
    /// The program runs, but has not opened its end of the line.
    NotOpened {
        /// The program.
        program: String,
        /// How long it was waited for \[s\].
        waited_s: f64,
    },
    /// A serial port could not be opened.
    Port {
        /// The port.
        path: String,
        /// What the system says.
        because: String,
    },
    /// QEMU's lines need a system with FIFOs and pseudo-terminals.
    NotUnix,
}

impl fmt::Display for ChipError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoReadyImage { path } => write!(
                f,
                "{} is not there; MCU_IMAGE_DIR must name a folder that has it, or be unset",
                path.display()
            ),
            Self::NoSources { target, folder } => write!(
                f,
                "there is no image for {} and no firmware in {} to build it from; \
                 MCU_IMAGE_DIR may name a folder with ready images",
                target.name(),
                folder.display()
            ),
            Self::NoCompiler { target } => write!(
                f,
                "no compiler here builds for {triple}; install its core with \
                 `rustup target add {triple}`, or Debian's compiler and the core's sources with \
                 `apt-get install --no-install-recommends rustc-web cargo-web rust-web-src lld`",
                triple = target.triple()
            ),
            Self::NoLinker { target } => write!(
                f,
                "no linker here links for {}; install one, for example with \
                 `apt-get install --no-install-recommends lld`",
                target.triple()
            ),
            Self::Build { target, output } => write!(
                f,
                "the image for {} could not be built; the compiler says:\n{}",
                target.name(),
                output.trim_end()
            ),
            Self::NotAnImage { path, because } => {
                write!(f, "{} is no image for a chip: {because}", path.display())
            }
            Self::NoProgram { program, package } => write!(
                f,
                "{program} is missing; install it, for example with \
                 `apt-get install --no-install-recommends {package}`"
            ),
            Self::Start { program, because } => {
                write!(f, "{program} could not be started: {because}")
            }
            Self::NotOpened { program, waited_s } => write!(
                f,
                "{program} runs, but its image has not opened the line within {waited_s} s"
            ),
            Self::Port { path, because } => {
                write!(f, "the serial port {path} cannot be opened: {because}")
            }
            Self::NotUnix => f.write_str(
                "a chip in QEMU needs FIFOs and pseudo-terminals, which this system does not \
                 have; serial:PORT[@BAUD] works here",
            ),
        }
    }
}

impl std::error::Error for ChipError {}
