//! Runner and QEMU on one processor.
//!
//! In lockstep one of the two always waits for the other. On two processors
//! each answer has to wake a processor that sleeps; on one, the scheduler
//! hands over at once. Only Linux is asked for it.

use std::time::Duration;

use super::line::{Line, LineError};

/// Keeps this thread, and the processes that it starts, on one processor, until
/// this is dropped in the same thread.
#[derive(Debug)]
pub(super) struct OneCpu {
    /// Where the thread might run before.
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
