//! Parts of all Cortex-M: start, SysTick, interrupts, sleep.

use core::arch::asm;

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
pub use cortex_m_rt::entry;

use crate::board::uart;
use crate::register::Register;

/// SysTick counts down through 24 bits.
const RELOAD: u32 = 0xff_ffff;

// SAFETY: SysTick, the same in every Cortex-M; Arm DDI 0403E, B3.3.
const CONTROL: Register<u32> = unsafe { Register::at(0xe000_e010) };
// SAFETY: likewise.
const RELOAD_VALUE: Register<u32> = unsafe { Register::at(0xe000_e014) };
// SAFETY: likewise.
const CURRENT: Register<u32> = unsafe { Register::at(0xe000_e018) };

const ENABLE: u32 = 1 << 0;
const CORE_CLOCK: u32 = 1 << 2;

/// SysTick at the processor's clock, free running. By its registers: `cortex_m`'s way
/// takes 12 bytes more, of the 16 that an image has left.
#[derive(Debug)]
pub(crate) struct Timer;

impl Timer {
    /// Starts it.
    pub(crate) fn start() -> Self {
        RELOAD_VALUE.write(RELOAD);
        CURRENT.write(0);
        CONTROL.write(CORE_CLOCK | ENABLE);
        Self
    }

    /// Ticks left until it starts again.
    #[inline(always)]
    pub(crate) fn now(&self) -> u32 {
        CURRENT.read()
    }

    /// Ticks since it was `then`; right below 2^24 of them, 0.6 s at least.
    #[inline(always)]
    pub(crate) fn since(&self, then: u32) -> u32 {
        then.wrapping_sub(CURRENT.read()) & RELOAD
    }
}

/// Asks the debugger, which is QEMU, for an operation.
///
/// # Safety
/// The parameters must be those of the operation.
#[inline(never)]
pub(crate) unsafe fn semihosting(operation: u32, parameters: &[usize]) -> usize {
    let answer;
    // SAFETY: what the operation does with its parameters is who asks to know.
    unsafe {
        asm!(
            "bkpt 0xab",
            inout("r0") operation => answer,
            in("r1") parameters.as_ptr(),
            options(nostack),
        );
    }
    answer
}

/// The UART's interrupt.
#[derive(Debug, Clone, Copy)]
struct Received;

// SAFETY: the number is that of the board's UART, in the vector table below.
unsafe impl InterruptNumber for Received {
    fn number(self) -> u16 {
        uart::RECEIVED
    }
}

/// Lets the UART interrupt.
pub fn unmask_uart() {
    // SAFETY: no critical section is built on this interrupt being masked.
    unsafe { NVIC::unmask(Received) };
}

/// Sleeps until an interrupt, unless `ready` says that there is work.
///
/// Interrupts are held back in between, so that none can come after the
/// question and before the sleep; one that waits ends the sleep all the same.
pub fn sleep_unless(ready: impl FnOnce() -> bool) {
    cortex_m::interrupt::free(|_| {
        if !ready() {
            cortex_m::asm::wfi();
        }
    });
}

unsafe extern "C" {
    /// Defined by an image that uses the UART, else the runtime's default
    /// (`device.x`).
    fn uart_received();
}

/// The interrupts that any of the boards has for its UART, 0 to 2; no other is
/// ever unmasked.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); 3] = [uart_received; 3];
