//! The electronics of the axis through `embedded-hal` 1.0.
//!
//! ```text
//!  your loop, once per sample                     the board
//!  ─────────────────────────        Board         ─────────────────────────
//!  inputs   ◄── emergency_stop, motor_register ── stop loop, LS7366R counter
//!  one tick of the controller
//!  outputs  ──► set_code, set_power ────────────► AD57x1R converter, enable
//! ```
//!
//! [`Board`] is all that a controller needs to know of its electronics. A board
//! of your own implements it: four methods, no registration, no macro. For
//! boards made of an LS7366R quadrature counter ([`ls7366r`]) and an AD5721R or
//! AD5761R converter ([`ad57x1r`]) it is implemented already: [`SpiBoard`].
//!
//! # Order in a tick
//!
//! 1. [`Board::emergency_stop`], then [`Board::motor_register`] and, where there
//!    is one, [`Board::load_register`]: all inputs, before anything is computed.
//! 2. The controller's tick.
//! 3. [`Board::set_code`], then [`Board::set_power`] if the power stage is to
//!    change. Switching on goes behind a code of 0; switching off goes through
//!    [`Board::switch_off`], which takes the power away first.
//!
//! # Errors
//!
//! Every method can fail, because on most boards a bus is in between. An error
//! is never "the value of the last tick": the caller reports a hardware fault
//! and calls [`Board::switch_off`] in the same tick, whichever method it was.
//! An emergency stop that cannot be read counts as asserted by that rule. The
//! board does not repeat anything on its own: a repeated transfer would make a
//! late sample out of a visible fault.
//!
//! A code that fails may have left the converter where it was, or have reached
//! one that reports a fault of its own, so the power has to go in the same tick;
//! the next tick may try again.

pub mod ad57x1r;
pub mod ls7366r;
pub mod spi_board;

pub use ad57x1r::{Ad57x1r, Ad57x1rError, Ad57x1rModel};
pub use ls7366r::{CounterWidth, Ls7366r, Ls7366rError, Ls7366rStatus};
pub use spi_board::{Line, SpiBoard, SpiBoardError};

use crate::axis::{AxisOutput, AxisState, Inputs};
use crate::reference::SetpointSource;

/// The electronics of one axis.
///
/// A board in memory, and one tick of a caller:
///
/// ```
/// use firmware::Board;
///
/// #[derive(Default)]
/// struct Memory {
///     register: u32,
///     code: i32,
///     powered: bool,
/// }
///
/// impl Board for Memory {
///     type Error = core::convert::Infallible;
///
///     fn motor_register(&mut self) -> Result<u32, Self::Error> {
///         Ok(self.register)
///     }
///     fn set_code(&mut self, code: i32) -> Result<(), Self::Error> {
///         self.code = code;
///         Ok(())
///     }
///     fn set_power(&mut self, on: bool) -> Result<(), Self::Error> {
///         self.powered = on;
///         Ok(())
///     }
///     fn emergency_stop(&mut self) -> Result<bool, Self::Error> {
///         Ok(false)
///     }
/// }
///
/// let mut board = Memory { register: 41, ..Memory::default() };
/// board.set_power(true)?;
/// if !board.emergency_stop()? {
///     let code = if board.motor_register()? < 50 { 7 } else { 0 };
///     board.set_code(code)?;
/// }
/// assert_eq!((board.code, board.powered), (7, true));
/// board.switch_off()?;
/// assert_eq!((board.code, board.powered), (0, false));
/// # Ok::<(), core::convert::Infallible>(())
/// ```
pub trait Board {
    /// Error of a failed access. The caller only reports it.
    type Error: core::fmt::Debug;

    /// The register of the motor's encoder \[counts\], as wide as the counter
    /// is: a counter of 16 bits gives 0 to 65 535 and wraps there. The bits
    /// above its width are zero.
    ///
    /// # Errors
    /// The register could not be read, or not be trusted.
    fn motor_register(&mut self) -> Result<u32, Self::Error>;

    /// Hands a code to the converter, −2^(n−1) to 2^(n−1)−1 for its `n` bits;
    /// 0 is 0 V. The output changes before this returns.
    ///
    /// # Errors
    /// The code could not be written, is not one of the converter's, or what
    /// stands at the output is not to be trusted.
    fn set_code(&mut self, code: i32) -> Result<(), Self::Error>;

