//! Parts of the board's image that do not know its chip: the axis that it
//! drives, what its button asks for, how it numbers samples, and what it
//! answers while it drives.
//!
//! The other half of this package, the image itself, puts these on the chip's
//! timers, pins and lines. Here nothing needs one, so the tests run on the host.

#![no_std]

pub mod axis;
mod drive;
mod refusal;

pub use drive::{Button, Drive, Ticks};
pub use refusal::answer_while_driving;
