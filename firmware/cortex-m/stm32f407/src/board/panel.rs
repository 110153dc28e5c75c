//! The button and the four lamps of the board.

use stm32f4::stm32f407::{GPIOA, GPIOD};

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
