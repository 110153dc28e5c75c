//! The contrast to the proof in `parts/src/lib.rs`: an image with a panic that can
//! be reached, by a byte that no compiler knows beforehand. It must not link.

#![no_std]
#![no_main]

use images::board::uart;

#[images::entry]
fn main() -> ! {
    let received = uart::received();
    assert!(received.is_none(), "nothing was asked");
    loop {
        images::sleep_unless(|| false);
    }
}
