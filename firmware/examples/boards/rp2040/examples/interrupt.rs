//! The axis from an interrupt: SysTick, every Δt. Before it starts the chip replays
//! the golden vectors and says over its UART whether it gives every row.
//!
//! Pins, clocks and periods are those of the package.

#![no_std]
#![no_main]

use core::fmt::{self, Write};
use core::panic::PanicInfo;

use board_rp2040::Electronics;
use cortex_m::Peripherals;
use cortex_m::peripheral::SCB;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use drive::{Drive, PERIOD_US, Slot};
use embassy_rp::uart::{Blocking, UartTx};
use firmware_link::vectors::{ALL, report};
use static_cell::StaticCell;

static DRIVE: Slot<Drive<Electronics>> = Slot::new();

#[entry]
fn main() -> ! {
    static CELL: StaticCell<Drive<Electronics>> = StaticCell::new();
    let (mut electronics, uart) = Electronics::new(embassy_rp::init(Default::default()));
    let is_same = report(ALL, &mut Line(uart));
    if let (Ok(true), Some(mut core)) = (is_same, Peripherals::take()) {
        electronics.start_watchdog();
        if let Some(drive) = Drive::new(electronics) {
            DRIVE.put(CELL.init(drive));
        }
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(125 * PERIOD_US - 1);
        core.SYST.clear_current();
        core.SYST.enable_interrupt();
        core.SYST.enable_counter();
    }
    loop {
        cortex_m::asm::wfi();
    }
}

#[exception]
fn SysTick() {
    DRIVE.with(|drive| {
        drive.sample();
    });
}

/// The UART as a writer.
struct Line(UartTx<'static, Blocking>);

impl Write for Line {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0
            .blocking_write(text.as_bytes())
            .map_err(|_| fmt::Error)
    }
}

/// A reset takes the power away.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}
