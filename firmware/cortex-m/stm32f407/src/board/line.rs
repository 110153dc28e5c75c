//! The line to the host: USART2, 921,600 baud, 8 data bits, no parity.
//!
//! ```text
//!  PA3 ─► interrupt ─► ring ─► next_byte, asleep while there is none
//!  PA2 ◄─────────────────────── send
//! ```

use cortex_m::peripheral::NVIC;
use parts::ring::Ring;
use stm32f4::stm32f407::{Interrupt, USART2, interrupt};

use super::clock::{Clocks, soon};

/// Polls for a byte to leave: above 300 µs at 168 MHz, where it takes 11 µs.
const TRIES: u32 = 10_000;

/// Below the sample's, which stays at 0 as after a reset, the highest: a byte does
/// not delay a sample. The chip has the upper four bits of a priority (RM 12.1.1). A
/// sample that keeps the line waiting for longer than a byte, 11 µs, may cost one,
/// as it did with one priority for both, and the host asks again.
const PRIORITY: u8 = 1 << 4;

/// Bytes that came and were not yet taken.
static RECEIVED: Ring = Ring::new();

/// USART2.
#[derive(Debug)]
pub(super) struct Line(USART2);

impl Line {
    /// Receives from here on.
    pub(super) fn start(usart: USART2, nvic: &mut NVIC, clocks: &Clocks) -> Self {
        // RM 30.6.3.
        let sixteenths = clocks.baud_sixteenths;
        usart.brr().write(|w| {
            w.div_mantissa().set(u16::from(sixteenths >> 4));
            w.div_fraction().set(sixteenths & 0xf)
        });
        // RM 30.6.4.
        usart.cr1().write(|w| {
            w.ue().enabled().te().enabled().re().enabled();
            w.rxneie().enabled()
        });
        // SAFETY: no critical section relies on priorities.
        unsafe { nvic.set_priority(Interrupt::USART2, PRIORITY) };
        // SAFETY: no critical section relies on this interrupt being masked.
        unsafe { NVIC::unmask(Interrupt::USART2) };
        Self(usart)
    }

    /// The next byte; asleep until there is one.
    pub(super) fn next_byte(&mut self) -> u8 {
        loop {
            if let Some(byte) = RECEIVED.pop() {
                return byte;
            }
            // With interrupts held back none can come between looking and
            // sleeping; one that is pending ends the sleep all the same.
            cortex_m::interrupt::free(|_| {
                if RECEIVED.is_empty() {
                    cortex_m::asm::wfi();
                }
            });
        }
    }

    /// Sends bytes; gives up where the line takes none. The host asks again.
    pub(super) fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if !soon(TRIES, || self.0.sr().read().txe().is_tx_empty()) {
                return;
            }
            self.0.dr().write(|w| w.dr().set(u16::from(*byte)));
        }
    }
}

#[interrupt]
fn USART2() {
    // SAFETY: only this handler reads the data register, and the status with
    // it; the line elsewhere only writes the one and looks at the other.
    let usart = unsafe { &*USART2::ptr() };
    // RM 30.6.1: reading the status and then the data takes an overrun away
    // too. A byte that it cost shows in the frame's CRC.
    let status = usart.sr().read();
    let [byte, _] = usart.dr().read().dr().bits().to_le_bytes();
    if status.rxne().is_data_ready() {
        RECEIVED.push(byte);
    }
}
