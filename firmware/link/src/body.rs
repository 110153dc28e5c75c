//! Bodies: numbers as bytes, the lowest byte first, behind a header.

/// Takes from the front of a body. Where there is too little left, or no such
/// value, it gives another, and tells at its end.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    /// 0 as long as all was there.
    wrong: u8,
}

impl<'a> Reader<'a> {
    /// Reads `bytes` from the front.
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, wrong: 0 }
    }

    pub(crate) const fn array<const N: usize>(&mut self) -> [u8; N] {
        let Some((front, rest)) = self.bytes.split_first_chunk() else {
            self.wrong = 1;
            return [0; N];
        };
        self.bytes = rest;
        *front
    }

    #[inline(never)]
    pub(crate) fn u8(&mut self) -> u8 {
        u8::from_le_bytes(self.array())
    }

    #[inline(never)]
    pub(crate) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    #[inline(never)]
    pub(crate) fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.array())
    }

    pub(crate) fn i32(&mut self) -> i32 {
        self.u32().cast_signed()
    }

    pub(crate) fn i64(&mut self) -> i64 {
        self.u64().cast_signed()
    }

    /// A byte, 0 or 1.
    pub(crate) fn flag(&mut self) -> bool {
        let byte = self.u8();
        self.expect_flag(byte);
        byte & 1 != 0
    }

    /// What was read is 0 or 1; anything else is wrong.
    pub(crate) const fn expect_flag(&mut self, byte: u8) {
        self.wrong |= byte.wrapping_shr(1);
    }

    /// A byte: the place of a value in the list of all.
    pub(crate) fn choice<T: Copy>(&mut self, all: &[T]) -> Option<T> {
        let value = all.get(usize::from(self.u8())).copied();
        self.wrong |= u8::from(value.is_none());
        value
    }

    /// Tells whether all was there so far.
    pub(crate) const fn is_good(&self) -> bool {
        self.wrong == 0
    }

    /// Tells whether all was there and nothing is left.
    pub(crate) const fn has_ended(&self) -> bool {
        self.bytes.is_empty() && self.is_good()
    }
}

/// The two words of a number, the lower one first.
pub(crate) const fn halves(number: i64) -> [u32; 2] {
    let [a, b, c, d, e, f, g, h] = number.to_le_bytes();
    [
        u32::from_le_bytes([a, b, c, d]),
        u32::from_le_bytes([e, f, g, h]),
    ]
}

/// Version of the protocol, told in every HELLO; both sides must have the same.
pub const VERSION: u8 = 3;

/// Head of a body; the same in every version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Header {
    /// Kind of the body.
    pub kind: u8,
    /// Chosen by the host for one run: what is left of another is not of this.
    pub session: u16,
    /// Number of the request; a reply has that of the request it answers.
    pub number: u32,
}

impl Header {
    /// Its bytes at the front of a body.
    pub const BYTES: usize = 7;

    /// All zeros, before the first.
    pub(crate) const ZERO: Self = Self {
        kind: 0,
        session: 0,
        number: 0,
    };

    /// Takes the header of a body; what follows it.
    #[inline(always)]
    pub(crate) const fn fill<'b>(&mut self, body: &'b [u8]) -> Option<&'b [u8]> {
        let [kind, a, b, c, d, e, f, payload @ ..] = body else {
            return None;
        };
        self.kind = *kind;
        self.session = u16::from_le_bytes([*a, *b]);
        self.number = u32::from_le_bytes([*c, *d, *e, *f]);
        Some(payload)
    }

    /// The header of a body, and what follows it.
    pub fn read(body: &[u8]) -> Option<(Self, Reader<'_>)> {
        let mut header = Self::ZERO;
        let payload = header.fill(body)?;
        Some((header, Reader::new(payload)))
    }
}
