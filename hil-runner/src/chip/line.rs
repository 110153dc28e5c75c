//! A line to a chip: bytes out, bytes in, no more; the reasons for which there
//! is none; and the line over a serial port, to a board or to QEMU's chip behind
//! a pseudo-terminal.

use std::fmt;
use std::io::{ErrorKind, Read, Write};
use std::time::Duration;

use firmware_link::frame::LARGEST_FRAME;
use hil_core::error::RunError;
use hil_core::message::LinkError;
use serialport::{ClearBuffer, SerialPort};
use thiserror::Error;

/// A line to a chip. Bytes may be damaged, lost or doubled on it; what is built
/// on it has to find that out.
pub trait Line: fmt::Debug + Send {
    /// Hands bytes to the line.
    ///
    /// # Errors
    /// [`ChipError`] if the other end is gone.
    fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError>;

    /// Waits for bytes, at most for `timeout`; gives how many there are now in
    /// `buffer`, 0 if none came.
    ///
    /// # Errors
    /// [`ChipError`] if the other end is gone.
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, ChipError>;

    /// Time that an answer may take before it counts as lost and is asked for
    /// again.
    fn patience(&self) -> Duration;
}

/// A reason for which there is no chip, or no longer one, or for which it does
/// not do what it is asked: a sentence without its stop, such as "QEMU has ended
/// with signal 9". Whatever was started has been ended.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct ChipError(pub String);

impl From<&str> for ChipError {
    fn from(sentence: &str) -> Self {
        Self(sentence.to_owned())
    }
}

impl From<ChipError> for RunError {
    fn from(ChipError(sentence): ChipError) -> Self {
        Self::Link(LinkError::Refused(sentence))
    }
}

/// Time that the system and an adapter may add to an answer: USB polls in
/// milliseconds, and some adapters gather bytes for 16 ms.
const LATENCY: Duration = Duration::from_millis(50);

/// A start bit, eight of data, a stop bit.
const BITS_PER_BYTE: f64 = 10.0;

#[cfg(unix)]
type Port = serialport::TTYPort;
#[cfg(windows)]
type Port = serialport::COMPort;

/// A serial port with a chip at its other end.
#[derive(Debug)]
pub struct SerialLine {
    path: String,
    port: Port,
    patience: Duration,
}

impl SerialLine {
    /// Opens the port for itself alone: 8 bits, no parity, one stop bit, no flow
    /// control.
    ///
    /// # Errors
    /// [`ChipError`] if it is not there, not allowed or in use.
    pub fn open(path: &str, baud: u32) -> Result<Self, ChipError> {
        let failed = |error: serialport::Error| {
            let because = error.description;
            let help = match error.kind {
                serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
                    "; on many systems the user must be in the group dialout"
                }
                _ => "",
            };
            ChipError(format!(
                "the serial port {path} cannot be opened: {because}{help}"
            ))
        };
        let line_s = 2.0 * LARGEST_FRAME as f64 * BITS_PER_BYTE / f64::from(baud);
        let patience = LATENCY + Duration::from_secs_f64(line_s);
        let port = serialport::new(path, baud)
            .timeout(patience)
            .open_native()
            .map_err(failed)?;
        unblock(&port).map_err(failed)?;
        // What is left of an earlier session.
        port.clear(ClearBuffer::All).map_err(failed)?;
        Ok(Self {
            path: path.to_owned(),
            port,
            patience,
        })
    }

    fn gone(&self, because: &str) -> ChipError {
        ChipError(format!("the serial port {} is gone: {because}", self.path))
    }
}

/// Lets a write end where there is no room left: a chip that does not read
/// would stop this program otherwise, as `serialport` waits for room for one
/// byte only.
#[cfg(unix)]
fn unblock(port: &Port) -> serialport::Result<()> {
    use nix::fcntl::{FcntlArg, OFlag, fcntl};
    use std::os::fd::AsRawFd;

    fcntl(port.as_raw_fd(), FcntlArg::F_SETFL(OFlag::O_NONBLOCK))
        .map(drop)
        .map_err(|error| std::io::Error::from(error).into())
}

/// Windows ends a write at its time-out.
#[cfg(windows)]
fn unblock(_: &Port) -> serialport::Result<()> {
    Ok(())
}

impl Line for SerialLine {
    /// Loses what a port does not take that is not emptied.
    fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
        let mut left = bytes;
        // The time-out of the last wait for an answer may have been short.
        let waits = self.port.set_timeout(self.patience);
        waits.map_err(|error| self.gone(&error.description))?;
        while !left.is_empty() {
            match self.port.write(left) {
                Ok(count @ 1..) => left = left.get(count..).unwrap_or_default(),
                Ok(0) => return Ok(()),
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted => {}
                    ErrorKind::TimedOut | ErrorKind::WouldBlock => return Ok(()),
                    _ => return Err(self.gone(&error.to_string())),
                },
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, ChipError> {
        let waits = self.port.set_timeout(timeout);
        waits.map_err(|error| self.gone(&error.description))?;
        match self.port.read(buffer) {
            // There was something to read, and it was the end.
            Ok(0) if !buffer.is_empty() => Err(self.gone("it was closed")),
            Ok(count) => Ok(count),
            Err(error) => match error.kind() {
                ErrorKind::Interrupted | ErrorKind::TimedOut | ErrorKind::WouldBlock => Ok(0),
                _ => Err(self.gone(&error.to_string())),
            },
        }
    }

    fn patience(&self) -> Duration {
        self.patience
    }
}

impl Drop for SerialLine {
    fn drop(&mut self) {
        // Closing would wait up to 30 s for a chip to take what is left.
        let _ = self.port.clear(ClearBuffer::All);
    }
}
