//! Pins, their functions, and the button and lamps on them. The table in `README.md` says why, and where it goes.
//!
//! RM 8.4 has the registers, DS table 9 the alternate functions. What is not
//! named stays as it is after reset, an input without pull.

use stm32f4::stm32f407::{GPIOA, GPIOB, GPIOC, GPIOD, Peripherals, RCC};

/// Gives every part its clock and every pin its function. The power stage stays
/// off: its pin is low before it becomes an output, and never high in between.
pub(super) fn connect(chip: &Peripherals) {
    clocks(&chip.RCC);
    power(&chip.GPIOC);
    converter(&chip.GPIOB);
    encoder_line_and_button(&chip.GPIOA);
    lamps(&chip.GPIOD);
}

/// RM 7.3.10 and 7.3.13. A part can be used two bus cycles after its clock is
/// on (errata sheet ES0182, "Delay after an RCC peripheral clock enabling"); the
/// read back takes longer.
fn clocks(rcc: &RCC) {
    rcc.ahb1enr().modify(|_, w| {
        w.gpioaen().enabled().gpioben().enabled();
        w.gpiocen().enabled().gpioden().enabled()
    });
    rcc.apb1enr().modify(|_, w| {
        w.tim2en().enabled().tim3en().enabled().tim5en().enabled();
        w.spi2en().enabled().usart2en().enabled()
    });
    let _ = rcc.ahb1enr().read();
    let _ = rcc.apb1enr().read();
}

/// PC1 enables the power stage, PC2 is the stop, PC4 the jumper.
fn power(port: &GPIOC) {
    port.bsrr().write(|w| w.br1().reset());
    port.pupdr()
        .modify(|_, w| w.pupdr2().pull_down().pupdr4().pull_down());
    port.moder().modify(|_, w| w.moder1().output());
}

/// PB12 selects the converter, PB13 to PB15 are SPI2.
fn converter(port: &GPIOB) {
    port.bsrr().write(|w| w.bs12().set_());
    // SCK and MOSI need edges for 5 MHz; the lowest speed ends at 4 (DS 5.3.16).
    port.ospeedr()
        .modify(|_, w| w.ospeedr13().medium_speed().ospeedr15().medium_speed());
    // A converter that is not there reads as zeros, which the driver refuses.
    port.pupdr().modify(|_, w| w.pupdr14().pull_down());
    port.afrh()
        .modify(|_, w| w.afrh13().af5().afrh14().af5().afrh15().af5());
    port.moder().modify(|_, w| {
        w.moder12().output().moder13().alternate();
        w.moder14().alternate().moder15().alternate()
    });
}

/// PA1 and PA15 are the encoder on TIM2, PA2 and PA3 USART2; PA0, the button,
/// is an input after reset and has its resistor on the board.
fn encoder_line_and_button(port: &GPIOA) {
    // Open inputs stand still, and a line without a host is idle.
    port.pupdr()
        .modify(|_, w| w.pupdr1().pull_up().pupdr3().pull_up().pupdr15().pull_up());
    port.afrl()
        .modify(|_, w| w.afrl1().af1().afrl2().af7().afrl3().af7());
    port.afrh().modify(|_, w| w.afrh15().af1());
    port.moder().modify(|_, w| {
        w.moder1().alternate().moder2().alternate();
        w.moder3().alternate().moder15().alternate()
    });
}

/// PD12 to PD15: green, orange, red, blue.
fn lamps(port: &GPIOD) {
    port.moder().modify(|_, w| {
        w.moder12().output().moder13().output();
        w.moder14().output().moder15().output()
    });
}

/// A lamp and what it says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lamp {
    /// Green, LD4: bench mode; in drive mode, the axis has power.
    Bench,
    /// Orange, LD3: the crystal did not start.
    NoCrystal,
    /// Red, LD5: a fault is latched, or the converter does not answer.
    Fault,
    /// Blue, LD6: drive mode.
    Drive,
}

/// PA0 and PD12 to PD15.
#[derive(Debug)]
pub(super) struct Panel {
    button: GPIOA,
    lamps: GPIOD,
}

impl Panel {
    /// All dark.
    pub(super) fn new(button: GPIOA, lamps: GPIOD) -> Self {
        Self { button, lamps }
    }

    /// Tells whether the button is down: high on this board.
    pub(super) fn button_is_down(&self) -> bool {
        self.button.idr().read().idr0().is_high()
    }

    /// Switches a lamp.
    pub(super) fn show(&mut self, lamp: Lamp, on: bool) {
        self.lamps.bsrr().write(|w| match (lamp, on) {
            (Lamp::Bench, true) => w.bs12().set_(),
            (Lamp::Bench, false) => w.br12().reset(),
            (Lamp::NoCrystal, true) => w.bs13().set_(),
            (Lamp::NoCrystal, false) => w.br13().reset(),
            (Lamp::Fault, true) => w.bs14().set_(),
            (Lamp::Fault, false) => w.br14().reset(),
            (Lamp::Drive, true) => w.bs15().set_(),
            (Lamp::Drive, false) => w.br15().reset(),
        });
    }
}
