//! A board made of the two drivers and two lines.
//!
//! ```text
//!  LS7366R ── SPI ──┐                      ┌── SPI ── AD57x1R ── ±10 V ──► amplifier
//!                   ├── SpiBoard: Board ───┤
//!  stop loop ── in ─┘                      └── out ── enable ────────────► amplifier
//! ```
//!
//! The two chips sit on one bus or on two, in different SPI modes: the
//! `SpiDevice` of each sees to that.
//!
//! # The two lines
//!
//! A [`Line`] is a pin and the level at which what it stands for is true. The
//! emergency stop is a loop through normally closed contacts, and its level is
//! that of the *open* loop: a loop to ground with a pull-up resistor is low
//! while closed, so the stop is asserted at [`PinState::High`]; a loop to the
//! supply with a pull-down resistor is asserted at [`PinState::Low`]. Either
//! way a broken wire is an emergency stop.

use embedded_hal::digital::{InputPin, OutputPin, PinState};
use embedded_hal::spi::SpiDevice;
use thiserror::Error;

use super::Board;
use super::ad57x1r::{Ad57x1r, Ad57x1rError};
use super::ls7366r::{Ls7366r, Ls7366rError};

/// A pin with its polarity.
#[derive(Debug, Clone)]
pub struct Line<Pin> {
    /// The pin.
    pub pin: Pin,
    /// The level at which the power is on, or the stop asserted.
    pub active: PinState,
}

/// An LS7366R, an AD57x1R, an enable output and a stop input.
///
/// Made of its parts; [`SpiBoard::initialise`] goes before the first tick. If
/// it is forgotten, the converter stays clamped to ground, and the counter's
/// first reading and the first code are errors.
#[derive(Debug, Clone)]
pub struct SpiBoard<Counter, Converter, EnablePin, StopPin> {
    /// The motor's encoder.
    pub counter: Ls7366r<Counter>,
    /// The amplifier's command voltage.
    pub converter: Ad57x1r<Converter>,
    /// The power stage: active is on.
    pub enable: Line<EnablePin>,
    /// The emergency stop: active is asserted, the loop open.
    pub stop: Line<StopPin>,
}

impl<Counter, Converter, EnablePin, StopPin> SpiBoard<Counter, Converter, EnablePin, StopPin>
where
    Counter: SpiDevice,
    Converter: SpiDevice,
    EnablePin: OutputPin,
    StopPin: InputPin,
{
    /// Switches the power stage off, then brings up converter and counter, in
    /// this order. The count is then 0. May be called again at standstill.
    ///
    /// # Errors
    /// That of the first part that fails; the power stage is then off, unless
    /// it is [`SpiBoardError::Enable`] itself.
    pub fn initialise(&mut self) -> Result<(), <Self as Board>::Error> {
        self.set_power(false)?;
        self.converter
            .initialise()
            .map_err(SpiBoardError::Converter)?;
        self.counter.initialise().map_err(SpiBoardError::Counter)
    }
}

impl<Counter, Converter, EnablePin, StopPin> Board
    for SpiBoard<Counter, Converter, EnablePin, StopPin>
where
    Counter: SpiDevice,
    Converter: SpiDevice,
    EnablePin: OutputPin,
    StopPin: InputPin,
{
    type Error = SpiBoardError<Counter::Error, Converter::Error, EnablePin::Error, StopPin::Error>;

    fn motor_register(&mut self) -> Result<u32, Self::Error> {
        self.counter.count().map_err(SpiBoardError::Counter)
    }

    fn set_code(&mut self, code: i32) -> Result<(), Self::Error> {
        let written = self.converter.set_code(code);
        written.map_err(SpiBoardError::Converter)
    }

    fn set_power(&mut self, on: bool) -> Result<(), Self::Error> {
        let Line { pin, active } = &mut self.enable;
        let level = if on { *active } else { !*active };
        pin.set_state(level).map_err(SpiBoardError::Enable)
    }

    fn emergency_stop(&mut self) -> Result<bool, Self::Error> {
        let Line { pin, active } = &mut self.stop;
        let asserted = match active {
            PinState::High => pin.is_high(),
            PinState::Low => pin.is_low(),
        };
        asserted.map_err(SpiBoardError::EmergencyStop)
    }
}

/// Part that failed, with its own error. The caller switches off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SpiBoardError<Counter, Converter, EnablePin, StopPin> {
    /// The encoder's counter.
    #[error("{0}")]
    Counter(Ls7366rError<Counter>),
    /// The D/A converter.
    #[error("{0}")]
    Converter(Ad57x1rError<Converter>),
    /// The power stage's enable line.
    #[error("the enable line could not be set: {0:?}")]
    Enable(EnablePin),
    /// The emergency stop's line.
    #[error("the emergency stop could not be read: {0:?}")]
    EmergencyStop(StopPin),
}
