//! The axis's electronics as the firmware sees them.

use firmware::Board;
use firmware::hardware::{Ad57x1r, Ad57x1rError, Ad57x1rModel};

use super::converter::{Bus, TimedOut};
use super::encoder::Encoder;
use super::power::PowerStage;

/// TIM2's encoder, an AD5761R on SPI2, enable and stop.
#[derive(Debug)]
pub(super) struct Electronics {
    encoder: Encoder,
    converter: Ad57x1r<Bus>,
    power: PowerStage,
}

impl Electronics {
    /// Made of its parts; [`Electronics::initialise`] goes before the first sample.
    pub(super) fn new(encoder: Encoder, bus: Bus, power: PowerStage) -> Self {
        Self {
            encoder,
            converter: Ad57x1r::new(bus, Ad57x1rModel::Ad5761r),
            power,
        }
    }

    /// Takes the power away and brings up the converter at 0 V.
    pub(super) fn initialise(&mut self) -> Result<(), Ad57x1rError<TimedOut>> {
        self.power.set(false);
        self.converter.initialise()
    }
}

impl Board for Electronics {
    type Error = Ad57x1rError<TimedOut>;

    fn motor_register(&mut self) -> Result<u32, Self::Error> {
        Ok(self.encoder.count())
    }

    fn set_code(&mut self, code: i32) -> Result<(), Self::Error> {
        self.converter.set_code(code)
    }

    fn set_power(&mut self, on: bool) -> Result<(), Self::Error> {
        self.power.set(on);
        Ok(())
    }

    fn emergency_stop(&mut self) -> Result<bool, Self::Error> {
        Ok(self.power.stop_is_asserted())
    }
}
