//! The axis from embassy: a task with a ticker of Δt owns the drive.
//!
//! An executor does not interrupt a task for another. Whatever else runs beside this
//! one must give way within half a sample, or run on an executor of its own at a
//! lower priority; a sample that is left out is a fault.
//!
//! Pins, clocks and periods are those of the package.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use board_rp2040::Electronics;
use cortex_m::peripheral::SCB;
use drive::{Drive, PERIOD_US};
use embassy_executor::Spawner;
use embassy_time::{Duration, Ticker};

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let (mut electronics, _) = Electronics::new(embassy_rp::init(Default::default()));
    electronics.start_watchdog();
    if let Some(Ok(task)) = Drive::new(electronics).map(axis) {
        spawner.spawn(task);
    }
}

#[embassy_executor::task]
async fn axis(mut drive: Drive<Electronics>) {
    let mut samples = Ticker::every(Duration::from_micros(PERIOD_US.into()));
    loop {
        samples.next().await;
        drive.sample();
    }
}

/// A reset takes the power away.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}
