//! Frames on a line that may damage, lose, double or invent bytes.
//!
//! ```text
//! body ─► body + CRC-32 (lowest byte first) ─► COBS ─► … 0
//! ```
//!
//! Consistent overhead byte stuffing removes every 0 from a frame, so that a 0
//! is always its end: whatever happened before, reading starts afresh behind
//! it. The CRC is that of ISO-HDLC; a damaged frame passes it once in 2^32.

use cobs::{DecodeResult, DecoderState, EncoderState, PushResult};
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::Vec;

/// Without a table: a table is 1 KiB of flash, and a frame has 20 bytes.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Bytes of a CRC.
const CRC_BYTES: usize = 4;

/// Bytes of the largest body.
pub const LARGEST_BODY: usize = 192;

/// Bytes of the largest frame on the line: body, CRC, one of COBS for fewer
/// than 254 bytes, and the end.
pub const LARGEST_FRAME: usize = LARGEST_BODY + CRC_BYTES + 2;

/// CRC-32 of `bytes`.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// CRC-32 of what `crc` stands for, followed by `bytes`; 0 stands for nothing.
pub fn crc32_on(crc: u32, bytes: &[u8]) -> u32 {
    // The algorithm reflects the bits, and inverts at its start and end.
    let mut digest = CRC.digest_with_initial((!crc).reverse_bits());
    digest.update(bytes);
    digest.finalize()
}

/// A body as it goes over the line; `None` if it does not fit `N` bytes.
pub fn encode<const N: usize>(body: &[u8]) -> Option<Vec<u8, N>> {
    let mut line = Vec::new();
    // The place of the first distance.
    line.push(0).ok()?;
    let mut state = EncoderState::default();
    let crc = crc32(body).to_le_bytes();
    for &byte in body.iter().chain(&crc) {
        match state.push(byte) {
            PushResult::AddSingle(byte) => line.push(byte).ok()?,
            PushResult::ModifyFromStartAndSkip((at, distance)) => {
                *line.get_mut(at)? = distance;
                line.push(0).ok()?;
            }
            PushResult::ModifyFromStartAndPushAndSkip((at, distance, byte)) => {
                *line.get_mut(at)? = distance;
                line.push(byte).ok()?;
                line.push(0).ok()?;
            }
        }
    }
    let (at, distance) = state.finalize();
    *line.get_mut(at)? = distance;
    line.push(0).ok()?;
    Some(line)
}

/// What a byte completes.
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
/// use firmware::link::frame::{LARGEST_FRAME, Received, Receiver, encode};
///
/// let line = encode::<LARGEST_FRAME>(b"\x01\x00servo").ok_or("too long")?;
/// let mut receiver = Receiver::new();
/// let (last, first) = line.split_last().ok_or("empty")?;
/// assert!(first.iter().all(|byte| receiver.take(*byte).is_none()));
/// assert_eq!(receiver.take(*last), Some(Received::Body(b"\x01\x00servo")));
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Default)]
pub struct Receiver {
    state: DecoderState,
    /// Body and CRC so far.
    bytes: Vec<u8, { LARGEST_BODY + CRC_BYTES }>,
    /// Whether a byte was left out: the frame is damaged whatever else comes.
    broken: bool,
}

impl Receiver {
    /// At the start of a frame.
    pub const fn new() -> Self {
        Self {
            state: DecoderState::Idle,
            bytes: Vec::new(),
            broken: false,
        }
    }

    /// Takes a byte; `Some` if it ends a frame.
    pub fn take(&mut self, byte: u8) -> Option<Received<'_>> {
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataStart) => {
                self.bytes.clear();
                self.broken = false;
                None
            }
            Ok(DecodeResult::DataContinue(byte)) => {
                self.broken |= self.bytes.push(byte).is_err();
                None
            }
            Ok(DecodeResult::DataComplete) => Some(self.checked()),
            Err(_) => Some(Received::Damaged),
        }
    }

    fn checked(&self) -> Received<'_> {
        let (body, crc) = match self.bytes.split_last_chunk::<CRC_BYTES>() {
            Some((body, crc)) if !self.broken => (body, crc),
            _ => return Received::Damaged,
        };
        if crc32(body) == u32::from_le_bytes(*crc) {
            Received::Body(body)
        } else {
            Received::Damaged
        }
    }
}
