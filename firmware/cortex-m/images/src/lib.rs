//! The controller on a chip: [`firmware_link::Server`] behind a line.
//!
//! ```text
//!  bin/fifo.rs            bin/uart.rs
//!      │ semihosting          │ interrupt ─► ring, WFI
//!      └───────► line ◄───────┘
//!                 │ frames
//!          firmware_link::Server ─► chip: timer, stack, identity
//!                                     │
//!                                   board/
//! ```
//!
//! The board is chosen by the compile target. Nothing here can panic: see
//! [`parts`].

#![no_std]

#[cfg(target_arch = "arm")]
mod arm_copy;
#[cfg_attr(board = "m0", path = "board/m0.rs")]
#[cfg_attr(any(board = "m3", board = "m4"), path = "board/mps2.rs")]
#[cfg_attr(board = "rv32", path = "board/rv32.rs")]
pub mod board;
pub mod chip;
pub mod host;
pub mod line;
#[cfg_attr(target_arch = "arm", path = "arm.rs")]
#[cfg_attr(target_arch = "riscv32", path = "riscv.rs")]
mod processor;
mod register;

pub use processor::{entry, sleep_unless, unmask_uart};
