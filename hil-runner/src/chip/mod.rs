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
pub mod open;
#[cfg(unix)]
pub mod qemu;
#[cfg(unix)]
pub mod qemu_lines;
pub mod serial;
pub mod spec;

pub use chip_law::{ChipLaw, ChipLawError, ChipUnderTest, name_of, run_on_chip};
pub use line::ChipError;
pub use meter::Meter;
pub use open::{Image, Opened, installed, open, open_cost};
