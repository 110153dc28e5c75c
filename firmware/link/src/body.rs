//! Bodies: numbers as bytes, the lowest byte first, behind a header.

use heapless::Vec;

/// Appends numbers to a body of at most `N` bytes.
#[derive(Debug, Default)]
pub struct Writer<const N: usize> {
    bytes: Vec<u8, N>,
    /// True if something did not fit.
    overflowed: bool,
}

impl<const N: usize> Writer<N> {
    /// An empty body.
    pub const fn new() -> Self {
        Self {
            bytes: Vec::new(),
            overflowed: false,
        }
    }

    /// Appends bytes as they are.
    #[inline(never)]
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.overflowed |= self.bytes.extend_from_slice(bytes).is_err();
    }

    /// Appends a byte.
    pub fn u8(&mut self, value: u8) {
        self.bytes(&[value]);
    }

    /// Appends 2 bytes.
    pub fn u16(&mut self, value: u16) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends 4 bytes.
    pub fn u32(&mut self, value: u32) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends 4 bytes.
    pub fn i32(&mut self, value: i32) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends 8 bytes.
    pub fn u64(&mut self, value: u64) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends 8 bytes.
    pub fn i64(&mut self, value: i64) {
        self.bytes(&value.to_le_bytes());
    }

    /// The body; `None` if something did not fit.
    pub fn finish(self) -> Option<Vec<u8, N>> {
        (!self.overflowed).then_some(self.bytes)
    }
}

/// Takes numbers from the front of a body; `None` where it ends too early.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    /// Reads `bytes` from the front.
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (front, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*front)
    }

    /// A byte.
    #[inline(never)]
    pub fn u8(&mut self) -> Option<u8> {
        self.array().map(u8::from_le_bytes)
    }

    /// 2 bytes.
    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    /// 4 bytes.
    #[inline(never)]
    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    /// 4 bytes.
    pub fn i32(&mut self) -> Option<i32> {
        self.u32().map(u32::cast_signed)
    }

    /// 8 bytes.
    #[inline(never)]
    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// 8 bytes.
    pub fn i64(&mut self) -> Option<i64> {
        self.u64().map(u64::cast_signed)
    }

    /// All that is left.
    pub const fn rest(self) -> &'a [u8] {
        self.0
    }

    /// `Some` if nothing is left.
    pub const fn end(self) -> Option<()> {
        if self.0.is_empty() { Some(()) } else { None }
    }
}

/// Version of the protocol, told in every HELLO; both sides must have the same.
pub const VERSION: u8 = 1;

/// Head of a body; the same in every version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Kind of the body.
    pub kind: u8,
    /// Chosen by the host for one run: what is left of another is not of this.
    pub session: u16,
    /// Number of the request; a reply has that of the request it answers.
    pub number: u32,
}

impl Header {
    pub(crate) fn write<const N: usize>(self, to: &mut Writer<N>) {
        to.u8(self.kind);
        to.u16(self.session);
        to.u32(self.number);
    }

    /// The header of a body, and what follows it.
    pub fn read(body: &[u8]) -> Option<(Self, Reader<'_>)> {
        let mut from = Reader::new(body);
        let header = Self {
            kind: from.u8()?,
            session: from.u16()?,
            number: from.u32()?,
        };
        Some((header, from))
    }
}
