//! The controller on its chip: QEMU or a board at the other end of a line.
//!
//! ```text
//!  ChipLink ──► open ──► Line ──► frames (firmware::link) ──► Server on the chip
//!  "qemu:m4"             FIFO, serial port
//! ```

pub mod client;
pub mod figures;
pub mod line;
pub mod spec;
