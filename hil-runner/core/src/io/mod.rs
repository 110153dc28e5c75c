//! The firmware's own drivers over bit-true models of their chips.
//!
//! ```text
//!  position [counts] ──► LS7366R ──┐                ┌──► AD57x1R ──► code
//!                                  ├─ SPI, drivers ─┤
//!  emergency stop ────► line ──────┘   (firmware)   └──► line ─────► power
//! ```
//!
//! [`SpiIo`] wires it up: the controller has its [`Board`] on
//! one side, the plant its position and code on the other, and every bit in
//! between goes through the drivers that a product would run.
//!
//! | file | thing |
//! | --- | --- |
//! | `ls7366r_chip.rs` | the counter |
//! | `ad57x1r_chip.rs` | the converter |
//! | `bus.rs` | SPI and lines, with faults |

mod ad57x1r_chip;
mod bus;
mod ls7366r_chip;

use std::ops::Range;

use embedded_hal::digital::PinState;
use firmware::Board;
use firmware::hardware::{Ad57x1r, Ad57x1rModel, CounterWidth, Line, Ls7366r, SpiBoard};

use crate::case::Case;
use crate::quantise::QuantiseError;

pub use ad57x1r_chip::{Ad57x1rChip, DacOutput};
pub use bus::{BusFault, ModelBus, ModelBusError, ModelPin, ModelPinError, SpiChip, Spoiling};
pub use ls7366r_chip::Ls7366rChip;

/// The way of the controller to encoder and converter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum IoKind {
    /// Registers and codes as numbers.
    #[default]
    Direct,
    /// SPI frames to an LS7366R and an AD57x1R, bit by bit.
    Spi,
}

impl IoKind {
    /// The chips of a case with their drivers; `None` where there are none.
    ///
    /// # Errors
    /// [`QuantiseError`] if no such chip is to be had.
    pub fn chips(self, case: &Case) -> Result<Option<Box<SpiIo>>, QuantiseError> {
        if self == Self::Direct {
            return Ok(None);
        }
        let counter_bits = case.options.encoders.counter_bits;
        Ok(Some(Box::new(SpiIo::new(case.dac.bits, counter_bits)?)))
    }
}

/// The firmware's board over the model chips.
pub type ModelBoard = SpiBoard<ModelBus<Ls7366rChip>, ModelBus<Ad57x1rChip>, ModelPin, ModelPin>;

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
    /// [`QuantiseError`] for other numbers of bits, or if the drivers do not take
    /// the chips.
    pub fn new(dac_bits: u32, counter_bits: u32) -> Result<Self, QuantiseError> {
        let no_part = |key, bits: u32, part: &str, must: &str| {
            let because = format!("there is no {part} of {bits} bits on SPI; {must}");
            QuantiseError::setting(key, f64::from(bits), because)
        };
        let mut models = [Ad57x1rModel::Ad5721r, Ad57x1rModel::Ad5761r].into_iter();
        let model = models.find(|model| model.bits() == dac_bits);
        let must = "it must have 12 bits (AD5721R) or 16 bits (AD5761R)";
        let model = model.ok_or_else(|| no_part("drive.dac_bits", dac_bits, "converter", must))?;
        let mut widths = [CounterWidth::Bits16, CounterWidth::Bits32].into_iter();
        let width = widths.find(|width| width.bits() == counter_bits);
        let (key, must) = (
            "encoder.counter_bits",
            "the LS7366R must be used with 16 or 32 bits",
        );
        let width = width.ok_or_else(|| no_part(key, counter_bits, "counter", must))?;

        let line = || Line {
            pin: ModelPin::default(),
            active: PinState::High,
        };
        let mut board = SpiBoard {
            counter: Ls7366r::new(ModelBus::new(Ls7366rChip::new(0)), width),
            converter: Ad57x1r::new(ModelBus::new(Ad57x1rChip::new(model)), model),
            enable: line(),
            // A closed loop to ground against a pull-up: high when open.
            stop: line(),
        };
        let initialised = board.initialise();
        initialised.map_err(|error| QuantiseError::Bench(error.to_string()))?;
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
        self.board.counter.spi.chip.move_to(position_counts);

        let due = self.fault.iter().find(|(_, ticks)| ticks.contains(&tick));
        let fails = |part| due.is_some_and(|(failing, _)| *failing == part);
        let bus_fault = |part| {
            fails(part).then_some(BusFault {
                transactions: 0..u64::MAX,
                spoiling: Spoiling::Error,
            })
        };
        let board = &mut self.board;
        board.counter.spi.set_fault(bus_fault(Part::Counter));
        board.converter.spi.set_fault(bus_fault(Part::Converter));
        board.enable.pin.broken = fails(Part::Enable);
        board.stop.pin.broken = fails(Part::EmergencyStop);
    }

    /// Lets every access to `part` fail in these ticks, in place of the fault
    /// set before.
    pub fn fail(&mut self, part: Part, ticks: Range<u64>) {
        self.fault = Some((part, ticks));
    }

    /// The same in the next tick.
    pub fn fail_next(&mut self, part: Part) {
        self.fail(part, self.next_tick..self.next_tick + 1);
    }

    /// The register at an encoder's position \[counts\] in the next tick, for a
    /// controller without supervision: nothing can be injected without it.
    pub fn read(&mut self, position_counts: i64) -> i32 {
        self.start_tick(position_counts);
        let register = self.board.motor_register();
        register.map_or(0, u32::cast_signed)
    }

    /// Hands over a code with the power on; the code that is then in force. A
    /// converter that refuses a code leaves the amplifier without one.
    pub fn drive(&mut self, code: i32) -> i32 {
        let set = self.board.set_code(code);
        let set = set.and_then(|()| self.board.set_power(true));
        set.map_or(0, |()| self.code_in_force())
    }

    /// The code that the amplifier gets: 0 while its power is off.
    pub fn code_in_force(&self) -> i32 {
        if self.powered() { self.code() } else { 0 }
    }

    /// Opens the stop loop, or closes it.
    pub fn set_emergency_stop(&mut self, asserted: bool) {
        self.board.stop.pin.high = asserted;
    }

    /// The code at the converter's output; 0 while it is clamped to ground.
    pub fn code(&self) -> i32 {
        match self.board.converter.spi.chip.output() {
            DacOutput::Clamped => 0,
            DacOutput::Code(code) => code,
        }
    }

    /// True while the power stage is on.
    pub fn powered(&self) -> bool {
        self.board.enable.pin.high
    }
}
