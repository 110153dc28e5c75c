//! A child process that leaves nothing behind, however its parent ends.
//!
//! ```text
//!  runner ──pipe──► sh (guard.sh) ──► QEMU, in a private folder with two FIFOs
//! ```
//!
//! No code of this process runs when it is killed, so a second process watches
//! over the child: a shell that waits for the pipe to close. Nothing is ever
//! written to the pipe; the system closes it when the last holder is gone. The
//! guard makes the folder too, so that there is no moment at which the folder
//! exists and its guard does not.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdin, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::fs::OFlags;

use super::line::ChipError;

/// The work of the guard.
const SCRIPT: &str = include_str!("guard.sh");

/// Time that the guard may take to clean up; it took 5 ms to 28 ms with four
/// busy processes a core, 2026-11.
const CLEANED_UP: Duration = Duration::from_secs(2);

/// Between two looks at a process that is about to end.
const LOOK: Duration = Duration::from_micros(500);

/// A child process in a private folder with two FIFOs, `to-chip` and
/// `from-chip`. Dropping it kills the child and removes the folder.
#[derive(Debug)]
pub struct Guarded {
    name: String,
    folder: PathBuf,
    guard: Child,
    /// Closes when this value or this process is gone.
    hold: Option<ChildStdin>,
    /// The words of the child on standard output and standard error.
    output: ChildStderr,
    said: String,
    /// The processor that the child and the thread that started it share, until
    /// the child is gone.
    pub(super) one_cpu: Option<OneCpu>,
}

impl Guarded {
    /// Starts `program`, which messages call `name`.
    ///
    /// # Errors
    /// [`ChipError`] if there is no shell or no room for the folder. That
    /// `program` cannot be started shows in [`Guarded::ended`].
    pub fn start(
        name: &str,
        program: &Path,
        arguments: impl IntoIterator<Item = OsString>,
    ) -> Result<Self, ChipError> {
        let failed = |because: String| not_started(name, &because);
        let mut guard = Command::new("sh")
            .args(["-c", SCRIPT, "sh"])
            .arg(std::env::temp_dir())
            .arg(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // Ctrl-C at the terminal is for the runner, which then lets go.
            .process_group(0)
            .spawn()
            .map_err(|error| failed(format!("sh: {error}")))?;
        let (Some(hold), Some(stdout), Some(mut output)) =
            (guard.stdin.take(), guard.stdout.take(), guard.stderr.take())
        else {
            return Err(failed("its pipes are missing".to_owned()));
        };
        let mut folder = String::new();
        // Ends at the latest when the guard does.
        let read = BufReader::new(stdout).read_line(&mut folder);
        if read.is_err() || !folder.ends_with('\n') {
            let mut said = String::new();
            // What cannot be read cannot be told either.
            let _ = output.read_to_string(&mut said);
            let _ = guard.wait();
            return Err(failed(said.trim().to_owned()));
        }
        let unblocked = rustix::fs::fcntl_setfl(&output, OFlags::NONBLOCK);
        let started = Self {
            name: name.to_owned(),
            folder: PathBuf::from(folder.trim_end_matches('\n')),
            guard,
            hold: Some(hold),
            output,
            said: String::new(),
            one_cpu: None,
        };
        unblocked.map_err(|error| failed(error.to_string()))?;
        Ok(started)
    }

    /// The private folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The name of the child in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The words of the child so far, on standard output and standard error.
    pub fn said(&mut self) -> &str {
        let mut bytes = [0; 512];
        // Ends where nothing more is there yet.
        while let Ok(count @ 1..) = self.output.read(&mut bytes) {
            let text = bytes.get(..count).unwrap_or_default();
            self.said.push_str(&String::from_utf8_lossy(text));
        }
        &self.said
    }

    /// The end of the child, if it has: "QEMU has ended with signal 9".
    pub fn ended(&mut self) -> Option<String> {
        let status = match self.guard.try_wait() {
            Ok(None) => return None,
            Ok(Some(status)) => status,
            Err(error) => return Some(format!("{} cannot be asked: {error}", self.name)),
        };
        let name = &self.name;
        let ended = match (status.code(), status.signal()) {
            (Some(0), _) => format!("{name} has ended"),
            // As shells tell of a child that was ended by a signal.
            (Some(code @ 129..), _) => format!("{name} has ended with signal {}", code - 128),
            (Some(code), _) => format!("{name} has ended with status {code}"),
            (None, signal) => {
                let signal = signal.unwrap_or_default();
                format!("the guard of {name} has ended with signal {signal}")
            }
        };
        // QEMU warns of network cards that nobody has asked for.
        // The name of a pseudo-terminal is no reason either.
        let said = |line: &&str| !line.contains("warning: ") && !line.contains(" redirected to ");
        Some(match self.said().lines().rfind(said) {
            Some(said) => format!("{ended}; it said: {said}"),
            None => ended,
        })
    }

    /// [`Guarded::ended`], for a child that is about to end: waits for it.
    pub fn ended_within(&mut self, limit: Duration) -> Option<String> {
        let start = Instant::now();
        loop {
            let ended = self.ended();
            if ended.is_some() || start.elapsed() >= limit {
                return ended;
            }
            sleep(LOOK);
        }
    }

    /// The end of the child, where its end of the line is known to be closed.
    pub(super) fn hung_up(&mut self) -> ChipError {
        let ended = self.ended_within(CLEANED_UP);
        ChipError(ended.unwrap_or_else(|| format!("{} has closed its end of the line", self.name)))
    }

    /// Looks after the child where nothing has come from it.
    ///
    /// # Errors
    /// Its end, if it has ended.
    pub(super) fn check(&mut self) -> Result<(), ChipError> {
        self.ended().map_or(Ok(()), |ended| Err(ChipError(ended)))
    }
}

/// The error of a program that could not be started, or ended before its line
/// was open.
pub(super) fn not_started(program: &str, because: &str) -> ChipError {
    ChipError(format!("{program} could not be started: {because}"))
}

impl Drop for Guarded {
    fn drop(&mut self) {
        drop(self.hold.take());
        if self.ended_within(CLEANED_UP).is_none() {
            // A guard that was stopped, say. Its helper does the rest.
            let _ = self.guard.kill();
            let _ = self.guard.wait();
        }
        // Where the guard itself was killed its helper may not be done yet.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
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
            // Two runs at once, in processes or threads that were started one after
            // the other, take two of them.
            let thread = rustix::thread::gettid().as_raw_nonzero().get();
            let turn = usize::try_from(thread).unwrap_or(0) % allowed.len().max(1);
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
