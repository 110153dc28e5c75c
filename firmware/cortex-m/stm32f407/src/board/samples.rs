//! The sample time: TIM3 begins each sample, TIM5 counts them, and the
//! independent watchdog resets a program that leaves them out.
//!
//! ```text
//!  1 MHz ─► TIM3, Δt ──┬── interrupt
//!                      └── trigger ─► TIM5, 32 bits
//! ```
//!
//! The count goes on without the program, so that a sample that was left out
//! shows in it.

use stm32f4::stm32f407::{IWDG, TIM3, TIM5};
use stm32f407_drive::axis::PERIOD_NS;

use super::clock::{Clocks, soon};

/// Polls for the watchdog's settings: above 0.6 ms at 168 MHz, where a register of
/// APB1 takes 4 cycles and more; 0.3 ms are needed.
const TRIES: u32 = 25_000;

/// TIM3's last count in a sample \[µs\]. It has 16 bits (`clock.rs`).
const LAST_US: u16 = {
    let [low, high, ..] = (PERIOD_NS / 1_000 - 1).to_le_bytes();
    u16::from_le_bytes([low, high])
};

/// Both timers.
#[derive(Debug)]
pub(super) struct Samples {
    timer: TIM3,
    counter: TIM5,
}

impl Samples {
    /// Not yet running.
    pub(super) fn new(timer: TIM3, counter: TIM5) -> Self {
        Self { timer, counter }
    }

    /// Starts both; the first interrupt comes a sample time later.
    pub(super) fn start(&mut self, clocks: &Clocks) {
        let (timer, counter) = (&self.timer, &self.counter);
        timer.psc().write(|w| w.psc().set(clocks.timer_prescaler));
        timer.arr().write(|w| w.arr().set(LAST_US));
        // The prescaler is taken over at an update (RM 18.3.1), which is not to
        // interrupt.
        timer.cr1().write(|w| w.urs().counter_only());
        timer.egr().write(|w| w.ug().update());
        // RM 18.4.2: an update is the trigger.
        timer.cr2().write(|w| w.mms().update());
        // RM 18.3.15 and 18.4.3: clocked by ITR1, which is TIM3 for TIM5.
        counter.arr().write(|w| w.arr().set(u32::MAX));
        counter
            .smcr()
            .write(|w| w.ts().itr1().sms().ext_clock_mode());
        counter.cr1().write(|w| w.cen().enabled());
        timer.sr().write(|w| w.uif().clear());
        timer.dier().write(|w| w.uie().enabled());
        timer.cr1().modify(|_, w| w.cen().enabled());
    }

    /// Takes the interrupt; the number of samples that have begun.
    pub(super) fn begin(&mut self) -> u32 {
        self.timer.sr().write(|w| w.uif().clear());
        self.counter.cnt().read().bits()
    }

    /// Tells whether the next one has begun.
    pub(super) fn is_over(&self) -> bool {
        self.timer.sr().read().uif().is_update_pending()
    }
}

/// The independent watchdog: a program that hangs is a reset, and a reset takes
/// the power away. It runs from its own oscillator, whatever becomes of the
/// crystal.
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
        // RM 21.4.4: the oscillator takes both over within 5 of its cycles, 0.3 ms
        // at 17 kHz, and until then a feed loads what was there before: after a
        // reset 4,095 counts, half a second. Should it take longer, the first
        // samples feed it again.
        let _ = soon(TRIES, || {
            let status = watchdog.sr().read();
            status.pvu().bit_is_clear() && status.rvu().bit_is_clear()
        });
        watchdog.kr().write(|w| w.key().feed());
        Self(watchdog)
    }

    /// All is well.
    pub(super) fn feed(&mut self) {
        self.0.kr().write(|w| w.key().feed());
    }
}
