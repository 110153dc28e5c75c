//! QEMU with an image of the firmware, on the processor of this program.
//!
//! In lockstep one of the two always waits for the other. On two processors
//! each answer has to wake a processor that sleeps; on one, the scheduler
//! hands over at once. Only Linux is asked for it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::guard::Guarded;
use super::line::{ChipError, Line, LineError};
use super::spec::{Target, Transport};

/// Virtual time per instruction is 2^7 ns, whatever the host does meanwhile:
/// the chip's timer counts instructions. An idle chip does not wait for the
/// host's clock; with `sleep=on` one behind its UART sometimes slept for ever,
/// 2026-11. An exchange over the FIFOs takes 10 µs to 12 µs of processor
/// time with and without, 2026-11.
const COUNTED: &str = "shift=7,sleep=off,align=off";

/// QEMU's program for a target, and Debian's package that has it.
const fn program(target: Target) -> (&'static str, &'static str) {
    match target {
        Target::M4 | Target::M0 | Target::M3 => ("qemu-system-arm", "qemu-system-arm"),
        Target::Rv32 => ("qemu-system-riscv32", "qemu-system-misc"),
    }
}

/// The board that has the processor.
const fn machine(target: Target) -> &'static str {
    match target {
        Target::M4 => "mps2-an386",
        Target::M0 => "microbit",
        Target::M3 => "mps2-an385",
        Target::Rv32 => "virt",
    }
}

/// The path of QEMU for `target`.
///
/// # Errors
/// [`ChipError::NoProgram`] if it is not on the search path.
pub fn find(target: Target) -> Result<PathBuf, ChipError> {
    let (program, package) = program(target);
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths)
        .map(|folder| folder.join(program))
        .find(|path| path.is_file())
        .ok_or(ChipError::NoProgram { program, package })
}

/// The arguments that QEMU is started with.
fn arguments(target: Target, transport: Transport, image: &Path) -> Vec<OsString> {
    let serial = match transport {
        Transport::Fifo => "none",
        Transport::Uart => "pty",
    };
    let mut arguments: Vec<OsString> = ["-machine", machine(target)]
        .into_iter()
        .chain(["-display", "none", "-monitor", "none", "-nodefaults"])
        .chain(["-serial", serial, "-icount", COUNTED])
        .chain(["-semihosting-config", "enable=on,target=native"])
        .map(OsString::from)
        .collect();
    if target == Target::Rv32 {
        // Its board would start a boot loader first.
        arguments.extend(["-bios", "none"].map(OsString::from));
    }
    arguments.push("-kernel".into());
    arguments.push(image.into());
    arguments
}

/// Starts QEMU with `image`.
///
/// # Errors
/// [`ChipError::NoProgram`] if QEMU is not installed, [`ChipError::Start`] if
/// it cannot be started.
pub fn start(target: Target, transport: Transport, image: &Path) -> Result<Guarded, ChipError> {
    let program = find(target)?;
    // QEMU runs in a folder of its own.
    let image = std::path::absolute(image).unwrap_or_else(|_| image.to_path_buf());
    Guarded::start("QEMU", &program, arguments(target, transport, &image))
}

/// Keeps this thread, and the processes that it starts, on one processor, until
/// this is dropped in the same thread.
#[derive(Debug)]
pub(super) struct OneCpu {
    /// The processors that the thread had before.
    #[cfg(target_os = "linux")]
    before: Option<rustix::thread::CpuSet>,
}

#[cfg(target_os = "linux")]
impl OneCpu {
    pub(super) fn keep() -> Self {
        use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
        let before = sched_getaffinity(None).ok();
        let mut one = CpuSet::new();
        if let Some(before) = &before {
            let allowed: Vec<usize> = (0..CpuSet::MAX_CPU)
                .filter(|cpu| before.is_set(*cpu))
                .collect();
            // Two runs at once, started one after the other, take two of them.
            let turn = usize::try_from(std::process::id()).unwrap_or(0) % allowed.len().max(1);
            if let Some(cpu) = allowed.get(turn) {
                one.set(*cpu);
            }
        }
        // Where the system does not allow it, only speed is lost.
        let kept = sched_setaffinity(None, &one).is_ok();
        Self {
            before: before.filter(|_| kept),
        }
    }
}

#[cfg(target_os = "linux")]
impl Drop for OneCpu {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            let _ = rustix::thread::sched_setaffinity(None, before);
        }
    }
}

#[cfg(not(target_os = "linux"))]
impl OneCpu {
    pub(super) fn keep() -> Self {
        Self {}
    }
}

/// A line whose two ends share a processor.
#[derive(Debug)]
pub(super) struct OnOneCpu<L> {
    pub(super) line: L,
    /// Dropped last.
    pub(super) _cpu: OneCpu,
}

impl<L: Line> Line for OnOneCpu<L> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), LineError> {
        self.line.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, LineError> {
        self.line.receive(buffer, timeout)
    }

    fn patience(&self) -> Duration {
        self.line.patience()
    }
}
