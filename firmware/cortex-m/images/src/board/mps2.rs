//! Arm's MPS2 in QEMU: mps2-an385 with a Cortex-M3, mps2-an386 with a Cortex-M4
//! whose FPU is not used.

/// Name of the board.
pub const NAME: [u8; 8] = if cfg!(board = "m3") {
    *b"m3\0\0\0\0\0\0"
} else {
    *b"m4\0\0\0\0\0\0"
};

/// Setpoints that its table holds.
pub const TABLE_CAPACITY: usize = firmware::CAPACITY;

/// Frequency of the processor's clock \[Hz\].
pub const TIMER_HZ: u32 = 25_000_000;

/// Parts of a tick that are told apart ([`crate::chip`]).
pub const TICK_PARTS: u32 = 125;

/// UART 0, at any rate: QEMU has no wires.
pub mod uart {
    use crate::register::Register;

    /// Its number among the interrupts: UART 0 has received.
    pub const RECEIVED: u16 = 0;

    // SAFETY: UART 0 of the MPS2, Arm DAI 0385D, table 3-9.
    const DATA: Register<u32> = unsafe { Register::at(0x4000_4000) };
    // SAFETY: likewise.
    const STATE: Register<u32> = unsafe { Register::at(0x4000_4004) };
    // SAFETY: likewise.
    const CONTROL: Register<u32> = unsafe { Register::at(0x4000_4008) };
    // SAFETY: likewise.
    const INTERRUPTS: Register<u32> = unsafe { Register::at(0x4000_400c) };
    // SAFETY: likewise.
    const DIVIDER: Register<u32> = unsafe { Register::at(0x4000_4010) };

    const TRANSMITTER_FULL: u32 = 1 << 0;
    const RECEIVER_FULL: u32 = 1 << 1;
    const TRANSMIT: u32 = 1 << 0;
    const RECEIVE: u32 = 1 << 1;
    const RECEIVE_INTERRUPT: u32 = 1 << 3;
    /// 115,200 baud from 25 MHz.
    const BAUD_DIVIDER: u32 = 217;

    /// Both directions, and an interrupt for every byte received.
    pub fn start() {
        DIVIDER.write(BAUD_DIVIDER);
        CONTROL.write(TRANSMIT | RECEIVE | RECEIVE_INTERRUPT);
    }

    /// The byte received, in its interrupt.
    pub fn received() -> Option<u8> {
        // First, so that the next byte, which may come as soon as this one is
        // read, interrupts again.
        INTERRUPTS.write(RECEIVE);
        if STATE.read() & RECEIVER_FULL == 0 {
            return None;
        }
        let [byte, ..] = DATA.read().to_le_bytes();
        Some(byte)
    }

    /// Sends a byte once there is room for it.
    pub fn send(byte: u8) {
        while STATE.read() & TRANSMITTER_FULL != 0 {}
        DATA.write(u32::from(byte));
    }
}
