//! The controller behind a UART: every byte interrupts, and the processor
//! sleeps while there is none.

#![no_std]
#![no_main]

use images::board::uart;
use images::line::Line;
use parts::ring::Ring;

static RECEIVED: Ring = Ring::new();

#[images::entry]
fn main() -> ! {
    // SAFETY: the image begins here, once.
    let mut line = unsafe { Line::take_memory() };
    uart::start();
    images::unmask_uart();
    loop {
        while let Some(byte) = RECEIVED.pop() {
            line.take(byte).iter().copied().for_each(uart::send);
        }
        images::sleep_unless(|| !RECEIVED.is_empty());
    }
}

#[unsafe(no_mangle)]
extern "C" fn uart_received() {
    while let Some(byte) = uart::received() {
        RECEIVED.push(byte);
    }
}
