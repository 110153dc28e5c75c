//! A line over two FIFOs in the private folder of a process.
//!
//! The chip in QEMU opens, reads and writes them by semihosting. A FIFO costs
//! two system calls a frame on either side and carries 64 KiB.

use std::os::fd::OwnedFd;
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, read, write};

use super::error::ChipError;
use super::guard::Guarded;
use super::line::{Line, LineError};

/// Between two tries to open a FIFO that nobody reads yet.
const RETRY: Duration = Duration::from_millis(1);

/// How long an answer may take. An exchange takes 12 µs; on two cores with
/// eight busy processes up to 17 of 100,000 took longer than this, and were asked
/// for again at the cost of one frame each, 2026-11.
const PATIENCE: Duration = Duration::from_millis(5);

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
        let failed = |process: &Guarded, because: String| ChipError::Start {
            program: process.name().to_owned(),
            because,
        };
        let flags = OFlags::NONBLOCK | OFlags::CLOEXEC;
        // Without NONBLOCK either would wait for the other end without limit.
        let from_chip = open(
            process.folder().join("from-chip"),
            flags | OFlags::RDONLY,
            Mode::empty(),
        )
        .map_err(|error| failed(&process, format!("from-chip: {error}")))?;
        let start = Instant::now();
        let path = process.folder().join("to-chip");
        let to_chip = loop {
            match open(&path, flags | OFlags::WRONLY, Mode::empty()) {
                Ok(to_chip) => break to_chip,
                Err(error) => {
                    if let Some(ended) = process.ended() {
                        return Err(failed(&process, ended));
                    }
                    // Nobody reads it yet, or the folder is being removed.
                    if error != Errno::NXIO && error != Errno::NOENT {
                        return Err(failed(&process, format!("to-chip: {error}")));
                    }
                }
            }
            if start.elapsed() >= limit {
                return Err(ChipError::NotOpened {
                    program: process.name().to_owned(),
                    waited_s: limit.as_secs_f64(),
                });
            }
            sleep(RETRY);
        };
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
