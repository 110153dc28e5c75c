//! The axis's electronics: the encoder on TIM2, the converter on SPI2 behind
//! PB12, enable, stop and jumper on port C; and as the firmware sees them.

use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use firmware::Board;
use firmware::hardware::{Ad57x1r, Ad57x1rError, Ad57x1rModel};
use stm32f4::stm32f407::{GPIOB, GPIOC, SPI2, TIM2};

use super::clock::soon;

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

/// The motor's encoder, counted by TIM2: 32 bits, four counts a line. The count
/// is 0 at the start.
#[derive(Debug)]
pub(super) struct Encoder(TIM2);

impl Encoder {
    /// Counts from here on.
    pub(super) fn start(timer: TIM2) -> Self {
        // RM 18.3.12, encoder mode 3: both edges of both channels. The filter
        // takes a level that lasts 8 clocks (RM 18.4.7): 95 ns at 84 MHz, a
        // thirtieth of a count at the motor's full speed.
        timer.ccmr1_input().write(|w| {
            w.cc1s().ti1().ic1f().fck_int_n8();
            w.cc2s().ti2().ic2f().fck_int_n8()
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

/// Polls for a byte: above 30 µs at 168 MHz, where a byte takes 1.5 µs.
const TRIES: u32 = 1_000;

/// The bus to the converter.
#[derive(Debug)]
pub(super) struct Bus {
    spi: SPI2,
    port: GPIOB,
}

/// A byte did not come to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TimedOut;

impl Error for TimedOut {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl Bus {
    /// SPI mode 1, 8 bits, most significant bit first, at an eighth of APB1:
    /// 5.25 MHz; the converter takes 50 MHz.
    pub(super) fn start(spi: SPI2, port: GPIOB) -> Self {
        // RM 28.5.1. With SSM and SSI the chip is the only master.
        spi.cr1().write(|w| {
            w.cpol().idle_low().cpha().second_edge();
            w.mstr().master().br().div8();
            w.ssm().enabled().ssi().slave_not_selected();
            w.spe().enabled()
        });
        Self { spi, port }
    }

    /// Takes away what a transfer that timed out has left behind: its byte may
    /// come later, and every answer after it would be taken for the next one's.
    ///
    /// The part is busy as long as one is under way or waits to be sent (RM
    /// 28.3.7); it goes out while nothing is selected, and no chip takes it.
    /// Reading the data takes the byte away, the status behind it an overrun (RM
    /// 28.3.10).
    fn drain(&self) -> Result<(), TimedOut> {
        let spi = &self.spi;
        if !soon(TRIES, || !spi.sr().read().bsy().is_busy()) {
            return Err(TimedOut);
        }
        let _ = spi.dr().read();
        let _ = spi.sr().read();
        Ok(())
    }

    /// Exchanges a byte (RM 28.3.5).
    fn exchange(&self, byte: u8) -> Result<u8, TimedOut> {
        let spi = &self.spi;
        if !soon(TRIES, || spi.sr().read().txe().is_empty()) {
            return Err(TimedOut);
        }
        spi.dr().write(|w| w.dr().set(u16::from(byte)));
        if !soon(TRIES, || spi.sr().read().rxne().is_not_empty()) {
            return Err(TimedOut);
        }
        let [low, _] = spi.dr().read().dr().bits().to_le_bytes();
        Ok(low)
    }

    fn run(&self, operation: &mut Operation<'_, u8>) -> Result<(), TimedOut> {
        match operation {
            Operation::Read(bytes) => {
                for byte in bytes.iter_mut() {
                    *byte = self.exchange(0)?;
                }
            }
            Operation::Write(bytes) => {
                for byte in bytes.iter() {
                    self.exchange(*byte)?;
                }
            }
            Operation::Transfer(read, write) => {
                let length = read.len().max(write.len());
                for at in 0..length {
                    let answer = self.exchange(write.get(at).copied().unwrap_or(0))?;
                    if let Some(byte) = read.get_mut(at) {
                        *byte = answer;
                    }
                }
            }
            Operation::TransferInPlace(bytes) => {
                for byte in bytes.iter_mut() {
                    *byte = self.exchange(*byte)?;
                }
            }
            // A cycle is 5.95 ns at the most cycles a second.
            Operation::DelayNs(ns) => cortex_m::asm::delay(*ns / 5),
        }
        Ok(())
    }
}

impl ErrorType for Bus {
    type Error = TimedOut;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), TimedOut> {
        self.drain()?;
        self.port.bsrr().write(|w| w.br12().reset());
        let done = operations
            .iter_mut()
            .try_for_each(|operation| self.run(operation));
        let idle = soon(TRIES, || !self.spi.sr().read().bsy().is_busy());
        self.port.bsrr().write(|w| w.bs12().set_());
        if idle { done } else { Err(TimedOut) }
    }
}
