//! The power stage's enable, the stop and the jumper: port C.

use stm32f4::stm32f407::GPIOC;

/// PC1, PC2 and PC4.
#[derive(Debug)]
pub(super) struct PowerStage(GPIOC);

impl PowerStage {
    /// As [`super::pins`] has left it: off.
    pub(super) fn new(port: GPIOC) -> Self {
        Self(port)
    }

    /// PC1, high: on.
    pub(super) fn set(&mut self, on: bool) {
        self.0
            .bsrr()
            .write(|w| if on { w.bs1().set_() } else { w.br1().reset() });
    }

    /// PC2, low: asserted. The loop is closed to 3 V, so that an open loop, a
    /// broken wire and a short to ground are all a stop.
    pub(super) fn stop_is_asserted(&self) -> bool {
        self.0.idr().read().idr2().is_low()
    }

    /// PC4, high: drive mode.
    pub(super) fn jumper_is_set(&self) -> bool {
        self.0.idr().read().idr4().is_high()
    }
}
