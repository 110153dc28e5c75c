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
use heapless::Vec;

/// The generator x^32 + x^26 + … + 1, the highest power in the lowest bit.
const GENERATOR: u32 = 0xedb8_8320;

/// CRCs of all halves of a byte: 64 bytes of flash. A table of all bytes is
/// 1 KiB, and without one a chip spends two thirds of a sample on two frames.
const HALVES: [u32; 16] = halves();

const fn halves() -> [u32; 16] {
    let mut table = [0; 16];
    let mut rest: &mut [u32] = &mut table;
    let mut half = 0_u32;
    while let Some((first, others)) = rest.split_first_mut() {
        let mut crc = half;
        let mut bit = 0;
        while bit < 4_u32 {
            let generator = if crc & 1 == 0 { 0 } else { GENERATOR };
            crc = crc.wrapping_shr(1) ^ generator;
            bit = bit.saturating_add(1);
        }
        *first = crc;
        rest = others;
        half = half.saturating_add(1);
    }
    table
}

/// The CRC 4 bits further.
fn half_on(crc: u32) -> u32 {
    let [lowest, ..] = crc.to_le_bytes();
    // There is one for every half.
    let half = HALVES.get(usize::from(lowest & 0xf)).copied();
    crc.wrapping_shr(4) ^ half.unwrap_or(0)
}

/// Bytes of a CRC.
const CRC_BYTES: usize = 4;

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
#[derive(Debug, Default)]
pub struct Receiver {
    state: DecoderState,
    /// Body and CRC so far.
    bytes: Vec<u8, { LARGEST_BODY + CRC_BYTES }>,
    /// True if a byte was left out: the frame is damaged whatever else comes.
    broken: bool,
}

impl Receiver {
    /// At the start of a frame.
    pub fn new() -> Self {
        Self::default()
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
