//! From a link's name to the line.

use std::path::PathBuf;

use super::image::Finder;
use super::line::{ChipError, Line};
use super::serial::SerialLine;
use super::spec::{ChipLink, Program, Target, Transport};

/// A line to a chip, before the first byte on it.
#[derive(Debug)]
pub struct Opened {
    /// The line.
    pub line: Box<dyn Line>,
    /// The image on the chip, where this side has put it there.
    pub image: Option<Image>,
}

/// An image that a chip was started with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Its file.
    pub path: PathBuf,
    /// CRC-32 over the flash that it fills, [`crate::chip::image::crc32`].
    pub crc32: u32,
}

/// Opens a line; an image that is missing or stale is built on the way, of
/// which `tell` gets one line, without its end.
///
/// # Errors
/// [`ChipError`]. Nothing that was started is left.
pub fn open(link: &ChipLink, tell: &mut dyn FnMut(&str)) -> Result<Opened, ChipError> {
    match link {
        ChipLink::Serial { path, baud } => Ok(Opened {
            line: Box::new(SerialLine::open(path, *baud)?),
            image: None,
        }),
        ChipLink::Qemu { target, transport } => in_qemu(*target, (*transport).into(), tell),
    }
}

/// Starts the image of a target that measures what a sample costs; it says what
/// [`super::budget`] reads. As [`open`] otherwise.
///
/// # Errors
/// [`ChipError`]. Nothing that was started is left.
pub fn open_cost(target: Target, tell: &mut dyn FnMut(&str)) -> Result<Opened, ChipError> {
    in_qemu(target, Program::Cost, tell)
}

/// Every target in QEMU, and what is missing where it cannot be run here. An
/// image that would have to be built counts as there.
pub fn installed(transport: Transport) -> Vec<(Target, Result<(), ChipError>)> {
    let finder = Finder::from_environment();
    Target::ALL
        .into_iter()
        .map(|target| {
            let there = qemu_is_here(target).and_then(|()| finder.available(target, transport));
            (target, there)
        })
        .collect()
}

#[cfg(unix)]
fn qemu_is_here(target: Target) -> Result<(), ChipError> {
    super::qemu::find(target).map(drop)
}

#[cfg(unix)]
fn in_qemu(
    target: Target,
    program: Program,
    tell: &mut dyn FnMut(&str),
) -> Result<Opened, ChipError> {
    use super::image::crc32;
    use super::qemu::{self, OnOneCpu, OneCpu};
    use super::qemu_lines::{FifoLine, PtyLine};
    use std::time::Duration;

    /// QEMU was there in 25 ms to 150 ms with five busy processes on two
    /// cores, 2026-11.
    const OPENED: Duration = Duration::from_secs(10);

    // Before a build for nothing.
    qemu::find(target)?;
    let path = Finder::from_environment().image(target, program, tell)?;
    let transport = program.transport();
    let crc32 = crc32(&path)?;
    let cpu = OneCpu::keep();
    let process = qemu::start(target, transport, &path)?;
    let line: Box<dyn Line> = match transport {
        Transport::Fifo => Box::new(OnOneCpu {
            line: FifoLine::open(process, OPENED)?,
            _cpu: cpu,
        }),
        Transport::Uart => Box::new(OnOneCpu {
            line: PtyLine::open(process, OPENED)?,
            _cpu: cpu,
        }),
    };
    Ok(Opened {
        line,
        image: Some(Image { path, crc32 }),
    })
}

#[cfg(not(unix))]
fn qemu_is_here(_: Target) -> Result<(), ChipError> {
    Err(ChipError::NotUnix)
}

#[cfg(not(unix))]
fn in_qemu(_: Target, _: Program, _: &mut dyn FnMut(&str)) -> Result<Opened, ChipError> {
    Err(ChipError::NotUnix)
}
