//! The electronics of the simulated axis: a plain one in memory, or the
//! firmware's own drivers over models of their chips.

use firmware::{Board, counts};

use super::setup::setting;
use crate::case::Case;
use crate::io::{Part, SpiIo};
use crate::options::Feedback;
use crate::quantise::QuantiseError;

/// How the controller reaches encoder and converter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum IoKind {
    /// Registers and codes as numbers.
    #[default]
    Direct,
    /// SPI frames to an LS7366R and an AD57x1R, bit by bit.
    Spi,
}

/// What the world shows to the board at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shown {
    /// Position of the motor \[counts\].
    pub motor_counts: i64,
    /// Register of the load's encoder, where there is one.
    pub load_register: Option<u32>,
    /// Whether the emergency stop is asserted.
    pub emergency_stop: bool,
    /// Whether the transfer of the motor's register fails.
    pub bus_fails: bool,
}

/// The board of a run.
#[derive(Debug, Clone)]
pub struct BenchBoard {
    shown: Shown,
    counter_bits: u32,
    /// As wide as the motor's where it closes the loop.
    load_bits: u32,
    electronics: Electronics,
}

#[derive(Debug, Clone)]
enum Electronics {
    Memory { code: i32, powered: bool },
    Spi { io: Box<SpiIo>, samples: u64 },
}

impl BenchBoard {
    /// The electronics of `case`.
    ///
    /// # Errors
    /// [`QuantiseError`] if the converter has no such range.
    pub fn new(case: &Case, io: IoKind) -> Result<Self, QuantiseError> {
        let counter_bits = case.options.encoders.counter_bits;
        let electronics = match io {
            IoKind::Direct => Electronics::Memory {
                code: 0,
                powered: false,
            },
            IoKind::Spi => Electronics::Spi {
                io: SpiIo::new(case.dac.bits, counter_bits)
                    .map(Box::new)
                    .map_err(|error| match error.key() {
                        Some((key, value)) => setting(key, f64::from(value), &error),
                        None => QuantiseError::Io(error.to_string()),
                    })?,
                samples: 0,
            },
        };
        Ok(Self {
            shown: Shown::default(),
            counter_bits,
            load_bits: match case.options.law.feedback {
                Feedback::Dual => counter_bits,
                Feedback::Motor => u32::BITS,
            },
            electronics,
        })
    }

    /// The world at the next sample.
    pub fn set_inputs(&mut self, shown: Shown) {
        self.shown = shown;
        if let Electronics::Spi { io, samples } = &mut self.electronics {
            if shown.bus_fails {
                io.fail(Part::Counter, *samples..*samples + 1);
            }
            io.set_emergency_stop(shown.emergency_stop);
            io.start_tick(shown.motor_counts);
            *samples += 1;
        }
    }

    /// The motor's count, for a controller without supervision: nothing fails
    /// here, for nothing can be injected without it.
    pub fn count(&mut self, motor_counts: i64) -> i32 {
        self.set_inputs(Shown {
            motor_counts,
            ..Shown::default()
        });
        self.motor_register().map_or(0, u32::cast_signed)
    }

    /// Hands over a code with the power on; the code that is then in force.
    pub fn drive(&mut self, code: i32) -> i32 {
        let set = self.set_code(code).and_then(|()| self.set_power(true));
        // A converter that refuses a code leaves the amplifier without one.
        set.map_or(0, |()| self.code_in_force())
    }

    /// The code that the amplifier gets: 0 while its power is off.
    pub(super) fn code_in_force(&self) -> i32 {
        let (code, powered) = match &self.electronics {
            Electronics::Memory { code, powered } => (*code, *powered),
            Electronics::Spi { io, .. } => (io.code(), io.powered()),
        };
        if powered { code } else { 0 }
    }
}

/// A transfer that failed.
#[derive(Debug)]
pub struct TransferFailed;

impl Board for BenchBoard {
    type Error = TransferFailed;

    fn motor_register(&mut self) -> Result<u32, TransferFailed> {
        match &mut self.electronics {
            Electronics::Memory { .. } if self.shown.bus_fails => Err(TransferFailed),
            Electronics::Memory { .. } => {
                let register = counts::wrap(self.shown.motor_counts).cast_unsigned();
                // A counter of n bits shows n bits.
                Ok(register & (u32::MAX >> (u32::BITS - self.counter_bits)))
            }
            Electronics::Spi { io, .. } => io.board().motor_register().map_err(|_| TransferFailed),
        }
    }

    fn set_code(&mut self, new: i32) -> Result<(), TransferFailed> {
        match &mut self.electronics {
            Electronics::Memory { code, .. } => {
                *code = new;
                Ok(())
            }
            Electronics::Spi { io, .. } => io.board().set_code(new).map_err(|_| TransferFailed),
        }
    }

    fn set_power(&mut self, on: bool) -> Result<(), TransferFailed> {
        match &mut self.electronics {
            Electronics::Memory { powered, .. } => {
                *powered = on;
                Ok(())
            }
            Electronics::Spi { io, .. } => io.board().set_power(on).map_err(|_| TransferFailed),
        }
    }

    fn emergency_stop(&mut self) -> Result<bool, TransferFailed> {
        match &mut self.electronics {
            Electronics::Memory { .. } => Ok(self.shown.emergency_stop),
            Electronics::Spi { io, .. } => io.board().emergency_stop().map_err(|_| TransferFailed),
        }
    }

    fn load_register(&mut self) -> Result<Option<u32>, TransferFailed> {
        let mask = u32::MAX >> (u32::BITS - self.load_bits);
        Ok(self.shown.load_register.map(|register| register & mask))
    }
}
