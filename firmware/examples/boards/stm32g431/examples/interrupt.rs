//! The axis from an interrupt: SysTick, every Δt. Each new state is told through
//! the debugger's probe, a fault with its values: `firmware`'s feature `defmt`.
//!
//! Pins, clocks and periods are those of the package.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use board_stm32g431::Electronics;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{entry, exception};
use defmt_rtt as _;
use drive::{Drive, Slot};
use firmware::State;
use static_cell::StaticCell;
use stm32g4::stm32g431::Peripherals;

static DRIVE: Slot<Drive<Electronics>> = Slot::new();

#[entry]
fn main() -> ! {
    static CELL: StaticCell<Drive<Electronics>> = StaticCell::new();
    if let (Some(mut core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) {
        let electronics = Electronics::new(&mut core, chip);
        if let Some(drive) = Drive::new(electronics) {
            DRIVE.put(CELL.init(drive));
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}

#[exception]
fn SysTick() {
    static mut LAST: State = State::Disabled;
    DRIVE.with(|drive| {
        let output = drive.sample();
        if *LAST != output.state {
            *LAST = output.state;
            defmt::info!("{} {}", output, drive.fault());
        }
    });
}

/// A reset takes the power away.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}

defmt::timestamp!("{=u32:us}", cortex_m::peripheral::DWT::cycle_count() / 80);
