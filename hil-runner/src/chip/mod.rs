//! The controller on its chip: QEMU or a board at the other end of a line.
//!
//! ```text
//!  ChipLink ──► open ──► Line ──► frames (firmware_link) ──► Server on the chip
//!  "qemu:m4"             FIFO, serial port
//! ```

pub mod budget;
pub mod certify;
mod chip_law;
pub mod client;
#[cfg(unix)]
pub mod guard;
pub mod image;
pub mod line;
mod meter;
#[cfg(unix)]
pub mod qemu;
pub mod spec;
pub mod wasm;

pub use chip_law::{ChipLaw, name_of};
pub use line::ChipError;
pub use meter::Meter;

use image::Finder;
use line::{Line, SerialLine};
use spec::{COST_IMAGE, ChipLink, Target, Transport};

/// A line to a chip, before the first byte on it.
#[derive(Debug)]
pub struct Opened {
    /// The line.
    pub line: Box<dyn Line>,
    /// CRC-32 over the flash that the image fills, [`crate::chip::image::crc32`],
    /// where this side has put one on the chip.
    pub image_crc: Option<u32>,
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
            image_crc: None,
        }),
        ChipLink::Qemu { target, transport } => {
            in_qemu(*target, transport.image(), *transport, tell)
        }
    }
}

/// Starts the image of a target that measures what a sample costs; it says what
/// [`budget`] reads. As [`open`] otherwise.
///
/// # Errors
/// [`ChipError`]. Nothing that was started is left.
pub fn open_cost(target: Target, tell: &mut dyn FnMut(&str)) -> Result<Opened, ChipError> {
    in_qemu(target, COST_IMAGE, Transport::Fifo, tell)
}

/// Every target in QEMU, and what is missing where it cannot be run here. An
/// image that would have to be built counts as there.
pub fn installed(transport: Transport) -> Vec<(Target, Result<(), ChipError>)> {
    let finder = Finder::from_environment();
    let there = |target| {
        qemu_is_here(target)?;
        finder.available(target, transport.image())
    };
    Target::ALL.map(|target| (target, there(target))).into()
}

#[cfg(unix)]
fn qemu_is_here(target: Target) -> Result<(), ChipError> {
    qemu::find(target).map(drop)
}

#[cfg(unix)]
fn in_qemu(
    target: Target,
    image: &str,
    transport: Transport,
    tell: &mut dyn FnMut(&str),
) -> Result<Opened, ChipError> {
    use guard::OneCpu;
    use image::crc32;
    use qemu::{FifoLine, PtyLine};
    use std::time::Duration;

    /// QEMU was there in 25 ms to 150 ms with five busy processes on two
    /// cores, 2026-11.
    const OPENED: Duration = Duration::from_secs(10);

    // Before a build for nothing.
    qemu::find(target)?;
    let path = Finder::from_environment().image(target, image, tell)?;
    let image_crc = Some(crc32(&path)?);
    let one_cpu = OneCpu::keep();
    let mut process = qemu::start(target, transport, &path)?;
    process.one_cpu = Some(one_cpu);
    let line: Box<dyn Line> = match transport {
        Transport::Fifo => Box::new(FifoLine::open(process, OPENED)?),
        Transport::Uart => Box::new(PtyLine::open(process, OPENED)?),
    };
    Ok(Opened { line, image_crc })
}

#[cfg(not(unix))]
const NOT_UNIX: &str = "a chip in QEMU needs FIFOs and pseudo-terminals, which this system does not \
                        have; serial:PORT[@BAUD] works here";

#[cfg(not(unix))]
fn qemu_is_here(_: Target) -> Result<(), ChipError> {
    Err(NOT_UNIX.into())
}

#[cfg(not(unix))]
fn in_qemu(_: Target, _: &str, _: Transport, _: &mut dyn FnMut(&str)) -> Result<Opened, ChipError> {
    Err(NOT_UNIX.into())
}
