//! What every body begins with.

use crate::bytes::{Reader, Writer};

/// Version of the protocol, told in every HELLO; both sides must have the same.
pub const VERSION: u8 = 1;

/// What a body begins with; the same in every version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// What the body is.
    pub kind: u8,
    /// Chosen by the host for one run: what is left of another is not of this.
    pub session: u16,
    /// Number of the request; a reply has that of the request it answers.
    pub number: u32,
}

impl Header {
    pub(super) fn write<const N: usize>(self, to: &mut Writer<N>) {
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
