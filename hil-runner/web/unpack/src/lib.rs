//! The image that unpacks another one in a page: LZMA, which is a quarter shorter than what
//! browsers unpack themselves. Its exports are those of `hil-web`: room for a request, here what
//! is packed, [`unpack`], and the place of the answer, which is empty where nothing can be
//! unpacked.

use std::sync::{Mutex, MutexGuard, PoisonError};

use lzma_rust2::{Action, LzmaStream};

static BUFFER: Mutex<Vec<u8>> = Mutex::new(Vec::new());

fn buffer() -> MutexGuard<'static, Vec<u8>> {
    BUFFER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes room for what is packed.
#[unsafe(no_mangle)]
pub extern "C" fn room(bytes: usize) -> *mut u8 {
    let mut buffer = buffer();
    buffer.clear();
    buffer.resize(bytes, 0);
    buffer.as_mut_ptr()
}

/// The place of what is unpacked.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    buffer().as_ptr()
}

/// Unpacks; the length.
#[unsafe(no_mangle)]
pub extern "C" fn unpack() -> usize {
    let mut buffer = buffer();
    let unpacked = unpacked(&buffer).unwrap_or_default();
    *buffer = unpacked;
    buffer.len()
}

/// The bytes of a file of LZMA that tells their number.
fn unpacked(packed: &[u8]) -> Option<Vec<u8>> {
    let length = u64::from_le_bytes(packed.get(5..13)?.try_into().ok()?);
    let mut bytes = vec![0; usize::try_from(length).ok()?];
    let mut stream = LzmaStream::new_mem_limit(u32::MAX, None);
    let told = stream.process(packed, &mut bytes, Action::Finish).ok()?;
    (told.bytes_produced == bytes.len()).then_some(bytes)
}
