//! The electronics of the simulated axis: a plain one in memory, or the
//! firmware's own drivers over models of their chips.

use firmware::Board;

use super::world::Shown;
use crate::case::Case;
use crate::io::{IoKind, Part, SpiIo};
use crate::quantise::QuantiseError;

/// The board of a run.
#[derive(Debug, Clone)]
pub(super) struct BenchBoard {
    shown: Shown,
    electronics: Electronics,
}

#[derive(Debug, Clone)]
enum Electronics {
    Memory { code: i32, powered: bool },
    Spi(Box<SpiIo>),
}

impl BenchBoard {
    /// The electronics of `case`.
    ///
    /// # Errors
    /// [`QuantiseError`] if the converter has no such range.
    pub(super) fn new(case: &Case, io: IoKind) -> Result<Self, QuantiseError> {
        let memory = Electronics::Memory {
            code: 0,
            powered: false,
        };
        Ok(Self {
            shown: Shown::default(),
            electronics: io.chips(case)?.map_or(memory, Electronics::Spi),
        })
    }

    /// The world at the next sample.
    pub(super) fn set_inputs(&mut self, shown: Shown) {
        self.shown = shown;
        if let Electronics::Spi(io) = &mut self.electronics {
            if shown.bus_fails {
                io.fail_next(Part::Counter);
            }
            io.set_emergency_stop(shown.emergency_stop);
            io.start_tick(shown.motor_counts);
        }
    }

    /// The code that the amplifier gets: 0 while its power is off.
    pub(super) fn code_in_force(&self) -> i32 {
        match &self.electronics {
            Electronics::Memory { code, powered } => i32::from(*powered) * code,
            Electronics::Spi(io) => io.code_in_force(),
        }
    }
}

/// A transfer that failed.
#[derive(Debug)]
pub(super) struct TransferFailed;

impl Board for BenchBoard {
    type Error = TransferFailed;

    fn motor_register(&mut self) -> Result<u32, TransferFailed> {
        match &mut self.electronics {
            Electronics::Memory { .. } if self.shown.bus_fails => Err(TransferFailed),
            Electronics::Memory { .. } => Ok(self.shown.motor_register),
            Electronics::Spi(io) => io.board().motor_register().map_err(|_| TransferFailed),
        }
    }

    fn set_code(&mut self, new: i32) -> Result<(), TransferFailed> {
        match &mut self.electronics {
            Electronics::Memory { code, .. } => {
                *code = new;
                Ok(())
            }
            Electronics::Spi(io) => io.board().set_code(new).map_err(|_| TransferFailed),
        }
    }

    fn set_power(&mut self, on: bool) -> Result<(), TransferFailed> {
        match &mut self.electronics {
            Electronics::Memory { powered, .. } => {
                *powered = on;
                Ok(())
            }
            Electronics::Spi(io) => io.board().set_power(on).map_err(|_| TransferFailed),
        }
    }

    fn emergency_stop(&mut self) -> Result<bool, TransferFailed> {
        match &mut self.electronics {
            Electronics::Memory { .. } => Ok(self.shown.emergency_stop),
            Electronics::Spi(io) => io.board().emergency_stop().map_err(|_| TransferFailed),
        }
    }

    fn load_register(&mut self) -> Result<Option<u32>, TransferFailed> {
        Ok(self.shown.load_register)
    }
}
