//! Parts of the RISC-V board: start, instruction counter, interrupts, sleep.

use core::arch::{asm, global_asm};

use riscv::register::{mie, minstret, mstatus};
pub use riscv_rt::entry;

use crate::board::uart;
use crate::register::Register;

// The runtime calls it before anything is on the stack.
global_asm!(
    ".section .text.paint, \"ax\"",
    ".global __pre_init",
    "__pre_init:",
    "la t0, _stack_end",
    "li t1, {paint}",
    "1: bgeu t0, sp, 2f",
    "sw t1, 0(t0)",
    "addi t0, t0, 4",
    "j 1b",
    "2: ret",
    paint = const parts::image::STACK_PAINT_VALUE,
);

/// Asks the debugger, which is QEMU, for an operation.
///
/// # Safety
/// The parameters must be those of the operation.
#[inline(never)]
pub(crate) unsafe fn semihosting(operation: u32, parameters: &[usize]) -> usize {
    let answer;
    // SAFETY: what the operation does with its parameters is who asks to know. The
    // three instructions must not be compressed, and lie in one page.
    unsafe {
        asm!(
            ".balign 16",
            ".option push",
            ".option norvc",
            "slli x0, x0, 0x1f",
            "ebreak",
            "srai x0, x0, 7",
            ".option pop",
            inout("a0") operation => answer,
            in("a1") parameters.as_ptr(),
            options(nostack),
        );
    }
    answer
}

/// The counter of instructions.
#[derive(Debug)]
pub(crate) struct Timer;

impl Timer {
    /// It runs from the start.
    pub(crate) fn start() -> Self {
        Self
    }

    /// The counter's lower 32 bits.
    #[inline(always)]
    pub(crate) fn now(&self) -> u32 {
        u32::try_from(minstret::read()).unwrap_or(u32::MAX)
    }

    /// Ticks since it was `then`; right below 2^32 of them, 4 s.
    #[inline(always)]
    pub(crate) fn since(&self, then: u32) -> u32 {
        self.now().wrapping_sub(then)
    }
}

// SAFETY: the interrupt controller of virt; RISC-V PLIC 1.0.0, source 10,
// context 0.
const PRIORITY: Register<u32> = unsafe { Register::at(0x0c00_0028) };
// SAFETY: likewise.
const ENABLED: Register<u32> = unsafe { Register::at(0x0c00_2000) };
// SAFETY: likewise.
const THRESHOLD: Register<u32> = unsafe { Register::at(0x0c20_0000) };
// SAFETY: likewise.
const CLAIM: Register<u32> = unsafe { Register::at(0x0c20_0004) };

/// Lets the UART interrupt.
pub fn unmask_uart() {
    PRIORITY.write(1);
    THRESHOLD.write(0);
    ENABLED.write(1 << uart::RECEIVED);
    // SAFETY: the handler is in place, and no critical section is built on
    // this interrupt being masked.
    unsafe { mie::set_mext() };
    // SAFETY: likewise.
    unsafe { mstatus::set_mie() };
}

/// Sleeps until an interrupt, unless `ready` says that there is work.
///
/// Interrupts are held back in between, so that none can come after the
/// question and before the sleep; one that waits ends the sleep all the same.
/// The UART is asked once more: a byte that is already there when the interrupt
/// is let in raises none in QEMU, and no other byte is taken before it.
pub fn sleep_unless(ready: impl FnOnce() -> bool) {
    riscv::interrupt::free(|| {
        uart_received();
        if !ready() {
            riscv::asm::wfi();
        }
    });
}

unsafe extern "C" {
    /// Defined by an image that uses the UART, else the runtime's default
    /// (`memory/rv32.x`).
    safe fn uart_received();
}

#[riscv_rt::core_interrupt(riscv::interrupt::Interrupt::MachineExternal)]
fn external() {
    let source = CLAIM.read();
    uart_received();
    CLAIM.write(source);
}
