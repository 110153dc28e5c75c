//! The image's knowledge of itself: its bytes in flash, its share of RAM, and
//! the depth that its stack has reached.

#[cfg(target_arch = "arm")]
use cortex_m_rt::STACK_PAINT_VALUE;
use firmware_link::Identity;
use firmware_link::body::VERSION;
use firmware_link::frame::crc32_on;

/// Pattern that the image paints the stack with; on Arm the runtime does it.
#[cfg(not(target_arch = "arm"))]
pub const STACK_PAINT_VALUE: u32 = 0xcccc_cccc;

// Named by the runtime's linker script; only their addresses mean something.
unsafe extern "C" {
    static __vector_table: u8;
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Bytes from one address to another.
fn between(from: *const u8, to: *const u8) -> u32 {
    u32::try_from(to.addr().wrapping_sub(from.addr())).unwrap_or(u32::MAX)
}

/// Bytes that the image takes in flash: from the vector table to the last
/// initial value of a static.
fn flash_bytes() -> u32 {
    let data = between(&raw const __sdata, &raw const __edata);
    between(&raw const __vector_table, &raw const __sidata).wrapping_add(data)
}

/// Identity of the image on a chip of that name, whose table of setpoints is the
/// type `T` with that capacity.
pub fn identity<T>(target: [u8; 8], capacity: usize, timer_hz: u32) -> Identity {
    let table = u32::try_from(size_of::<T>()).unwrap_or(0);
    Identity {
        version: VERSION,
        target,
        image_crc: crc(),
        flash_bytes: flash_bytes(),
        ram_bytes: static_bytes().wrapping_sub(table),
        table_capacity: u32::try_from(capacity).unwrap_or(u32::MAX),
        timer_hz,
    }
}

/// CRC-32 over those bytes, as they are read here and now.
fn crc() -> u32 {
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
fn static_bytes() -> u32 {
    between(&raw const __sdata, (&raw const _stack_end).cast())
}

/// Deepest stack so far \[bytes\].
///
/// At its start the runtime paints all memory between the statics and the top
/// of the stack, which grows down; what has lost its paint has been used.
pub fn deepest_stack_bytes() -> u32 {
    let top = &raw const _stack_start;
    let mut at = &raw const _stack_end;
    // SAFETY: both ends are aligned addresses of RAM, and every word between
    // them may be read. Volatile, because the stack changes behind the
    // compiler's back.
    while at < top && unsafe { at.read_volatile() } == STACK_PAINT_VALUE {
        at = at.wrapping_add(1);
    }
    between(at.cast(), top.cast())
}
