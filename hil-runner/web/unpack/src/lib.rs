//! The image that unpacks another one in a page: LZMA, which is a quarter shorter than what
//! browsers unpack themselves. Its exports are those of `hil-web`: room for a request, here what
//! is packed, [`unpack`], and the place of the answer, which is empty where nothing can be
//! unpacked.

#[path = "../../src/buffer.rs"]
pub mod buffer;

use lzma_rust2::{Action, LzmaStream};

/// Unpacks; the length.
#[unsafe(no_mangle)]
pub extern "C" fn unpack() -> usize {
    buffer::replaced(|packed| unpacked(packed).unwrap_or_default())
}

/// The bytes of a file of LZMA that tells their number.
fn unpacked(packed: &[u8]) -> Option<Vec<u8>> {
    let length = u64::from_le_bytes(packed.get(5..13)?.try_into().ok()?);
    let mut bytes = vec![0; usize::try_from(length).ok()?];
    let mut stream = LzmaStream::new_mem_limit(u32::MAX, None);
    let told = stream.process(packed, &mut bytes, Action::Finish).ok()?;
    (told.bytes_produced == bytes.len()).then_some(bytes)
}
