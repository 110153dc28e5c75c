//! The board: what happens at a reset, and the parts of the chip in use.

mod chip;
mod clock;
mod electronics;
mod line;
mod modes;
mod pins;
mod samples;

use cortex_m_rt::entry;
use firmware::{CAPACITY, SetpointTable};
use firmware_link::Server;
// The panic handler.
use parts as _;
use stm32f4::stm32f407::Peripherals;

use self::chip::Chip;
use self::electronics::{Bus, Electronics, Encoder, PowerStage};
use self::line::Line;
use self::pins::{Lamp, Panel};
use self::samples::Samples;

/// Core cycles until the pull resistors have charged their pins: 60 µs at
/// 168 MHz, for 40 kΩ and 1 nF of wire.
const PULL_CYCLES: u32 = 10_000;

#[entry]
fn main() -> ! {
    // Zeros, so that they take no flash.
    static mut TABLE: SetpointTable<CAPACITY> = SetpointTable::resting_at(0);
    static mut SERVER: Server = Server::START;

    // Both are there: nothing has taken them before.
    let (Some(mut core), Some(chip)) = (cortex_m::Peripherals::take(), Peripherals::take()) else {
        halt()
    };
    pins::connect(&chip);
    let clocks = clock::start(&chip.RCC, &chip.FLASH);
    cortex_m::asm::delay(PULL_CYCLES);

    let mut panel = Panel::new(chip.GPIOA, chip.GPIOD);
    panel.show(Lamp::NoCrystal, !clocks.crystal);
    let power = PowerStage::new(chip.GPIOC);
    let drives = power.jumper_is_set();
    let encoder = Encoder::start(chip.TIM2);
    let converter = Bus::start(chip.SPI2, chip.GPIOB);
    let mut electronics = Electronics::new(encoder, converter, power);
    let is_safe = electronics.initialise().is_ok();
    panel.show(Lamp::Fault, !is_safe);

    let line = Line::start(chip.USART2, &mut core.NVIC, &clocks);
    let meter = Chip::start(core.DCB, core.DWT, &clocks);
    if drives {
        let samples = Samples::new(chip.TIM3, chip.TIM5);
        let board = is_safe.then_some(electronics);
        modes::drive(board, panel, samples, chip.IWDG, &clocks, line, &meter)
    } else {
        panel.show(Lamp::Bench, true);
        modes::bench(line, meter, SERVER, TABLE)
    }
}

/// Waits for a reset.
fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
