//! A chip in memory: the server that every image runs, at the end of a line
//! that is a queue.

use std::collections::VecDeque;
use std::io::Read;
use std::time::Duration;

use firmware::{CAPACITY, SetpointTable};
use firmware_link::frame::crc32;
use firmware_link::{Identity, Server, Target};
use hil_runner::chip::ChipError;
use hil_runner::chip::line::Line;

/// Its timer ticks every 40 ns, as in QEMU: 3.2 ticks an instruction.
#[derive(Debug)]
pub(crate) struct Memory {
    /// Times of the steps, over and over \[ticks\].
    ticks: &'static [u32],
    /// Steps that were timed.
    steps: usize,
}

impl Target for Memory {
    fn identity(&self) -> Identity {
        Identity {
            version: firmware_link::body::VERSION,
            target: *b"m4\0\0\0\0\0\0",
            image_crc: crc32(b"memory"),
            flash_bytes: 8_000,
            ram_bytes: 1_000,
            table_capacity: u32::try_from(CAPACITY).unwrap(),
            timer_hz: 25_000_000,
        }
    }
    fn start(&mut self) {}
    fn elapsed(&mut self) -> u32 {
        let ticks = self.ticks[self.steps % self.ticks.len()];
        self.steps += 1;
        ticks
    }
    fn stack_bytes(&self) -> u32 {
        500
    }
}

/// The chip with its line.
#[derive(Debug)]
pub(crate) struct Loopback {
    server: Server,
    table: Box<SetpointTable<CAPACITY>>,
    memory: Memory,
    replies: VecDeque<u8>,
}

impl Loopback {
    /// Every step takes 320 ticks: 100 instructions.
    pub(crate) fn new() -> Self {
        Self::with_ticks(&[320])
    }

    /// The steps take `ticks`, over and over.
    pub(crate) fn with_ticks(ticks: &'static [u32]) -> Self {
        Self {
            server: Server::START,
            table: Box::new(SetpointTable::resting_at(0)),
            memory: Memory { ticks, steps: 0 },
            replies: VecDeque::new(),
        }
    }

    /// Loses all memory, as a chip that is reset.
    pub(crate) fn restart(&mut self) {
        *self = Self::with_ticks(self.memory.ticks);
    }
}

impl Line for Loopback {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
        for byte in bytes {
            let frame = self.server.take(*byte, &mut self.table, &mut self.memory);
            self.replies.extend(frame);
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> Result<usize, ChipError> {
        self.replies
            .read(buffer)
            .map_err(|error| ChipError(error.to_string()))
    }

    fn patience(&self) -> Duration {
        Duration::ZERO
    }
}
