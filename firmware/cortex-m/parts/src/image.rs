//! What the image knows of itself: its bytes in flash and its share of RAM.

use firmware_link::frame::crc32_on;

// Named by the runtime's linker script; only their addresses mean something.
unsafe extern "C" {
    static __vector_table: u8;
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
    static _stack_end: u8;
}

/// Bytes from one address to another.
fn between(from: *const u8, to: *const u8) -> u32 {
    u32::try_from(to.addr().saturating_sub(from.addr())).unwrap_or(u32::MAX)
}

/// Bytes that the image takes in flash: from the vector table to the last
/// initial value of a static.
pub fn flash_bytes() -> u32 {
    let data = between(&raw const __sdata, &raw const __edata);
    between(&raw const __vector_table, &raw const __sidata).saturating_add(data)
}

/// CRC-32 over those bytes, as they are read here and now.
pub fn crc() -> u32 {
    let mut at = &raw const __vector_table;
    let mut crc = 0;
    for _ in 0..flash_bytes() {
        // SAFETY: the linker script puts the image's bytes there, and a chip's
        // flash may be read. Volatile, because the vector table is at address
        // 0, which is no address to the compiler.
        let byte = unsafe { at.read_volatile() };
        crc = crc32_on(crc, &[byte]);
        at = at.wrapping_add(1);
    }
    crc
}

/// All statics \[bytes\].
pub fn static_bytes() -> u32 {
    between(&raw const __sdata, &raw const _stack_end)
}
