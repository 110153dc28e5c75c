//! The proof that nothing panics: an image in which a panic can be reached
//! does not link.
//!
//! The handler calls a function that does not exist. Where the compiler has
//! shown that no panic can be reached, it drops the handler, and with it the
//! only mention of that function; otherwise the linker ends with
//! `undefined symbol: a_panic_can_be_reached`. `images/examples/reachable_panic.rs`
//! is such an image.

use core::panic::PanicInfo;

unsafe extern "C" {
    fn a_panic_can_be_reached() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: an image with this call does not link, so it is never made.
    unsafe { a_panic_can_be_reached() }
}
