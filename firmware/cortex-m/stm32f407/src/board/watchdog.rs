//! The independent watchdog: a program that hangs is a reset, and a reset takes
//! the power away.

use stm32f4::stm32f407::IWDG;

/// Runs from its own oscillator, whatever becomes of the crystal.
#[derive(Debug)]
pub(super) struct Watchdog(IWDG);

impl Watchdog {
    /// From here on [`Watchdog::feed`] must come within 10 ms; the oscillator
    /// has 17 to 47 kHz (DS 5.3.9), which makes it 7 to 19 ms. It goes on while a
    /// debugger holds the core: a breakpoint in drive mode is a reset, because
    /// the motor would go on with the last code.
    pub(super) fn start(watchdog: IWDG) -> Self {
        // RM 21.3 and 21.4: a quarter of 32 kHz, 80 counts.
        watchdog.kr().write(|w| w.key().start());
        watchdog.kr().write(|w| w.key().unlock());
        watchdog.pr().write(|w| w.pr().divide_by4());
        watchdog.rlr().write(|w| w.rl().set(80));
        watchdog.kr().write(|w| w.key().feed());
        Self(watchdog)
    }

    /// All is well.
    pub(super) fn feed(&mut self) {
        self.0.kr().write(|w| w.key().feed());
    }
}
