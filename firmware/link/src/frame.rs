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
pub(crate) struct Frame<B: ?Sized> {
    /// Bytes so far, of those too that have found no place.
    pub(crate) length: usize,
    bytes: B,
}

impl<const N: usize> Frame<[u8; N]> {
    /// Without a byte.
    pub(crate) const EMPTY: Self = Self {
        length: 0,
        bytes: [0; N],
    };
}

impl Frame<[u8]> {
    /// Forgets its bytes; with a place for the first distance, as what is written.
    #[inline(never)]
    pub(crate) fn begin(&mut self, kind: u8, session: u16, number: u32) {
        self.length = 0;
        self.put(0);
        self.put(kind);
        self.bytes(&session.to_le_bytes());
        self.u32(number);
    }

    /// Appends a byte.
    #[inline(never)]
    pub(crate) fn put(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
        }
        self.length = self.length.saturating_add(1);
    }

    /// Appends bytes as they are.
    #[inline(never)]
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.put(*byte));
    }

    #[inline(never)]
    pub(crate) fn u32(&mut self, value: u32) {
        self.bytes(&value.to_le_bytes());
    }

    #[inline(never)]
    pub(crate) fn i64(&mut self, value: i64) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends words, 4 bytes each.
    pub(crate) fn i32s(&mut self, values: &[i32]) {
        values
            .iter()
            .for_each(|value| self.u32(value.cast_unsigned()));
    }

    /// A byte: the place of `value` in the list of all.
    pub(crate) fn choice<T: PartialEq>(&mut self, value: &T, all: &[T]) {
        let mut place = 0_u8;
        for known in all {
            if known == value {
                break;
            }
            place = place.wrapping_add(1);
        }
        self.put(place);
    }

    /// Ends what was written: CRC, COBS, 0.
    #[inline(never)]
    pub(crate) fn end(&mut self) {
        let crc = crc32(self.body().unwrap_or_default());
        self.u32(crc);
        // Every 0 becomes its distance to the next one; the first is none of the
        // body's, the last one ends the frame.
        let mut distance = 0_u8;
        let written = self.bytes.get_mut(..self.length);
        for byte in written.unwrap_or_default().iter_mut().rev() {
            distance = distance.wrapping_add(1);
            if *byte == 0 {
                *byte = core::mem::take(&mut distance);
            }
        }
        self.put(0);
    }

    /// The body that was written so far; `None` if something did not fit.
    pub(crate) fn body(&self) -> Option<&[u8]> {
        self.bytes.get(1..self.length)
    }

    /// What was written and ended, as it goes over the line; `None` if something did
    /// not fit.
    pub(crate) fn line(&self) -> Option<&[u8]> {
        self.bytes.get(..self.length)
    }

    /// The same, and forgets it: the next byte begins another frame.
    pub(crate) fn take_line(&mut self) -> Option<&[u8]> {
        self.bytes.get(..core::mem::take(&mut self.length))
    }

    /// The body of what was read up to its end, decoded where it is; `None` if it is
    /// damaged. The next byte that is read begins another frame.
    #[inline(never)]
    fn read(&mut self) -> Option<&[u8]> {
        let frame = self.bytes.get_mut(..core::mem::take(&mut self.length))?;
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
    let mut frame = Frame::<[u8; N]>::EMPTY;
    let to: &mut Frame<[u8]> = &mut frame;
    to.put(0);
    to.bytes(body);
    to.end();
    Vec::from_slice(to.line()?).ok()
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
    pub(crate) frame: Frame<[u8; LARGEST_FRAME - 1]>,
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
        let frame: &mut Frame<[u8]> = &mut self.frame;
        if byte != 0 {
            frame.put(byte);
            return None;
        }
        if frame.length == 0 {
            return None;
        }
        Some(frame.read().map_or(Received::Damaged, Received::Body))
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}
