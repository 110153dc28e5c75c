//! One chip on an SPI bus of its own, and the two lines of the board (power stage,
//! emergency stop), with faults at wish.
//!
//! [`ModelBus`] is the `SpiDevice` that a driver sees. Each transaction selects
//! the chip, moves its bytes one after the other and deselects it; transactions
//! are numbered from 0, and a [`BusFault`] names the ones that it spoils.

use std::ops::Range;

use embedded_hal::digital::{self, InputPin, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};

/// A chip as the bus sees it.
pub trait SpiChip {
    /// The chip select falls.
    fn select(&mut self);

    /// Eight clocks, most significant bit first: takes a byte and gives one.
    fn exchange(&mut self, mosi: u8) -> u8;

    /// The chip select rises.
    fn deselect(&mut self);
}

/// Effect of a fault on a transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spoiling {
    /// The bus master reports an error; nothing reaches the chip.
    Error,
    /// The bits of `mask` are turned over in byte number `byte` on its way to
    /// the chip, and nobody notices.
    Mosi {
        /// Byte in the transaction, from 0.
        byte: usize,
        /// Bits to turn over.
        mask: u8,
    },
    /// The same on its way from the chip.
    Miso {
        /// Byte in the transaction, from 0.
        byte: usize,
        /// Bits to turn over.
        mask: u8,
    },
}

/// A fault on a bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusFault {
    /// The numbers of the transactions that it spoils.
    pub transactions: Range<u64>,
    /// The effect.
    pub spoiling: Spoiling,
}

/// A bus with one chip.
#[derive(Debug, Clone)]
pub struct ModelBus<Chip> {
    /// The chip, for the world on its other side.
    pub chip: Chip,
    next: u64,
    fault: Option<BusFault>,
}

impl<Chip> ModelBus<Chip> {
    /// A bus without faults.
    pub const fn new(chip: Chip) -> Self {
        Self {
            chip,
            next: 0,
            fault: None,
        }
    }

    /// The number of the next transaction: how many there were.
    pub const fn transactions(&self) -> u64 {
        self.next
    }

    /// Sets the fault, in place of the one before; `None` repairs the bus.
    pub fn set_fault(&mut self, fault: Option<BusFault>) {
        self.fault = fault;
    }
}

impl<Chip> spi::ErrorType for ModelBus<Chip> {
    type Error = ModelBusError;
}

impl<Chip: SpiChip> SpiDevice for ModelBus<Chip> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ModelBusError> {
        let transaction = self.next;
        self.next += 1;
        let fault = self.fault.as_ref();
        let spoiling = fault.filter(|fault| fault.transactions.contains(&transaction));
        let spoiling = spoiling.map(|fault| fault.spoiling);
        if spoiling == Some(Spoiling::Error) {
            return Err(ModelBusError { transaction });
        }

        let chip = &mut self.chip;
        chip.select();
        let mut number = 0;
        let mut exchange = |mosi: u8| {
            let (out, back) = match spoiling {
                Some(Spoiling::Mosi { byte, mask }) if byte == number => (mask, 0),
                Some(Spoiling::Miso { byte, mask }) if byte == number => (0, mask),
                _ => (0, 0),
            };
            number += 1;
            chip.exchange(mosi ^ out) ^ back
        };

        for operation in operations {
            match operation {
                Operation::Read(read) => read.iter_mut().for_each(|byte| *byte = exchange(0)),
                Operation::Write(write) => write.iter().for_each(|&byte| {
                    exchange(byte);
                }),
                Operation::Transfer(read, write) => {
                    for index in 0..read.len().max(write.len()) {
                        let miso = exchange(write.get(index).copied().unwrap_or(0));
                        if let Some(byte) = read.get_mut(index) {
                            *byte = miso;
                        }
                    }
                }
                Operation::TransferInPlace(bytes) => {
                    bytes.iter_mut().for_each(|byte| *byte = exchange(*byte));
                }
                // The chips of this bench are faster than any bus.
                Operation::DelayNs(_) => {}
            }
        }
        self.chip.deselect();
        Ok(())
    }
}

/// A transaction that was made to fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("transaction {transaction} on the bus was lost")]
pub struct ModelBusError {
    /// Its number.
    pub transaction: u64,
}

impl spi::Error for ModelBusError {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

/// A line that can be made to fail; as an output or an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ModelPin {
    /// The level.
    pub high: bool,
    /// Every access fails.
    pub broken: bool,
}

impl digital::ErrorType for ModelPin {
    type Error = ModelPinError;
}

impl ModelPin {
    const fn access(&mut self) -> Result<&mut bool, ModelPinError> {
        if self.broken {
            Err(ModelPinError)
        } else {
            Ok(&mut self.high)
        }
    }
}

impl OutputPin for ModelPin {
    fn set_low(&mut self) -> Result<(), ModelPinError> {
        self.access().map(|high| *high = false)
    }

    fn set_high(&mut self) -> Result<(), ModelPinError> {
        self.access().map(|high| *high = true)
    }
}

impl InputPin for ModelPin {
    fn is_high(&mut self) -> Result<bool, ModelPinError> {
        self.access().map(|high| *high)
    }

    fn is_low(&mut self) -> Result<bool, ModelPinError> {
        self.access().map(|high| !*high)
    }
}

/// An access to a line that was made to fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the line is broken")]
pub struct ModelPinError;

impl digital::Error for ModelPinError {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}
