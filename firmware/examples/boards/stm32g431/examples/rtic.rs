//! The axis from RTIC 2: a hardware task at SysTick, every Δt, owns the drive.
//! Tasks of a lower priority have what is left of the time.
//!
//! Pins, clocks and periods are those of the package.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use defmt_rtt as _;

#[rtic::app(device = stm32g4::stm32g431, peripherals = true)]
mod app {
    use board_stm32g431::Electronics;
    use drive::Drive;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        drive: Option<Drive<Electronics>>,
    }

    #[init]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let electronics = Electronics::new(&mut context.core, context.device);
        let drive = Drive::new(electronics);
        (Shared {}, Local { drive })
    }

    #[task(binds = SysTick, priority = 2, local = [drive])]
    fn sample(context: sample::Context) {
        if let Some(drive) = context.local.drive {
            drive.sample();
        }
    }
}

/// A reset takes the power away.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}
