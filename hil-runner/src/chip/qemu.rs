//! QEMU with an image of the firmware, and its lines: two FIFOs in the private
//! folder of its process, and a pseudo-terminal whose other end the process holds.
//!
//! In lockstep one of the two always waits for the other. On two processors
//! each answer has to wake a processor that sleeps; on one, the scheduler
//! hands over at once. Only Linux is asked for it.
//!
//! The chip opens, reads and writes the FIFOs by semihosting. A FIFO costs two
//! system calls a frame on either side and carries 64 KiB. The pseudo-terminal is
//! opened as a board's port is; only its name comes from the process, and the
//! process is asked how it ended.

use std::ffi::OsString;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, read, write};

use super::guard::{Guarded, not_started};
use super::line::{ChipError, Line, SerialLine};
use super::spec::{DEFAULT_BAUD, Target, Transport};
use crate::image::on_path;

/// Virtual time per instruction is 2^7 ns, whatever the host does meanwhile:
/// the chip's timer counts instructions. An idle chip does not wait for the
/// host's clock; with `sleep=on` one behind its UART sometimes slept for ever,
/// 2026-11. An exchange over the FIFOs takes 10 µs to 12 µs of processor
/// time with and without, 2026-11.
const COUNTED: &str = "shift=7,sleep=off,align=off";

/// The path of QEMU for `target`.
///
/// # Errors
/// [`ChipError`] if it is not on the search path.
pub fn find(target: Target) -> Result<PathBuf, ChipError> {
    // Debian's package has another name than the program where it has several.
    let (program, package) = match target {
        Target::M4 | Target::M0 | Target::M3 => ("qemu-system-arm", "qemu-system-arm"),
        Target::Rv32 => ("qemu-system-riscv32", "qemu-system-misc"),
    };
    on_path(program).ok_or_else(|| {
        ChipError(format!(
            "{program} is missing; install it, for example with \
             `apt-get install --no-install-recommends {package}`"
        ))
    })
}

/// Starts QEMU with `image`.
///
/// # Errors
/// [`ChipError`] if QEMU is not installed, or cannot be started.
pub fn start(target: Target, transport: Transport, image: &Path) -> Result<Guarded, ChipError> {
    start_with(target, transport, image, Vec::new())
}

/// Starts QEMU with an image that may do anything, over its FIFOs. Every
/// instruction goes into the file `log` when it is first translated, by
/// address, bytes and text; a program that the image asks the host to run ends
/// QEMU, where it can be told so.
///
/// # Errors
/// As [`start`].
pub(super) fn start_logged(target: Target, image: &Path, log: &Path) -> Result<Guarded, ChipError> {
    let mut more: Vec<OsString> = ["-d", "in_asm", "-D"].map(OsString::from).into();
    more.push(log.into());
    if cfg!(target_os = "linux") {
        more.extend(["-sandbox", "on,spawn=deny"].map(OsString::from));
    }
    start_with(target, Transport::Fifo, image, more)
}

fn start_with(
    target: Target,
    transport: Transport,
    image: &Path,
    more: Vec<OsString>,
) -> Result<Guarded, ChipError> {
    let serial = match transport {
        Transport::Fifo => "none",
        Transport::Uart => "pty",
    };
    // Its board would start a boot loader first.
    let bios: &[&str] = match target {
        Target::Rv32 => &["-bios", "none"],
        _ => &[],
    };
    // QEMU runs in a folder of its own.
    let image = std::path::absolute(image).unwrap_or_else(|_| image.to_path_buf());
    let arguments = ["-machine", target.machine(), "-display", "none"]
        .into_iter()
        .chain(["-monitor", "none", "-nodefaults", "-serial", serial])
        .chain(["-icount", COUNTED])
        .chain(["-semihosting-config", "enable=on,target=native"])
        .chain(bios.iter().copied())
        .chain(["-kernel"])
        .map(OsString::from)
        .chain([image.into()])
        .chain(more);
    Guarded::start("QEMU", &find(target)?, arguments)
}

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
            return Err(not_started(process.name(), &because));
        }
        if start.elapsed() >= limit {
            return Err(ChipError(format!(
                "{} runs, but its image has not opened the line within {} s",
                process.name(),
                limit.as_secs_f64()
            )));
        }
        sleep(RETRY);
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
    /// [`ChipError`] if it ends before, or takes longer.
    pub fn open(mut process: Guarded, limit: Duration) -> Result<Self, ChipError> {
        let flags = OFlags::NONBLOCK | OFlags::CLOEXEC;
        // Without NONBLOCK either would wait for the other end without limit.
        let path = process.folder().join("from-chip");
        let from_chip = open(path, flags | OFlags::RDONLY, Mode::empty())
            .map_err(|error| not_started(process.name(), &format!("from-chip: {error}")))?;
        let path = process.folder().join("to-chip");
        let to_chip = wait_for(&mut process, limit, |process| {
            match open(&path, flags | OFlags::WRONLY, Mode::empty()) {
                Ok(to_chip) => Ok(Some(to_chip)),
                // Nobody reads it yet, or the folder is being removed.
                Err(Errno::NXIO | Errno::NOENT) => Ok(None),
                Err(error) => {
                    let because = process.ended();
                    let because = because.unwrap_or_else(|| format!("to-chip: {error}"));
                    Err(not_started(process.name(), &because))
                }
            }
        })?;
        Ok(Self {
            to_chip,
            from_chip,
            process,
        })
    }

    fn failed(&self, error: Errno) -> ChipError {
        let name = self.process.name();
        ChipError(format!("the line to {name} fails: {error}"))
    }
}

impl Line for FifoLine {
    /// Loses what does not fit a FIFO that is not read.
    fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
        loop {
            match write(&self.to_chip, bytes) {
                Ok(_) | Err(Errno::AGAIN) => return Ok(()),
                Err(Errno::INTR) => {}
                Err(Errno::PIPE) => return Err(self.process.hung_up()),
                Err(error) => return Err(self.failed(error)),
            }
        }
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, ChipError> {
        let timeout = Timespec::try_from(timeout).ok();
        let mut ends = [PollFd::new(&self.from_chip, PollFlags::IN)];
        let flags = match poll(&mut ends, timeout.as_ref()) {
            Ok(_) => ends[0].revents(),
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
            return Err(self.process.hung_up());
        }
        self.process.check().map(|()| 0)
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
    /// [`ChipError`] if it ends before, or takes longer, or the port cannot be
    /// opened.
    pub fn open(mut process: Guarded, limit: Duration) -> Result<Self, ChipError> {
        let path = wait_for(&mut process, limit, |process| {
            Ok(redirected_to(process.said()).map(str::to_owned))
        })?;
        // A pseudo-terminal has no speed of its own.
        let port = SerialLine::open(&path, DEFAULT_BAUD)?;
        Ok(Self { port, process })
    }
}

/// The pseudo-terminal in "char device redirected to /dev/pts/3 (label
/// serial0)".
fn redirected_to(said: &str) -> Option<&str> {
    let (_, after) = said.split_once("redirected to ")?;
    let (path, _) = after.split_once([' ', '\n'])?;
    Some(path)
}

/// A port that is gone, or silent, may be a process that has ended.
impl Line for PtyLine {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
        let sent = self.port.send(bytes);
        sent.map_err(|_| self.process.hung_up())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, ChipError> {
        let received = self.port.receive(buffer, timeout);
        let count = received.map_err(|_| self.process.hung_up())?;
        if count == 0 {
            self.process.check()?;
        }
        Ok(count)
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
