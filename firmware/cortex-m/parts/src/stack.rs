//! Depth that the stack has reached.

#[cfg(target_arch = "arm")]
use cortex_m_rt::STACK_PAINT_VALUE;

/// Pattern that the image paints the stack with; on Arm the runtime does it.
#[cfg(not(target_arch = "arm"))]
pub const STACK_PAINT_VALUE: u32 = 0xcccc_cccc;

// Named by the runtime's linker script; only their addresses mean something.
unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Deepest stack so far \[bytes\].
///
/// At its start the runtime paints all memory between the statics and the top
/// of the stack, which grows down; what has lost its paint has been used.
pub fn deepest() -> u32 {
    let top = &raw const _stack_start;
    let mut at = &raw const _stack_end;
    // SAFETY: both ends are aligned addresses of RAM, and every word between
    // them may be read. Volatile, because the stack changes behind the
    // compiler's back.
    while at < top && unsafe { at.read_volatile() } == STACK_PAINT_VALUE {
        at = at.wrapping_add(1);
    }
    u32::try_from(top.addr().saturating_sub(at.addr())).unwrap_or(u32::MAX)
}
