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
pub mod error;
#[cfg(unix)]
pub mod fifo;
#[cfg(unix)]
pub mod guard;
pub mod image;
pub mod line;
#[cfg(unix)]
mod one_cpu;
pub mod open;
#[cfg(unix)]
pub mod pty;
#[cfg(unix)]
pub mod qemu;
pub mod serial;
pub mod spec;

pub use chip_law::{ChipLaw, ChipLawError, ChipUnderTest, Meter, name_of, run_on_chip};
pub use error::ChipError;
pub use open::{Image, Opened, installed, open, open_cost};
