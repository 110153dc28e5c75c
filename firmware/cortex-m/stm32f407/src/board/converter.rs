//! SPI2 with one device, the converter, selected by PB12.

use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use stm32f4::stm32f407::{GPIOB, SPI2};

use super::soon;

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
            w.mstr()
                .master()
                .br()
                .div8()
                .ssm()
                .enabled()
                .ssi()
                .slave_not_selected();
            w.spe().enabled()
        });
        Self { spi, port }
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
        self.port.bsrr().write(|w| w.br12().reset());
        let done = operations
            .iter_mut()
            .try_for_each(|operation| self.run(operation));
        let idle = soon(TRIES, || !self.spi.sr().read().bsy().is_busy());
        self.port.bsrr().write(|w| w.bs12().set_());
        if idle { done } else { Err(TimedOut) }
    }
}
