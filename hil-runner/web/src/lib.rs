//! The bench in a page: what the image of WebAssembly exports.
//!
//! ```text
//! room(n) ─► a place for n bytes of request ─► describe | simulate | save | serve ─► length of the answer
//! answer() ─► where it lies, until the next room
//! ```
//!
//! A request of the first three is JSON in UTF-8 ([`hil_core::requests`]). Their answer is the length of a
//! JSON and the number of columns' values, each as a `u32`, then the JSON, spaces up to a multiple
//! of 8 bytes, and the values as `f64`, all lowest byte first. To [`serve`] bytes of the line go in
//! and bytes of the line come out, as at the end of a chip's ([`served`]).

pub mod served;

use std::sync::{Mutex, MutexGuard, PoisonError};

use hil_core::requests::{self, Answer};

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

/// Answers with the form of a run file.
#[unsafe(no_mangle)]
pub extern "C" fn describe() -> usize {
    answered(requests::describe)
}

/// Answers with a run: its figures and, if asked for, its curves.
#[unsafe(no_mangle)]
pub extern "C" fn simulate() -> usize {
    answered(requests::simulate)
}

/// Answers with the text of a run file in which keys are set.
#[unsafe(no_mangle)]
pub extern "C" fn save() -> usize {
    answered(requests::save)
}

/// Answers bytes of the line as a chip does.
#[unsafe(no_mangle)]
pub extern "C" fn serve() -> usize {
    replaced(served::serve)
}

fn answered(request: fn(&[u8]) -> Answer) -> usize {
    replaced(|bytes| request(bytes).to_bytes())
}

/// Puts an answer in the place of the request; its length.
fn replaced(answer: impl FnOnce(&[u8]) -> Vec<u8>) -> usize {
    let mut buffer = buffer();
    let answer = answer(&buffer);
    *buffer = answer;
    buffer.len()
}
