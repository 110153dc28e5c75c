//! An STM32G431, such as a NUCLEO-G431RB, as the board of an axis.
//!
//! | pin | direction | connects to |
//! | --- | --- | --- |
//! | PA0, PA1 | in, pull-up, TIM2 CH1, CH2 (AF1) | encoder A, B, 3.3 V |
//! | PA6, PA7 | out, TIM3 CH1, CH2 (AF2) | inputs of an H-bridge: forth, back |
//! | PA5 | out, high: power on | enable of the H-bridge, **and 10 kΩ to ground** |
//! | PA8 | in, pull-down, low: stop | normally closed contacts to 3.3 V |
//! | PA4 | in, pull-up, low: pressed | button to ground |
//!
//! | clock or period | |
//! | --- | --- |
//! | core, buses, timers | 80 MHz, PLL on the RC oscillator of 16 MHz: times and speeds are off by its 1 % |
//! | encoder | 32 bits, four counts a line; a level must last 8 clocks, 0.1 µs |
//! | PWM | 80 MHz / 4,096 = 19.5 kHz; a code acts at the next period, 51 µs later at most |
//! | Δt | 1 ms, SysTick; the core's cycle counter as the count of samples |
//! | watchdog | 10 ms: a program that hangs is a reset, and behind it the resistor keeps the power off |
//!
//! Sections are those of ST's RM0440, quoted from memory. Built by `scripts/test`,
//! **never run on a chip**.

#![no_std]

use core::convert::Infallible;

use cortex_m::peripheral::DWT;
use cortex_m::peripheral::syst::SystClkSource;
use drive::{PERIOD_US, PWM_COUNTS, Panel, duties};
use firmware::Board;
use stm32g4::stm32g431::{FLASH, GPIOA, IWDG, Peripherals, RCC, TIM2, TIM3};

/// Cycles of the core in a sample.
const CYCLES: u32 = 80 * PERIOD_US;

/// Encoder, H-bridge, stop, button and watchdog.
pub struct Electronics {
    encoder: TIM2,
    bridge: TIM3,
    port: GPIOA,
    watchdog: IWDG,
}

impl Electronics {
    /// The board without power. From here on SysTick interrupts every Δt, and
    /// [`Panel::feed`] must come within 10 ms.
    pub fn new(core: &mut cortex_m::Peripherals, chip: Peripherals) -> Self {
        start_clock(&chip.RCC, &chip.FLASH);
        chip.RCC.ahb2enr().modify(|_, w| w.gpioaen().enabled());
        chip.RCC
            .apb1enr1()
            .modify(|_, w| w.tim2en().enabled().tim3en().enabled());
        connect(&chip.GPIOA);
        start_encoder(&chip.TIM2);
        start_pwm(&chip.TIM3);
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(CYCLES - 1);
        core.SYST.clear_current();
        core.SYST.enable_interrupt();
        core.SYST.enable_counter();
        start_watchdog(&chip.IWDG);
        Self {
            encoder: chip.TIM2,
            bridge: chip.TIM3,
            port: chip.GPIOA,
            watchdog: chip.IWDG,
        }
    }
}

/// 16 MHz / 4·40 / 2.
fn start_clock(rcc: &RCC, flash: &FLASH) {
    // Two wait states serve up to 90 MHz in range 1 (3.3.3).
    flash.acr().modify(|_, w| w.latency().wait2());
    rcc.pllcfgr().write(|w| {
        w.pllsrc().hsi16().pllm().div4().plln().div40();
        w.pllr().div2().pllren().set_bit()
    });
    rcc.cr().modify(|_, w| w.pllon().on());
    // The oscillator runs since the reset; without it there is no program.
    while rcc.cr().read().pllrdy().is_not_ready() {}
    rcc.cfgr().modify(|_, w| w.sw().pll());
    while !rcc.cfgr().read().sws().is_pll() {}
}

fn connect(port: &GPIOA) {
    port.pupdr().modify(|_, w| {
        w.pupdr0().pull_up().pupdr1().pull_up();
        w.pupdr4().pull_up().pupdr8().pull_down()
    });
    port.afrl()
        .modify(|_, w| w.afrl0().af1().afrl1().af1().afrl6().af2().afrl7().af2());
    port.moder().modify(|_, w| {
        w.moder0().alternate().moder1().alternate();
        w.moder4().input().moder5().output();
        w.moder6().alternate().moder7().alternate();
        w.moder8().input()
    });
}

fn start_encoder(timer: &TIM2) {
    timer.ccmr1_input().write(|w| {
        w.cc1s().ti1().ic1f().fck_int_n8();
        w.cc2s().ti2().ic2f().fck_int_n8()
    });
    // SAFETY: encoder mode 3 (29.5.3), both edges of both channels.
    timer.smcr().write(|w| unsafe { w.sms().bits(0b011) });
    timer.arr().write(|w| w.arr().set(u32::MAX));
    timer.cr1().write(|w| w.cen().enabled());
}

fn start_pwm(timer: &TIM3) {
    timer.ccmr1_output().write(|w| {
        w.oc1m().pwm_mode1().oc1pe().enabled();
        w.oc2m().pwm_mode1().oc2pe().enabled()
    });
    timer.ccer().write(|w| w.cc1e().enabled().cc2e().enabled());
    timer
        .arr()
        .write(|w| w.arr().set(u32::from(PWM_COUNTS - 1)));
    timer.egr().write(|w| w.ug().update());
    timer.cr1().write(|w| w.cen().enabled());
}

/// 80 counts of a quarter of 32 kHz. Until that is taken over, in less than 1 ms,
/// a feed loads half a second.
fn start_watchdog(watchdog: &IWDG) {
    watchdog.kr().write(|w| w.key().start());
    watchdog.kr().write(|w| w.key().unlock());
    watchdog.pr().write(|w| w.pr().divide_by4());
    watchdog.rlr().write(|w| w.rl().set(80));
}

impl Board for Electronics {
    type Error = Infallible;

    fn motor_register(&mut self) -> Result<u32, Infallible> {
        Ok(self.encoder.cnt().read().bits())
    }

    fn set_code(&mut self, code: i32) -> Result<(), Infallible> {
        let [forth, back] = duties(code).map(u32::from);
        self.bridge.ccr1().write(|w| w.ccr().set(forth));
        self.bridge.ccr2().write(|w| w.ccr().set(back));
        Ok(())
    }

    fn set_power(&mut self, on: bool) -> Result<(), Infallible> {
        self.port
            .bsrr()
            .write(|w| if on { w.bs5().set_() } else { w.br5().reset() });
        Ok(())
    }

    fn emergency_stop(&mut self) -> Result<bool, Infallible> {
        Ok(self.port.idr().read().idr8().is_low())
    }
}

impl Panel for Electronics {
    const COUNTS_PER_SAMPLE: u32 = CYCLES;

    fn counter(&self) -> u32 {
        DWT::cycle_count()
    }

    fn button_is_down(&self) -> bool {
        self.port.idr().read().idr4().is_low()
    }

    fn feed(&mut self) {
        self.watchdog.kr().write(|w| w.key().feed());
    }
}
