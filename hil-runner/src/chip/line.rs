//! A line to a chip: bytes out, bytes in, no more.

use core::fmt;
use std::time::Duration;

/// A line to a chip. Bytes may be damaged, lost or doubled on it; what is built
/// on it has to find that out.
pub trait Line: fmt::Debug + Send {
    /// Hands bytes to the line.
    ///
    /// # Errors
    /// [`LineError`] if the other end is gone.
    fn send(&mut self, bytes: &[u8]) -> Result<(), LineError>;

    /// Waits for bytes, at most for `timeout`; gives how many there are now in
    /// `buffer`, 0 if none came.
    ///
    /// # Errors
    /// [`LineError`] if the other end is gone.
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, LineError>;

    /// How long an answer may take before it counts as lost and is asked for
    /// again.
    fn patience(&self) -> Duration;
}

/// A line that has ended.
#[derive(Debug)]
pub struct LineError {
    /// What has happened, a sentence without its stop: "QEMU has ended with
    /// signal 9".
    pub because: String,
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.because)
    }
}

impl std::error::Error for LineError {}
