//! QEMU's virt: one RV32IMAC core.

/// Name of the board.
pub const NAME: [u8; 8] = *b"rv32\0\0\0\0";

/// Setpoints that its table holds.
pub const TABLE_CAPACITY: usize = firmware::CAPACITY;

/// QEMU's instruction counter counts the time that it gives an instruction, in
/// nanoseconds \[Hz\].
pub const TIMER_HZ: u32 = 1_000_000_000;

/// Parts of a tick that are told apart ([`crate::chip`]): an instruction takes a
/// whole number of nanoseconds.
pub const TICK_PARTS: u32 = 1;

/// The UART, a 16550, at any rate: QEMU has no wires.
pub mod uart {
    use crate::register::Register;

    /// Its number among the external interrupts.
    pub const RECEIVED: u16 = 10;

    // SAFETY: UART 0 of virt, byte by byte; NS16550 data sheet, 8.0.
    const DATA: Register<u8> = unsafe { Register::at(0x1000_0000) };
    // SAFETY: likewise.
    const INTERRUPTS: Register<u8> = unsafe { Register::at(0x1000_0001) };
    // SAFETY: likewise.
    const STATE: Register<u8> = unsafe { Register::at(0x1000_0005) };

    const RECEIVED_INTERRUPT: u8 = 1 << 0;
    const RECEIVED_STATE: u8 = 1 << 0;
    const TRANSMITTER_EMPTY: u8 = 1 << 5;

    /// An interrupt for every byte received.
    pub fn start() {
        INTERRUPTS.write(RECEIVED_INTERRUPT);
    }

    /// The byte received, in its interrupt.
    pub fn received() -> Option<u8> {
        (STATE.read() & RECEIVED_STATE != 0).then(|| DATA.read())
    }

    /// Sends a byte once there is room for it.
    pub fn send(byte: u8) {
        while STATE.read() & TRANSMITTER_EMPTY == 0 {}
        DATA.write(byte);
    }
}
