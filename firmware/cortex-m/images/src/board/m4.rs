//! QEMU's mps2-an386: Cortex-M4, no FPU used.

/// Name of the board.
pub const NAME: [u8; 8] = *b"m4\0\0\0\0\0\0";

/// Setpoints that its table holds.
pub const TABLE_CAPACITY: usize = firmware::CAPACITY;

/// Frequency of the processor's clock \[Hz\].
pub const TIMER_HZ: u32 = 25_000_000;

/// Parts of a tick that are told apart ([`crate::chip`]).
pub const TICK_PARTS: u32 = 125;

#[path = "cmsdk.rs"]
mod cmsdk;
pub use cmsdk::uart;
