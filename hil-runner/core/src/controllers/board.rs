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
    code: i32,
    powered: bool,
    /// The chips, unless all of it is in memory.
    chips: Option<Box<SpiIo>>,
}

impl BenchBoard {
    /// The electronics of `case`.
    ///
    /// # Errors
    /// [`QuantiseError`] if the converter has no such range.
    pub(super) fn new(case: &Case, io: IoKind) -> Result<Self, QuantiseError> {
        Ok(Self {
            shown: Shown::default(),
            code: 0,
            powered: false,
            chips: io.chips(case)?,
        })
    }

    /// The world at the next sample.
    pub(super) fn set_inputs(&mut self, shown: Shown) {
        self.shown = shown;
        if let Some(io) = &mut self.chips {
            if shown.bus_fails {
                io.fail_next(Part::Counter);
            }
            io.set_emergency_stop(shown.emergency_stop);
            io.start_tick(shown.motor_counts);
        }
    }

    /// The code that the amplifier gets: 0 while its power is off.
    pub(super) fn code_in_force(&self) -> i32 {
        match &self.chips {
            None => i32::from(self.powered) * self.code,
            Some(io) => io.code_in_force(),
        }
    }
}

/// A transfer that failed.
#[derive(Debug)]
pub(super) struct TransferFailed;

impl Board for BenchBoard {
    type Error = TransferFailed;

    fn motor_register(&mut self) -> Result<u32, TransferFailed> {
        match &mut self.chips {
            None if self.shown.bus_fails => Err(TransferFailed),
            None => Ok(self.shown.motor_register),
            Some(io) => io.board().motor_register().map_err(|_| TransferFailed),
        }
    }

    fn set_code(&mut self, code: i32) -> Result<(), TransferFailed> {
        self.code = code;
        match &mut self.chips {
            None => Ok(()),
            Some(io) => io.board().set_code(code).map_err(|_| TransferFailed),
        }
    }

    fn set_power(&mut self, on: bool) -> Result<(), TransferFailed> {
        self.powered = on;
        match &mut self.chips {
            None => Ok(()),
            Some(io) => io.board().set_power(on).map_err(|_| TransferFailed),
        }
    }

    fn emergency_stop(&mut self) -> Result<bool, TransferFailed> {
        match &mut self.chips {
            None => Ok(self.shown.emergency_stop),
            Some(io) => io.board().emergency_stop().map_err(|_| TransferFailed),
        }
    }

    fn load_register(&mut self) -> Result<Option<u32>, TransferFailed> {
        Ok(self.shown.load_register)
    }
}
