//! A line over a pseudo-terminal whose other end a process holds.
//!
//! The port is opened as a board's is; only its name comes from the process,
//! and the process is asked how it ended.

use std::thread::sleep;
use std::time::{Duration, Instant};

use super::error::ChipError;
use super::guard::Guarded;
use super::line::{Line, LineError};
use super::serial::SerialLine;
use super::spec::DEFAULT_BAUD;

/// Between two looks at what the process says.
const LOOK: Duration = Duration::from_millis(1);

/// A pseudo-terminal and the process behind it.
#[derive(Debug)]
pub struct PtyLine {
    port: SerialLine,
    process: Guarded,
}

impl PtyLine {
    /// Waits for `process` to say where its pseudo-terminal is, at most for
    /// `limit`.
    ///
    /// # Errors
    /// [`ChipError::Start`] if it ends before, [`ChipError::NotOpened`] if it
    /// takes longer, [`ChipError::Port`] if the port cannot be opened.
    pub fn open(mut process: Guarded, limit: Duration) -> Result<Self, ChipError> {
        let start = Instant::now();
        let path = loop {
            if let Some(path) = redirected_to(process.said()) {
                break path.to_owned();
            }
            if let Some(because) = process.ended() {
                return Err(ChipError::Start {
                    program: process.name().to_owned(),
                    because,
                });
            }
            if start.elapsed() >= limit {
                return Err(ChipError::NotOpened {
                    program: process.name().to_owned(),
                    waited_s: limit.as_secs_f64(),
                });
            }
            sleep(LOOK);
        };
        // A pseudo-terminal has no speed of its own.
        let port = SerialLine::open(&path, DEFAULT_BAUD)?;
        Ok(Self { port, process })
    }

    /// What `result` really means: a port that is gone, or silent, may be a
    /// process that has ended.
    fn told<T>(&mut self, result: Result<T, LineError>) -> Result<T, LineError> {
        match result {
            Ok(value) => Ok(value),
            Err(_) => Err(LineError {
                because: self.process.hung_up(),
            }),
        }
    }
}

/// The pseudo-terminal in "char device redirected to /dev/pts/3 (label
/// serial0)".
fn redirected_to(said: &str) -> Option<&str> {
    let (_, after) = said.split_once("redirected to ")?;
    let (path, _) = after.split_once([' ', '\n'])?;
    Some(path)
}

impl Line for PtyLine {
    fn send(&mut self, bytes: &[u8]) -> Result<(), LineError> {
        let sent = self.port.send(bytes);
        self.told(sent)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, LineError> {
        let received = self.port.receive(buffer, timeout);
        match self.told(received)? {
            0 => match self.process.ended() {
                Some(because) => Err(LineError { because }),
                None => Ok(0),
            },
            count => Ok(count),
        }
    }

    fn patience(&self) -> Duration {
        self.port.patience()
    }
}

#[cfg(test)]
mod tests {
    use super::redirected_to;

    #[test]
    fn port_is_found_in_what_qemu_says() {
        let said = "a warning\nchar device redirected to /dev/pts/12 (label serial0)\n";
        assert_eq!(redirected_to(said), Some("/dev/pts/12"));
        // Half of it is not a name.
        assert_eq!(redirected_to("char device redirected to /dev/pts/1"), None);
    }
}
