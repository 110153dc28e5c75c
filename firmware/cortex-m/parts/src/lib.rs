//! Parts of every image, whatever its chip: the proof that nothing panics, its
//! bytes in flash and RAM, the depth of its stack, and a ring that carries
//! bytes out of an interrupt.
//!
//! # The proof that nothing panics
//!
//! An image in which a panic can be reached does not link. The handler calls a
//! function that does not exist. Where the compiler has
//! shown that no panic can be reached, it drops the handler, and with it the
//! only mention of that function; otherwise the linker ends with
//! `undefined symbol: a_panic_can_be_reached`. `images/examples/reachable_panic.rs`
//! is such an image.

#![no_std]

pub mod image;
pub mod ring;

use core::panic::PanicInfo;

unsafe extern "C" {
    fn a_panic_can_be_reached() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: an image with this call does not link, so it is never made.
    unsafe { a_panic_can_be_reached() }
}
