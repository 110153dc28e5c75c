//! The motor's encoder, counted by TIM2: 32 bits, four counts a line.

use stm32f4::stm32f407::TIM2;

/// TIM2 as a counter of quadrature. The count is 0 at the start.
#[derive(Debug)]
pub(super) struct Encoder(TIM2);

impl Encoder {
    /// Counts from here on.
    pub(super) fn start(timer: TIM2) -> Self {
        // RM 18.3.12, encoder mode 3: both edges of both channels. The filter
        // takes a level that lasts 8 clocks (RM 18.4.7): 95 ns at 84 MHz, a
        // thirtieth of a count at the motor's full speed.
        timer.ccmr1_input().write(|w| {
            w.cc1s()
                .ti1()
                .ic1f()
                .fck_int_n8()
                .cc2s()
                .ti2()
                .ic2f()
                .fck_int_n8()
        });
        timer.smcr().write(|w| w.sms().encoder_mode_3());
        // Through all 32 bits.
        timer.arr().write(|w| w.arr().set(u32::MAX));
        timer.cnt().write(|w| w.cnt().set(0));
        timer.cr1().write(|w| w.cen().enabled());
        Self(timer)
    }

    /// The register \[counts\].
    pub(super) fn count(&self) -> u32 {
        self.0.cnt().read().bits()
    }
}