    /// Switches the power stage on or off.
    ///
    /// # Errors
    /// The line could not be set.
    fn set_power(&mut self, on: bool) -> Result<(), Self::Error>;

    /// Tells whether the emergency stop is asserted.
    ///
    /// # Errors
    /// The line could not be read.
    fn emergency_stop(&mut self) -> Result<bool, Self::Error>;

    /// The register of a second encoder at the load \[counts\], read like
    /// [`Board::motor_register`]; `None` on a board without one.
    ///
    /// # Errors
    /// There is one and it could not be read, or not be trusted.
    fn load_register(&mut self) -> Result<Option<u32>, Self::Error> {
        Ok(None)
    }

    /// Takes the power away and then sets the code to 0. Both are tried,
    /// whatever comes of the first.
    ///
    /// # Errors
    /// The first of the two. The axis is then to be stopped by other means.
    fn switch_off(&mut self) -> Result<(), Self::Error> {
        let power = self.set_power(false);
        let code = self.set_code(0);
        power.and(code)
    }
}

/// Runs the sample number `tick`: reads the board, runs the axis, and sets
/// the board's outputs. A transfer that fails is a fault of this very sample:
/// the power is off and the code 0 when this returns, as far as the board
/// still obeys.
///
/// ```
/// use firmware::axis::{Axis, AxisState};
/// use firmware::hardware::{Board, serve};
/// use firmware::law::{Law, LawWords};
/// use firmware::output::{Output, Quantiser};
/// use firmware::reference::TableSource;
/// use firmware::{Dac, Event, GainWord, SetpointTable};
///
/// #[derive(Default)]
/// struct Memory { register: u32, code: i32, powered: bool }
///
/// impl Board for Memory {
///     type Error = core::convert::Infallible;
///     fn motor_register(&mut self) -> Result<u32, Self::Error> { Ok(self.register) }
///     fn set_code(&mut self, code: i32) -> Result<(), Self::Error> { self.code = code; Ok(()) }
///     fn set_power(&mut self, on: bool) -> Result<(), Self::Error> { self.powered = on; Ok(()) }
///     fn emergency_stop(&mut self) -> Result<bool, Self::Error> { Ok(false) }
/// }
///
/// let dac = Dac::with_bits(12)?;
/// let words = LawWords { kp: GainWord::new(1 << 30, 29), ..LawWords::NONE };
/// let axis = Axis::new(Law::accept(words, dac)?, Output::new(dac, None, Quantiser::Nearest)?);
/// let table = SetpointTable::<16>::from_counts(&[0, 100])?;
/// let mut source = TableSource::new(&table);
///
/// let mut state = AxisState::start(&axis);
/// state.request(Event::Enable)?;
/// state.request(Event::Start)?;
/// let mut board = Memory::default();
/// for tick in 0..2 {
///     serve(&mut state, &mut board, &mut source, tick);
/// }
/// // Kp·e = 2·100 codes
/// assert_eq!((board.code, board.powered), (200, true));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn serve<B: Board>(
    state: &mut AxisState,
    board: &mut B,
    source: &mut impl SetpointSource,
    tick: u64,
) -> AxisOutput {
    let mut failed_transfers = 0_u32;
    let mut count_failure = || failed_transfers = failed_transfers.saturating_add(1);

    // 1. All inputs, before anything is computed.
    let (last_motor, last_load) = state.last_registers();
    let emergency_stop = board.emergency_stop().unwrap_or_else(|_| {
        count_failure();
        false
    });
    let motor_register = board.motor_register().unwrap_or_else(|_| {
        count_failure();
        last_motor
    });
    let load_register = board.load_register().unwrap_or_else(|_| {
        count_failure();
        last_load
    });
    let inputs = Inputs {
        tick,
        motor_register,
        load_register,
        emergency_stop,
        failed_transfers,
    };

    // 2. The controller's tick.
    let output = state.tick(&inputs, source);

    // 3. Outputs: the code first, then the power; off the other way round.
    let set = if output.power {
        let code = board.set_code(output.code);
        code.and_then(|()| board.set_power(true))
    } else {
        board.switch_off()
    };
    match set {
        Ok(()) => output,
        Err(_) => {
            // The fault is latched whether or not the board obeys now; the
            // next sample switches off again.
            let _ = board.switch_off();
            state.output_failed(tick, 1)
        }
    }
}
