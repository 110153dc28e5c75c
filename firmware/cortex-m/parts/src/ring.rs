//! Bytes from an interrupt to the main loop.

use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering};

/// Bytes that wait at most: a whole frame, with room for part of a repetition.
const ROOM: usize = 256;

/// One writer, one reader, no lock. A byte that finds no room is lost, as on
/// any line; the frame's CRC tells.
#[derive(Debug)]
pub struct Ring {
    bytes: [AtomicU8; ROOM],
    /// Bytes written so far, modulo 2^32. Only the writer changes it.
    written: AtomicUsize,
    /// Bytes read so far, modulo 2^32. Only the reader changes it.
    read: AtomicUsize,
}

impl Ring {
    /// Without a byte.
    pub const fn new() -> Self {
        Self {
            bytes: [const { AtomicU8::new(0) }; ROOM],
            written: AtomicUsize::new(0),
            read: AtomicUsize::new(0),
        }
    }

    /// Appends a byte; in the interrupt only.
    pub fn push(&self, byte: u8) {
        let written = self.written.load(Ordering::Relaxed);
        let waiting = written.wrapping_sub(self.read.load(Ordering::Acquire));
        if waiting >= ROOM {
            return;
        }
        if let Some(place) = self.bytes.get(written % ROOM) {
            place.store(byte, Ordering::Relaxed);
            self.written
                .store(written.wrapping_add(1), Ordering::Release);
        }
    }

    /// Takes the first byte; in the main loop only.
    pub fn pop(&self) -> Option<u8> {
        let read = self.read.load(Ordering::Relaxed);
        if read == self.written.load(Ordering::Acquire) {
            return None;
        }
        let byte = self.bytes.get(read % ROOM)?.load(Ordering::Relaxed);
        self.read.store(read.wrapping_add(1), Ordering::Release);
        Some(byte)
    }

    /// Tells whether no byte waits.
    pub fn is_empty(&self) -> bool {
        self.read.load(Ordering::Relaxed) == self.written.load(Ordering::Acquire)
    }
}

impl Default for Ring {
    fn default() -> Self {
        Self::new()
    }
}
