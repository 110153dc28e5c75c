//! Lines to a chip in QEMU: two FIFOs in the private folder of its process, and
//! a pseudo-terminal whose other end the process holds.
//!
//! The chip opens, reads and writes the FIFOs by semihosting. A FIFO costs two
//! system calls a frame on either side and carries 64 KiB. The pseudo-terminal is
//! opened as a board's port is; only its name comes from the process, and the
//! process is asked how it ended.

use std::os::fd::OwnedFd;
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, read, write};

use super::guard::Guarded;
use super::line::{ChipError, Line, LineError};
use super::serial::SerialLine;
use super::spec::DEFAULT_BAUD;

/// Between two tries to open a FIFO that nobody reads yet, and two looks at what
/// the process says.
const RETRY: Duration = Duration::from_millis(1);

/// Time that an answer may take. An exchange takes 12 µs; on two cores with
/// eight busy processes up to 17 of 100,000 took longer than this, and were asked
/// for again at the cost of one frame each, 2026-11.
const PATIENCE: Duration = Duration::from_millis(5);

/// Tries until `process` has opened its end of a line, at most for `limit`.
fn wait_for<T>(
    process: &mut Guarded,
    limit: Duration,
    mut line: impl FnMut(&mut Guarded) -> Result<Option<T>, ChipError>,
) -> Result<T, ChipError> {
    let start = Instant::now();
    loop {
        if let Some(line) = line(process)? {
            return Ok(line);
        }
        if let Some(because) = process.ended() {
            return Err(not_started(process, because));
        }
        if start.elapsed() >= limit {
            return Err(ChipError::NotOpened {
                program: process.name().to_owned(),
                waited_s: limit.as_secs_f64(),
            });
        }
        sleep(RETRY);
    }
}

fn not_started(process: &Guarded, because: String) -> ChipError {
    ChipError::Start {
        program: process.name().to_owned(),
        because,
    }
}

/// Two FIFOs and the process at their other end.
#[derive(Debug)]
pub struct FifoLine {
    to_chip: OwnedFd,
    from_chip: OwnedFd,
    process: Guarded,
}

impl FifoLine {
    /// Waits for `process` to open its end, at most for `limit`.
    ///
    /// # Errors
    /// [`ChipError::Start`] if it ends before, [`ChipError::NotOpened`] if it
    /// takes longer.
    pub fn open(mut process: Guarded, limit: Duration) -> Result<Self, ChipError> {
        let flags = OFlags::NONBLOCK | OFlags::CLOEXEC;
        // Without NONBLOCK either would wait for the other end without limit.
        let from_chip = open(
            process.folder().join("from-chip"),
            flags | OFlags::RDONLY,
            Mode::empty(),
        )
        .map_err(|error| not_started(&process, format!("from-chip: {error}")))?;
        let path = process.folder().join("to-chip");
        let to_chip = wait_for(&mut process, limit, |process| {
            match open(&path, flags | OFlags::WRONLY, Mode::empty()) {
                Ok(to_chip) => Ok(Some(to_chip)),
                // Nobody reads it yet, or the folder is being removed.
                Err(Errno::NXIO | Errno::NOENT) => Ok(None),
                Err(error) => {
                    let because = process.ended();
                    let because = because.unwrap_or_else(|| format!("to-chip: {error}"));
                    Err(not_started(process, because))
                }
            }
        })?;
        Ok(Self {
            to_chip,
            from_chip,
            process,
        })
    }

    fn hung_up(&mut self) -> LineError {
        LineError {
            because: self.process.hung_up(),
        }
    }

    fn failed(&self, error: Errno) -> LineError {
        LineError {
            because: format!("the line to {} fails: {error}", self.process.name()),
        }
    }
}

impl Line for FifoLine {
    /// Loses what does not fit a FIFO that is not read.
    fn send(&mut self, bytes: &[u8]) -> Result<(), LineError> {
        loop {
            match write(&self.to_chip, bytes) {
                Ok(_) | Err(Errno::AGAIN) => return Ok(()),
                Err(Errno::INTR) => {}
                Err(Errno::PIPE) => return Err(self.hung_up()),
                Err(error) => return Err(self.failed(error)),
            }
        }
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, LineError> {
        let timeout = Timespec::try_from(timeout).ok();
        let mut ends = [PollFd::new(&self.from_chip, PollFlags::IN)];
        let flags = match poll(&mut ends, timeout.as_ref()) {
            Ok(0) => PollFlags::empty(),
            Ok(_) => {
                let [end] = &ends;
                end.revents()
            }
            Err(Errno::INTR) => return Ok(0),
            Err(error) => return Err(self.failed(error)),
        };
        if flags.contains(PollFlags::IN) {
            return match read(&self.from_chip, buffer) {
                Ok(count) => Ok(count),
                Err(Errno::AGAIN | Errno::INTR) => Ok(0),
                Err(error) => Err(self.failed(error)),
            };
        }
        // Set once a writer was there and is gone, and all is read.
        if flags.contains(PollFlags::HUP) {
            return Err(self.hung_up());
        }
        match self.process.ended() {
            Some(because) => Err(LineError { because }),
            None => Ok(0),
        }
    }

    fn patience(&self) -> Duration {
        PATIENCE
    }
}

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
        let path = wait_for(&mut process, limit, |process| {
            Ok(redirected_to(process.said()).map(str::to_owned))
        })?;
        // A pseudo-terminal has no speed of its own.
        let port = SerialLine::open(&path, DEFAULT_BAUD)?;
        Ok(Self { port, process })
    }

    /// The meaning of `result`: a port that is gone, or silent, may be a
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
