//! One axis: setpoints, control law and converter range, and the order in
//! which a sample runs through them.
//!
//! [`Controller`] holds what does not change during a motion,
//! [`ControllerState`] what does: starting again is `ControllerState::default()`,
//! and one controller can serve several states. The setpoints are part of the
//! controller because the paper keeps them in its memory.

use crate::counts;
use crate::dac::Dac;
use crate::pid::{Pid, PidState};
use crate::reference::SetpointTable;

/// The position controller of one axis with a table of at most `N` setpoints.
///
/// ```
/// use firmware::{Controller, ControllerState, Dac, GainWord, Pid, PidWords, SetpointTable};
///
/// // A proportional controller: Kp = 2 codes per count.
/// let words = PidWords {
///     kp: GainWord::new(1 << 30, 29),
///     ki_dt: GainWord::new(0, 40),
///     kd_per_dt: GainWord::new(0, 32),
///     error_bits: 17,
/// };
/// let controller = Controller::new(
///     Pid::accept(words)?,
///     Dac::with_bits(12)?,
///     SetpointTable::<16>::from_counts(&[0, 100, 5_000])?,
/// );
/// let mut state = ControllerState::default();
/// assert_eq!(controller.tick(&mut state, 0).code, 0);
/// assert_eq!(controller.tick(&mut state, 90).code, 20);
///
/// let output = controller.tick(&mut state, 100);
/// assert_eq!(output.error_counts, 4_900);
/// assert_eq!(output.code, 2_047);
/// assert!(output.status.code_limited);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Controller<const N: usize> {
    pid: Pid,
    dac: Dac,
    setpoints: SetpointTable<N>,
}

impl<const N: usize> Controller<N> {
    /// Puts the parts together; each has been checked where it was made.
    pub const fn new(pid: Pid, dac: Dac, setpoints: SetpointTable<N>) -> Self {
        Self {
            pid,
            dac,
            setpoints,
        }
    }

    /// Sample `k`: takes the encoder count \[counts, modulo 2^32\] and gives
    /// the code for the converter. `k` is counted in `state`, from 0.
    pub fn tick(&self, state: &mut ControllerState, count: i32) -> Output {
        let setpoint = self.setpoints.at(state.sample);
        // At 10 µs the counter would take 5.8 million years to its end. It
        // would stay there: the last setpoint is held all the same.
        state.sample = state.sample.saturating_add(1);

        // e = r − c                                          eq. 20, 22 [counts]
        let error_counts = counts::difference(setpoint, count);
        let law = self.pid.step(&mut state.pid, error_counts);
        let code = self.dac.code(law.sum);

        Output {
            code,
            error_counts,
            status: Status {
                error_limited: law.error_limited,
                error_sum_beyond_range: law.error_sum_beyond_range,
                code_limited: self.dac.is_limit(code),
            },
        }
    }
}

/// Memory of a [`Controller`]. The default is the state before sample 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ControllerState {
    sample: u64,
    pid: PidState,
}

impl ControllerState {
    /// `k` of the next sample: the number of samples so far.
    pub const fn sample(&self) -> u64 {
        self.sample
    }

    /// Memory of the control law.
    pub const fn pid(&self) -> &PidState {
        &self.pid
    }
}

/// Results of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Output {
    /// Code for the D/A converter, −2^(n−1) to 2^(n−1)−1.
    pub code: i32,
    /// `e = r − c` as measured \[counts\], before it is held within the error
    /// range.
    pub error_counts: i32,
    /// Limits that this sample has met.
    pub status: Status,
}

/// Limits that a sample has met. All of them can be left again: the
/// controller goes on in each case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Status {
    /// `|e|` was larger than the declared range and was held at its limit:
    /// from here on the codes are no longer those of the law for these counts.
    pub error_limited: bool,
    /// `|Σe|` is beyond [`Pid::error_sum_limit`]: the code may be off by more
    /// than 1. The integral itself goes on exactly, and the promise holds
    /// again when `|Σe|` has come back.
    pub error_sum_beyond_range: bool,
    /// The code is the largest or the smallest of the converter.
    pub code_limited: bool,
}
