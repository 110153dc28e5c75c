//! The paper's controller: a table of setpoints, the control law and a
//! converter, and nothing else.
//!
//! [`Controller`] holds what does not change during a motion,
//! [`ControllerState`] what does: starting again is
//! [`ControllerState::start`], and one controller can serve several states. The
//! setpoints are part of the controller because the paper keeps them in its
//! memory.

use crate::counts;
use crate::law::{Begin, Law, LawInput, LawState};
use crate::output::{Output, Quantiser};
use crate::reference::SetpointTable;

/// The position controller of one axis with a table of at most `N` setpoints.
///
/// ```
/// use firmware::law::{Law, LawWords};
/// use firmware::{Controller, ControllerState, Dac, GainWord, SetpointTable};
///
/// // A proportional controller: Kp = 2 codes per count.
/// let words = LawWords { kp: GainWord::new(1 << 30, 29), ..LawWords::NONE };
/// let controller = Controller::new(
///     Law::accept(words, Dac::with_bits(12)?)?,
///     SetpointTable::<16>::from_counts(&[0, 100, 5_000])?,
/// );
/// let mut state = ControllerState::start(&controller);
/// assert_eq!(controller.tick(&mut state, 0).code, 0);
/// assert_eq!(controller.tick(&mut state, 90).code, 20);
///
/// let sample = controller.tick(&mut state, 100);
/// assert_eq!((sample.error_counts, sample.code), (4_900, 2_047));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Controller<const N: usize> {
    law: Law,
    output: Output,
    setpoints: SetpointTable<N>,
}

impl<const N: usize> Controller<N> {
    /// Puts the parts together; each has been checked where it was made.
    pub const fn new(law: Law, setpoints: SetpointTable<N>) -> Self {
        Self {
            output: Output::unlimited(law.dac(), Quantiser::Nearest),
            law,
            setpoints,
        }
    }

    /// The control law.
    pub const fn law(&self) -> &Law {
        &self.law
    }

    /// Sample `k`: takes the encoder count \[counts, modulo 2^32\] and gives
    /// the code for the converter. `k` is counted in `state`, from 0.
    #[inline]
    pub fn tick(&self, state: &mut ControllerState, count: i32) -> ControllerOutput {
        let k = state.sample;
        // At 10 µs the counter would take 5.8 million years to its end. It
        // would stay there: the last setpoint is held all the same.
        state.sample = k.saturating_add(1);

        // e = r − c                                          eq. 20, 22 [counts]
        let error_counts = counts::difference(self.setpoints.at(k), count);
        let input = LawInput {
            error: error_counts,
            ..LawInput::default()
        };
        let code = if k == 0 {
            self.law
                .begin(&self.output, &mut state.law, &input, Begin::AtRest)
        } else {
            self.law.step(&self.output, &mut state.law, &input)
        };
        ControllerOutput {
            code,
            error_counts,
            out_of_range: state.law.take_left_range(),
        }
    }
}

/// Memory of a [`Controller`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ControllerState {
    sample: u64,
    law: LawState,
}

impl ControllerState {
    /// Before sample 0.
    pub const fn start<const N: usize>(controller: &Controller<N>) -> Self {
        Self {
            sample: 0,
            law: LawState::start(&controller.output),
        }
    }

    /// `k` of the next sample: the number of samples so far.
    pub const fn sample(&self) -> u64 {
        self.sample
    }

    /// Memory of the control law.
    pub const fn law(&self) -> &LawState {
        &self.law
    }
}

/// Results of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ControllerOutput {
    /// Code for the D/A converter, −2^(n−1) to 2^(n−1)−1.
    pub code: i32,
    /// `e = r − c` as measured \[counts\], before it is held within the error
    /// range.
    pub error_counts: i32,
    /// True if the law was seen to leave a declared range
    /// ([`LawState::take_left_range`]): from here on the codes may be off by more
    /// than 1.
    pub out_of_range: bool,
}
