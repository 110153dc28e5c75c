//! The axis from an interrupt: the system timer, every Δt. Edges of the encoder
//! interrupt the sample.
//!
//! Pins, clocks and periods are those of the package.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use board_esp32c3::Electronics;
use drive::{Drive, PERIOD_US, Slot};
use esp_hal::Blocking;
use esp_hal::clock::CpuClock;
use esp_hal::interrupt::Priority;
use esp_hal::time::Duration;
use esp_hal::timer::PeriodicTimer;
use esp_hal::timer::systimer::SystemTimer;
use static_cell::StaticCell;

esp_bootloader_esp_idf::esp_app_desc!();

static DRIVE: Slot<Drive<Electronics>> = Slot::new();
static TIMER: Slot<PeriodicTimer<'static, Blocking>> = Slot::new();

#[esp_hal::main]
fn main() -> ! {
    static DRIVE_CELL: StaticCell<Drive<Electronics>> = StaticCell::new();
    static TIMER_CELL: StaticCell<PeriodicTimer<'static, Blocking>> = StaticCell::new();
    let config = esp_hal::Config::default().with_cpu_clock(CpuClock::max());
    if let Some((electronics, timer)) = Electronics::new(esp_hal::init(config)) {
        if let Some(drive) = Drive::new(electronics) {
            DRIVE.put(DRIVE_CELL.init(drive));
        }
        let alarm = SystemTimer::new(timer).alarm0;
        let timer = TIMER_CELL.init(PeriodicTimer::new(alarm));
        timer.set_interrupt_handler(sample);
        timer.listen();
        // A timer that does not start lets the watchdog end.
        let _ = timer.start(Duration::from_micros(PERIOD_US.into()));
        TIMER.put(timer);
    }
    loop {
        core::hint::spin_loop();
    }
}

#[esp_hal::handler(priority = Priority::Priority1)]
fn sample() {
    TIMER.with(PeriodicTimer::clear_interrupt);
    DRIVE.with(|drive| {
        drive.sample();
    });
}

/// A reset takes the power away.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    esp_hal::system::software_reset()
}
