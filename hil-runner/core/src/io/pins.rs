//! The two lines of the board: power stage and emergency stop.

use std::fmt;

use embedded_hal::digital::{Error, ErrorKind, ErrorType, InputPin, OutputPin};

/// A line that can be made to fail; as an output or an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ModelPin {
    /// The level.
    pub high: bool,
    /// Whether every access fails.
    pub broken: bool,
}

impl ErrorType for ModelPin {
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelPinError;

impl Error for ModelPinError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl fmt::Display for ModelPinError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the line is broken")
    }
}

impl std::error::Error for ModelPinError {}
