//! Bodies: numbers as bytes, the lowest byte first, behind a header.

/// Takes from the front of a body. Behind its end, and where there is no such
/// value, it gives another, and tells at its end.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    failed: bool,
}

impl<'a> Reader<'a> {
    /// Reads `bytes` from the front.
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        let failed = false;
        Self { bytes, failed }
    }

    pub(crate) fn array<const N: usize>(&mut self) -> [u8; N] {
        let (front, rest) = self.bytes.split_first_chunk().unwrap_or_else(|| {
            self.failed = true;
            (&[0; N], &[])
        });
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
        self.failed |= byte > 1;
        byte == 1
    }

    /// A byte: the place of a value in the list of all.
    pub(crate) fn choice<T: Copy>(&mut self, all: &[T]) -> Option<T> {
        let value = all.get(usize::from(self.u8())).copied();
        self.failed |= value.is_none();
        value
    }

    /// What was read is no value.
    pub(crate) const fn fail(&mut self) {
        self.failed = true;
    }

    /// All that is left.
    pub(crate) const fn rest(self) -> &'a [u8] {
        self.bytes
    }

    /// Tells whether all was there and nothing is left.
    pub(crate) const fn has_ended(&self) -> bool {
        self.bytes.is_empty() && !self.failed
    }

    /// `value`, if all was there.
    pub(crate) fn whole<T>(&self, value: T) -> Option<T> {
        (!self.failed).then_some(value)
    }
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
    /// Reads it from the front of a body; tells whether it is there.
    #[inline(never)]
    pub(crate) fn fill(&mut self, from: &mut Reader<'_>) -> bool {
        self.kind = from.u8();
        self.session = u16::from_le_bytes([from.u8(), from.u8()]);
        self.number = from.u32();
        !from.failed
    }

    /// The header of a body, and what follows it.
    pub fn read(body: &[u8]) -> Option<(Self, Reader<'_>)> {
        let (mut header, mut from) = (Self::default(), Reader::new(body));
        header.fill(&mut from).then_some((header, from))
    }
}
