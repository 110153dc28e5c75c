//! The one buffer of an image: what a page asks lies in it, and then what it is answered.

use std::sync::{Mutex, MutexGuard, PoisonError};

static BUFFER: Mutex<Vec<u8>> = Mutex::new(Vec::new());

fn buffer() -> MutexGuard<'static, Vec<u8>> {
    BUFFER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes room for a request.
#[unsafe(no_mangle)]
pub extern "C" fn room(bytes: usize) -> *mut u8 {
    let mut buffer = buffer();
    buffer.clear();
    buffer.resize(bytes, 0);
    buffer.as_mut_ptr()
}

/// The place of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    buffer().as_ptr()
}

/// Puts an answer in the place of the request; its length.
pub fn replaced(answer: impl FnOnce(&[u8]) -> Vec<u8>) -> usize {
    let mut buffer = buffer();
    let answer = answer(&buffer);
    *buffer = answer;
    buffer.len()
}
