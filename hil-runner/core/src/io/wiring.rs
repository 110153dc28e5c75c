//! The board with its chips, and the handles of the world around it.

use std::fmt;
use std::ops::Range;

use embedded_hal::digital::PinState;
use firmware::hardware::{
    Ad57x1r, Ad57x1rModel, CounterWidth, Line, Ls7366r, SpiBoard, SpiBoardError,
};

use super::{
    Ad57x1rChip, BusFault, DacOutput, Ls7366rChip, ModelBus, ModelBusError, ModelPin,
    ModelPinError, Spoiling,
};

/// The firmware's board over the model chips.
pub type ModelBoard = SpiBoard<ModelBus<Ls7366rChip>, ModelBus<Ad57x1rChip>, ModelPin, ModelPin>;

type ModelBoardError = SpiBoardError<ModelBusError, ModelBusError, ModelPinError, ModelPinError>;

/// A part that can be made to fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The bus of the counter.
    Counter,
    /// The bus of the converter.
    Converter,
    /// The power stage's enable line.
    Enable,
    /// The emergency stop's line.
    EmergencyStop,
}

/// The electronics of one axis in the simulation.
///
/// ```
/// use firmware::Board;
/// use hil_core::io::{Part, SpiIo};
///
/// let mut io = SpiIo::new(12, 16)?;
/// io.fail(Part::Counter, 1..2);
///
/// io.start_tick(70_000);
/// assert_eq!(io.board().motor_register()?, 70_000 - 65_536);
/// io.board().set_code(-2_048)?;
/// assert_eq!(io.code(), -2_048);
///
/// io.start_tick(70_001);
/// assert!(io.board().motor_register().is_err());
/// io.board().switch_off()?;
/// assert_eq!((io.code(), io.powered()), (0, false));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct SpiIo {
    board: ModelBoard,
    next_tick: u64,
    fault: Option<(Part, Range<u64>)>,
}

impl SpiIo {
    /// A board with a converter of 12 or 16 bits and a counter of 16 or 32,
    /// initialised at position 0: power off, code 0.
    ///
    /// # Errors
    /// [`SpiIoError`] for other numbers of bits, or if the drivers do not take
    /// the chips.
    pub fn new(dac_bits: u32, counter_bits: u32) -> Result<Self, SpiIoError> {
        let model = [Ad57x1rModel::Ad5721r, Ad57x1rModel::Ad5761r]
            .into_iter()
            .find(|model| model.bits() == dac_bits)
            .ok_or(SpiIoError::DacBits(dac_bits))?;
        let width = [CounterWidth::Bits16, CounterWidth::Bits32]
            .into_iter()
            .find(|width| width.bits() == counter_bits)
            .ok_or(SpiIoError::CounterBits(counter_bits))?;

        let mut board = SpiBoard {
            counter: Ls7366r::new(ModelBus::new(Ls7366rChip::new(0)), width),
            converter: Ad57x1r::new(ModelBus::new(Ad57x1rChip::new(model)), model),
            enable: Line {
                pin: ModelPin::default(),
                active: PinState::High,
            },
            // A closed loop to ground against a pull-up: high when open.
            stop: Line {
                pin: ModelPin::default(),
                active: PinState::High,
            },
        };
        board.initialise().map_err(SpiIoError::Board)?;
        Ok(Self {
            board,
            next_tick: 0,
            fault: None,
        })
    }

    /// The controller's side.
    pub fn board(&mut self) -> &mut ModelBoard {
        &mut self.board
    }

    /// Begins the next tick, from 0, at the encoder's position \[counts\]. The
    /// part that is due fails from here on, all others are whole again; a
    /// [`BusFault`] of one's own is set behind this.
    pub fn start_tick(&mut self, position_counts: i64) {
        let tick = self.next_tick;
        self.next_tick += 1;
        self.board.counter.spi_mut().chip.move_to(position_counts);

        let fails = |part| {
            let fault = self.fault.as_ref();
            fault.is_some_and(|(failing, ticks)| *failing == part && ticks.contains(&tick))
        };
        let bus_fault = |part| {
            fails(part).then_some(BusFault {
                transactions: 0..u64::MAX,
                spoiling: Spoiling::Error,
            })
        };
        let board = &mut self.board;
        board.counter.spi_mut().set_fault(bus_fault(Part::Counter));
        board
            .converter
            .spi_mut()
            .set_fault(bus_fault(Part::Converter));
        board.enable.pin.broken = fails(Part::Enable);
        board.stop.pin.broken = fails(Part::EmergencyStop);
    }

    /// Lets every access to `part` fail in these ticks, in place of the fault
    /// set before.
    pub fn fail(&mut self, part: Part, ticks: Range<u64>) {
        self.fault = Some((part, ticks));
    }

    /// Opens the stop loop, or closes it.
    pub fn set_emergency_stop(&mut self, asserted: bool) {
        self.board.stop.pin.high = asserted;
    }

    /// The code at the converter's output; 0 while it is clamped to ground.
    pub fn code(&self) -> i32 {
        match self.board.converter.spi().chip.output() {
            DacOutput::Clamped => 0,
            DacOutput::Code(code) => code,
        }
    }

    /// Whether the power stage is on.
    pub fn powered(&self) -> bool {
        self.board.enable.pin.high
    }
}

/// Why there is no such board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SpiIoError {
    /// No converter with this number of bits.
    DacBits(u32),
    /// No counter with this number of bits.
    CounterBits(u32),
    /// A driver did not take its chip.
    Board(ModelBoardError),
}

impl SpiIoError {
    /// The run file's key and value that are to blame, if they are.
    pub fn key(&self) -> Option<(&'static str, u32)> {
        match self {
            Self::DacBits(bits) => Some(("drive.dac_bits", *bits)),
            Self::CounterBits(bits) => Some(("encoder.counter_bits", *bits)),
            Self::Board(_) => None,
        }
    }
}

impl fmt::Display for SpiIoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DacBits(bits) => write!(
                f,
                "there is no converter of {bits} bits on SPI; \
                 it must have 12 bits (AD5721R) or 16 bits (AD5761R)"
            ),
            Self::CounterBits(bits) => write!(
                f,
                "there is no counter of {bits} bits on SPI; \
                 the LS7366R must be used with 16 or 32 bits"
            ),
            Self::Board(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SpiIoError {}
