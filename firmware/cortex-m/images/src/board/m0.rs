//! QEMU's microbit: Cortex-M0 of an nRF51822, 16 KiB of RAM.

/// Name of the board.
pub const NAME: [u8; 8] = *b"m0\0\0\0\0\0\0";

/// Setpoints that its table holds.
pub const TABLE_CAPACITY: usize = firmware::CAPACITY_SMALLEST;

/// Frequency of the processor's clock \[Hz\].
pub const TIMER_HZ: u32 = 16_000_000;

/// Parts of a tick that are told apart ([`crate::chip`]).
pub const TICK_PARTS: u32 = 125;

/// The UART, at any rate: QEMU has no wires.
pub mod uart {
    use crate::register::Register;

    /// Its number among the interrupts.
    pub const RECEIVED: u16 = 2;

    // SAFETY: the UART of the nRF51, nRF51 Series Reference Manual 3.0, 29.10.
    const START_RECEIVER: Register<u32> = unsafe { Register::at(0x4000_2000) };
    // SAFETY: likewise.
    const START_TRANSMITTER: Register<u32> = unsafe { Register::at(0x4000_2008) };
    // SAFETY: likewise.
    const RECEIVED_EVENT: Register<u32> = unsafe { Register::at(0x4000_2108) };
    // SAFETY: likewise.
    const SENT_EVENT: Register<u32> = unsafe { Register::at(0x4000_211c) };
    // SAFETY: likewise.
    const INTERRUPTS: Register<u32> = unsafe { Register::at(0x4000_2304) };
    // SAFETY: likewise.
    const ENABLE: Register<u32> = unsafe { Register::at(0x4000_2500) };
    // SAFETY: likewise.
    const TRANSMIT_PIN: Register<u32> = unsafe { Register::at(0x4000_250c) };
    // SAFETY: likewise.
    const RECEIVE_PIN: Register<u32> = unsafe { Register::at(0x4000_2514) };
    // SAFETY: likewise.
    const RECEIVED_BYTE: Register<u32> = unsafe { Register::at(0x4000_2518) };
    // SAFETY: likewise.
    const BYTE_TO_SEND: Register<u32> = unsafe { Register::at(0x4000_251c) };
    // SAFETY: likewise.
    const BAUD_RATE: Register<u32> = unsafe { Register::at(0x4000_2524) };

    /// The micro:bit's pins to its USB interface.
    const TRANSMIT: u32 = 24;
    const RECEIVE: u32 = 25;
    const ENABLED: u32 = 4;
    const BAUD_115200: u32 = 0x01d7_e000;
    const RECEIVED_INTERRUPT: u32 = 1 << 2;

    /// Both directions, and an interrupt for every byte received.
    pub fn start() {
        TRANSMIT_PIN.write(TRANSMIT);
        RECEIVE_PIN.write(RECEIVE);
        BAUD_RATE.write(BAUD_115200);
        ENABLE.write(ENABLED);
        INTERRUPTS.write(RECEIVED_INTERRUPT);
        START_RECEIVER.write(1);
        START_TRANSMITTER.write(1);
    }

    /// The byte received, in its interrupt.
    pub fn received() -> Option<u8> {
        if RECEIVED_EVENT.read() == 0 {
            return None;
        }
        // First, so that the next byte, which may come as soon as this one is
        // read, interrupts again.
        RECEIVED_EVENT.write(0);
        let [byte, ..] = RECEIVED_BYTE.read().to_le_bytes();
        Some(byte)
    }

    /// Sends a byte and waits until it is on its way.
    pub fn send(byte: u8) {
        SENT_EVENT.write(0);
        BYTE_TO_SEND.write(u32::from(byte));
        while SENT_EVENT.read() == 0 {}
    }
}
