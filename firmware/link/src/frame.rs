//! Frames on a line that may damage, lose, double or invent bytes.
//!
//! ```text
//! body ─► body + CRC-32 (lowest byte first) ─► COBS ─► … 0
//! ```
//!
//! Consistent overhead byte stuffing removes every 0 from a frame, so that a 0
//! is always its end: whatever happened before, reading starts afresh behind
//! it. The CRC is that of ISO-HDLC; a damaged frame passes it once in 2^32.

use heapless::Vec;

use crate::body::Header;

/// CRCs of all halves of a byte, of the generator x^32 + x^26 + … + 1 with the highest
/// power in the lowest bit: 64 bytes of flash. A table of all bytes is 1 KiB, and
/// without one a chip spends two thirds of a sample on two frames.
const HALVES: [u32; 16] = [
    0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
    0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c,
];

/// The CRC 4 bits further.
fn half_on(crc: u32) -> u32 {
    let [lowest, ..] = crc.to_le_bytes();
    // There is one for every half.
    let half = HALVES.get(usize::from(lowest & 0xf)).copied();
    crc.wrapping_shr(4) ^ half.unwrap_or(0)
}

/// Bytes of a CRC.
const CRC_BYTES: usize = 4;

/// CRC of any bytes followed by their own.
const CRC_OF_CRC: u32 = 0x2144_df1c;

/// Bytes of the largest body.
pub const LARGEST_BODY: usize = 192;

/// Bytes of the largest frame on the line: body, CRC, one of COBS for fewer
/// than 254 bytes, and the end.
pub const LARGEST_FRAME: usize = LARGEST_BODY + CRC_BYTES + 2;

/// CRC-32 of `bytes`.
pub fn crc32(bytes: &[u8]) -> u32 {
    crc32_on(0, bytes)
}

/// CRC-32 of what `crc` stands for, followed by `bytes`; 0 stands for nothing.
#[inline(never)]
pub fn crc32_on(crc: u32, bytes: &[u8]) -> u32 {
    !bytes
        .iter()
        .fold(!crc, |crc, &byte| half_on(half_on(crc ^ u32::from(byte))))
}

/// A frame, or the front of one, in its memory.
///
/// ```text
/// written   0, body            ─► distance, body with distances, 0
/// read      distance, …        ─► 0, body, CRC
/// ```
#[derive(Debug)]
pub(crate) struct Frame<const N: usize = LARGEST_FRAME> {
    /// Bytes so far: all that there is place for where too many came.
    length: usize,
    bytes: [u8; N],
}

impl<const N: usize> Frame<N> {
    /// Without a byte.
    pub(crate) const EMPTY: Self = Self {
        length: 0,
        bytes: [0; N],
    };

    /// Forgets its bytes and begins a body, behind a place for the first distance.
    #[inline(never)]
    pub(crate) fn begin(&mut self, header: &Header) {
        self.length = 0;
        self.put(0);
        self.put(header.kind);
        self.number(header.session.into(), 2);
        self.number(header.number, 4);
    }

    /// Appends a byte.
    #[inline(never)]
    pub(crate) fn put(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length = self.length.wrapping_add(1);
        }
    }

    /// Appends bytes as they are.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.put(*byte));
    }

    /// Appends so many bytes of a number, the lowest first.
    #[inline(never)]
    pub(crate) fn number(&mut self, mut number: u32, bytes: u8) {
        for _ in 0..bytes {
            let [lowest, ..] = number.to_le_bytes();
            self.put(lowest);
            number = number.wrapping_shr(8);
        }
    }

    /// Appends words, 4 bytes each.
    #[inline(never)]
    pub(crate) fn words(&mut self, words: &[u32]) {
        words.iter().for_each(|word| self.number(*word, 4));
    }

    /// The body that was written so far.
    pub(crate) fn body(&self) -> Option<&[u8]> {
        self.bytes.get(1..self.length)
    }

    /// Ends what was written: CRC, COBS, 0. The frame as it goes over the line, `None` if
    /// something did not fit; the next byte begins another one.
    #[inline(never)]
    pub(crate) fn end(&mut self) -> Option<&[u8]> {
        let crc = crc32(self.body()?);
        self.number(crc, 4);
        // Every 0 becomes its distance to the next one; the first is none of the
        // body's, the last one ends the frame.
        let mut distance = 0_u8;
        for byte in self.bytes.get_mut(..self.length)?.iter_mut().rev() {
            distance = distance.wrapping_add(1);
            if *byte == 0 {
                *byte = core::mem::take(&mut distance);
            }
        }
        let end = self.bytes.get_mut(self.length)?;
        *end = 0;
        self.bytes.get(..=core::mem::take(&mut self.length))
    }
}

impl Frame {
    /// The body of what was read up to its end, decoded where it is; `None` if it is
    /// damaged. The next byte that is read begins another frame.
    #[inline(never)]
    fn read(&mut self) -> Option<&[u8]> {
        // The end has no place in it.
        let [bytes @ .., _] = &mut self.bytes;
        let frame = bytes.get_mut(..core::mem::take(&mut self.length))?;
        // A distance becomes the 0 that it stands for, the last one leads to the end.
        let mut at = 0_usize;
        while at < frame.len() {
            let distance = core::mem::take(frame.get_mut(at)?);
            at = at.saturating_add(distance.into());
        }
        let with_crc = frame.get(1..at)?;
        let (body, _) = with_crc.split_last_chunk::<CRC_BYTES>()?;
        (crc32(with_crc) == CRC_OF_CRC).then_some(body)
    }
}

/// A body as it goes over the line; `None` if it does not fit `N` bytes.
pub fn encode<const N: usize>(body: &[u8]) -> Option<Vec<u8, N>> {
    const { assert!(N <= 255, "a distance of COBS is a byte") };
    let mut frame = Frame::<N>::EMPTY;
    frame.put(0);
    frame.bytes(body);
    Vec::from_slice(frame.end()?).ok()
}

/// Result of a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Received<'a> {
    /// A frame, undamaged: its body.
    Body(&'a [u8]),
    /// A frame that was damaged, or is longer than any.
    Damaged,
}

/// Takes bytes off a line and finds the frames in them.
///
/// ```
/// use firmware_link::frame::{LARGEST_FRAME, Received, Receiver, encode};
///
/// let line = encode::<LARGEST_FRAME>(b"\x01\x00servo").ok_or("too long")?;
/// let mut receiver = Receiver::new();
/// let (last, first) = line.split_last().ok_or("empty")?;
/// assert!(first.iter().all(|byte| receiver.take(*byte).is_none()));
/// assert_eq!(receiver.take(*last), Some(Received::Body(b"\x01\x00servo")));
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug)]
pub struct Receiver {
    /// What has come of a frame; its memory is free from its end to the next byte.
    pub(crate) frame: Frame,
}

impl Receiver {
    /// At the start of a frame.
    pub const fn new() -> Self {
        Self {
            frame: Frame::EMPTY,
        }
    }

    /// Takes a byte; `Some` if it ends a frame.
    pub fn take(&mut self, byte: u8) -> Option<Received<'_>> {
        if byte != 0 {
            self.frame.put(byte);
            return None;
        }
        if self.frame.length == 0 {
            return None;
        }
        Some(self.frame.read().map_or(Received::Damaged, Received::Body))
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}
