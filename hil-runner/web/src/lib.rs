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

pub mod buffer;
pub mod served;

use buffer::replaced;
use hil_core::requests::{self, Answer};

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
