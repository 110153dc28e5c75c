//! Bodies: numbers as bytes, the lowest byte first, behind a header.
//!
//! What a body holds is said once, by a function that hands its fields to a
//! `Wire` in their order: a `Writer` takes their values, a [`Reader`] gives
//! them those that came.

use core::mem::discriminant;

use heapless::Vec;

/// One direction of a line. `None` where a body ends too early, or has a value
/// that there is not.
pub(crate) trait Wire {
    /// A byte.
    fn u8(&mut self, value: &mut u8) -> Option<()>;

    /// 4 bytes.
    fn u32(&mut self, value: &mut u32) -> Option<()>;

    /// 8 bytes.
    fn u64(&mut self, value: &mut u64) -> Option<()>;

    /// A byte: the place of a value in the list of all. What one holds besides
    /// comes behind it, is a placeholder in the list, and does not tell values apart.
    fn choice<T: Copy>(&mut self, value: &mut T, all: &[T]) -> Option<()>;

    /// 4 bytes.
    fn i32(&mut self, value: &mut i32) -> Option<()> {
        let mut word = value.cast_unsigned();
        self.u32(&mut word)?;
        *value = word.cast_signed();
        Some(())
    }

    /// 8 bytes.
    fn i64(&mut self, value: &mut i64) -> Option<()> {
        let mut word = value.cast_unsigned();
        self.u64(&mut word)?;
        *value = word.cast_signed();
        Some(())
    }

    /// A byte, 0 or 1.
    fn flag(&mut self, value: &mut bool) -> Option<()> {
        let mut byte = u8::from(*value);
        self.u8(&mut byte)?;
        *value = byte == 1;
        (byte <= 1).then_some(())
    }
}

/// Appends to a body of at most `N` bytes.
#[derive(Debug, Default)]
pub(crate) struct Writer<const N: usize> {
    bytes: Vec<u8, N>,
    /// True if something did not fit.
    overflowed: bool,
}

impl<const N: usize> Writer<N> {
    /// Appends bytes as they are.
    #[inline(never)]
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.overflowed |= self.bytes.extend_from_slice(bytes).is_err();
    }

    /// The body of these fields; `None` if something did not fit.
    pub(crate) fn body(fields: impl FnOnce(&mut Self) -> Option<()>) -> Option<Vec<u8, N>> {
        let mut to = Self::default();
        fields(&mut to)?;
        (!to.overflowed).then_some(to.bytes)
    }
}

impl<const N: usize> Wire for Writer<N> {
    fn u8(&mut self, value: &mut u8) -> Option<()> {
        self.bytes(&[*value]);
        Some(())
    }

    fn u32(&mut self, value: &mut u32) -> Option<()> {
        self.bytes(&value.to_le_bytes());
        Some(())
    }

    fn u64(&mut self, value: &mut u64) -> Option<()> {
        self.bytes(&value.to_le_bytes());
        Some(())
    }

    fn choice<T: Copy>(&mut self, value: &mut T, all: &[T]) -> Option<()> {
        let kind = discriminant(value);
        let place = all.iter().position(|known| discriminant(known) == kind)?;
        self.u8(&mut u8::try_from(place).ok()?)
    }
}

/// Takes from the front of a body.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    /// Reads `bytes` from the front.
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (front, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*front)
    }

    /// All that is left.
    pub(crate) const fn rest(self) -> &'a [u8] {
        self.0
    }

    /// `Some` if nothing is left.
    pub(crate) fn end(self) -> Option<()> {
        self.0.is_empty().then_some(())
    }
}

impl Wire for Reader<'_> {
    #[inline(never)]
    fn u8(&mut self, value: &mut u8) -> Option<()> {
        *value = self.array().map(u8::from_le_bytes)?;
        Some(())
    }

    #[inline(never)]
    fn u32(&mut self, value: &mut u32) -> Option<()> {
        *value = self.array().map(u32::from_le_bytes)?;
        Some(())
    }

    #[inline(never)]
    fn u64(&mut self, value: &mut u64) -> Option<()> {
        *value = self.array().map(u64::from_le_bytes)?;
        Some(())
    }

    fn choice<T: Copy>(&mut self, value: &mut T, all: &[T]) -> Option<()> {
        let mut place = 0;
        self.u8(&mut place)?;
        *value = *all.get(usize::from(place))?;
        Some(())
    }
}

/// Version of the protocol, told in every HELLO; both sides must have the same.
pub const VERSION: u8 = 2;

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
    pub(crate) fn fields(&mut self, wire: &mut impl Wire) -> Option<()> {
        let mut session = self.session.to_le_bytes();
        wire.u8(&mut self.kind)?;
        session.iter_mut().try_for_each(|byte| wire.u8(byte))?;
        self.session = u16::from_le_bytes(session);
        wire.u32(&mut self.number)
    }

    /// The header of a body, and what follows it.
    pub fn read(body: &[u8]) -> Option<(Self, Reader<'_>)> {
        let (mut header, mut from) = (Self::default(), Reader::new(body));
        header.fields(&mut from)?;
        Some((header, from))
    }
}
