//! One sample of an axis on its electronics: inputs, tick, outputs, in the
//! order that [`crate::hardware::board`] asks for.

use super::Board;
use crate::axis::{Axis, AxisOutput, AxisState, Inputs};
use crate::reference::SetpointSource;

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
/// axis.request(&mut state, Event::Enable)?;
/// axis.request(&mut state, Event::Start)?;
/// let mut board = Memory::default();
/// for tick in 0..2 {
///     serve(&axis, &mut state, &mut board, &mut source, tick);
/// }
/// // Kp·e = 2·100 codes
/// assert_eq!((board.code, board.powered), (200, true));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn serve<B: Board>(
    axis: &Axis,
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
    let output = axis.tick(state, &inputs, source);

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
            axis.output_failed(state, tick, 1)
        }
    }
}
