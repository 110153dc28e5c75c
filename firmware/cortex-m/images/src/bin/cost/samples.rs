//! The times of samples, on their way to the host.

use firmware_link::frame::{LARGEST_BODY, LARGEST_FRAME, encode};
use firmware_link::{Reply, Status, Target};
use heapless::Vec;
use images::chip::Chip;
use images::host::File;

/// First byte of a frame with a feature's name.
const NAME: u8 = 0x41;

/// First byte of a frame with times.
const TIMES: u8 = 0x42;

/// Measures samples and sends their times.
pub(crate) struct Samples<'c> {
    chip: &'c mut Chip,
    host: &'c File,
    body: Vec<u8, LARGEST_BODY>,
    taken: u32,
}

impl<'c> Samples<'c> {
    /// Says to the host at the end of the line who is there; `None` where nobody
    /// listens.
    pub(crate) fn begin(chip: &'c mut Chip, host: &'c File) -> Option<Self> {
        let hello = Reply::Hello(chip.identity()).body(0, 0)?;
        let samples = Self {
            chip,
            host,
            body: Vec::new(),
            taken: 0,
        };
        samples.send(&hello)?;
        Some(samples)
    }

    /// The samples that follow belong to the feature `name`.
    pub(crate) fn name(&mut self, name: &str) -> Option<()> {
        self.flush()?;
        self.body.push(NAME).ok()?;
        self.body.extend_from_slice(name.as_bytes()).ok()?;
        self.flush()
    }

    /// Takes the time of a sample: from its call, with its arguments, to its
    /// return.
    #[inline(always)]
    pub(crate) fn measure<R>(&mut self, sample: impl FnOnce() -> R) -> Option<R> {
        self.chip.start();
        let result = sample();
        let ticks = self.chip.elapsed();
        self.taken = self.taken.saturating_add(1);
        self.keep(ticks)?;
        Some(result)
    }

    #[inline(never)]
    fn keep(&mut self, ticks: u32) -> Option<()> {
        if self.body.is_empty() {
            self.body.push(TIMES).ok()?;
        }
        self.body.extend_from_slice(&ticks.to_le_bytes()).ok()?;
        // Room for one more.
        if self.body.capacity().saturating_sub(self.body.len()) < size_of::<u32>() {
            self.flush()?;
        }
        Some(())
    }

    /// Sends what is left and the end.
    pub(crate) fn end(mut self) -> Option<()> {
        self.flush()?;
        let status = Status {
            stack_bytes: self.chip.stack_bytes(),
            steps: self.taken,
        };
        self.send(&Reply::Status(status).body(0, 0)?)
    }

    fn flush(&mut self) -> Option<()> {
        if !self.body.is_empty() {
            self.send(&self.body)?;
            self.body.clear();
        }
        Some(())
    }

    fn send(&self, body: &[u8]) -> Option<()> {
        let frame = encode::<LARGEST_FRAME>(body)?;
        self.host.write(&frame)
    }
}
