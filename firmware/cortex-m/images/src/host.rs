//! Files of the host, over Arm's semihosting: operation and block of parameters
//! to QEMU, one number back.

use core::ffi::CStr;

use crate::processor::semihosting;

// Operations: Arm, Semihosting for AArch32 and AArch64, 2022Q3, 6.
const OPEN: u32 = 0x01;
const WRITE: u32 = 0x05;
const READ: u32 = 0x06;
const EXIT_EXTENDED: u32 = 0x20;

/// `ADP_Stopped_ApplicationExit`: the program has ended by itself.
const APPLICATION_EXIT: usize = 0x2_0026;

/// A way to open a file: its number is that of C's mode.
#[derive(Debug, Clone, Copy)]
pub enum Mode {
    /// `rb`.
    Read,
    /// `wb`.
    Write,
}

/// A file of the host.
#[derive(Debug)]
pub struct File(usize);

impl File {
    /// Opens a file in the folder that QEMU runs in.
    pub fn open(name: &CStr, mode: Mode) -> Option<Self> {
        let mode = match mode {
            Mode::Read => 1,
            Mode::Write => 5,
        };
        let block = [name.as_ptr().expose_provenance(), mode, name.count_bytes()];
        // SAFETY: the block is that of the operation, and the name stays where it is.
        let file = unsafe { semihosting(OPEN, &block) };
        (file != usize::MAX).then_some(Self(file))
    }

    /// Waits for bytes: those that there are now, none at the file's end.
    pub fn read<'b>(&self, bytes: &'b mut [u8]) -> Option<&'b [u8]> {
        let block = [self.0, bytes.as_mut_ptr().expose_provenance(), bytes.len()];
        // SAFETY: the block is that of the operation, which writes no other bytes.
        let left = unsafe { semihosting(READ, &block) };
        bytes.get(..bytes.len().checked_sub(left)?)
    }

    /// Writes all of them; `None` if no one reads.
    pub fn write(&self, bytes: &[u8]) -> Option<()> {
        let block = [self.0, bytes.as_ptr().expose_provenance(), bytes.len()];
        // SAFETY: the block is that of the operation, which only reads.
        let left = unsafe { semihosting(WRITE, &block) };
        (left == 0).then_some(())
    }
}

/// Ends QEMU with status 0.
pub fn exit() -> ! {
    loop {
        // SAFETY: the block is that of the operation.
        unsafe { semihosting(EXIT_EXTENDED, &[APPLICATION_EXIT, 0]) };
    }
}
