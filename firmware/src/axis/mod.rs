//! One axis in service: inputs, supervision, reference, law and output, in
//! the order in which a sample runs through them.
//!
//! ```text
//!            inputs            supervision        reference          law            output
//! register ─► position.rs ─┬─► monitor ───┐   source ─► r            law/          output.rs
//! tick, e-stop, bus ───────┴──────────────►│   backlash ──► + ─►(+)─► e ─► y ─────► code
//!                                          ▼   compensation      ▲-
//!                               faults.rs, states.rs             └── c, motor or load
//! ```
//!
//! A fault that is found in a sample acts in that sample: the code is 0 and
//! the power is off before [`Axis::tick`] returns. Which events lead from
//! which state to which, and what each fault means, is in [`crate::states`]
//! and [`crate::faults`].
//!
//! With every option off, and started at rest, the codes are those of
//! [`crate::Controller`].
//!
//! # Two encoders
//!
//! With [`Feedback::Load`] the setpoints and the error are in counts of the
//! load's encoder, so that the load ends where it should; the derivative is
//! that of the motor, which the joint's backlash cannot hide. `Kp` and `Ki·Δt`
//! are then in codes per load count, `Kd/Δt` in codes per motor count.

mod options;
mod reference;
mod state;
mod tick;

pub use options::{Feedback, Monitors, Rest};
pub use state::AxisState;
pub use tick::{AxisOutput, Inputs};

use crate::backlash_compensation::BacklashCompensation;
use crate::law::Law;
use crate::monitor::{EncoderLossState, SaturationState};
use crate::output::Output;
use crate::position::{CounterParameters, PositionState};
use crate::states::{Event, Refused, State};

/// An axis: everything that does not change in motion. Its memory is
/// [`AxisState`].
///
/// ```
/// use firmware::axis::{Axis, AxisState, Inputs};
/// use firmware::law::{Law, LawWords};
/// use firmware::output::{Output, Quantiser};
/// use firmware::reference::TableSource;
/// use firmware::{Dac, Event, GainWord, SetpointTable, State};
///
/// let dac = Dac::with_bits(12)?;
/// // A proportional controller: Kp = 2 codes per count.
/// let words = LawWords { kp: GainWord::new(1 << 30, 29), ..LawWords::NONE };
/// let axis = Axis::new(Law::accept(words, dac)?, Output::new(dac, None, Quantiser::Nearest)?);
///
/// let table = SetpointTable::<16>::from_counts(&[0, 100])?;
/// let mut source = TableSource::new(&table);
/// let mut state = AxisState::start(&axis);
/// axis.request(&mut state, Event::Enable)?;
/// axis.request(&mut state, Event::Start)?;
/// let first = axis.tick(&mut state, &Inputs { tick: 0, ..Inputs::default() }, &mut source);
/// assert_eq!((first.code, first.state), (0, State::Moving));
/// let second = axis.tick(&mut state, &Inputs { tick: 1, motor_register: 90, ..Inputs::default() }, &mut source);
/// assert_eq!((second.code, second.state), (20, State::Holding));
/// // The emergency stop acts in the sample that sees it.
/// let stop = Inputs { tick: 2, emergency_stop: true, ..Inputs::default() };
/// let third = axis.tick(&mut state, &stop, &mut source);
/// assert_eq!((third.code, third.power, third.state), (0, false, State::Fault));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    law: Law,
    output: Output,
    /// The counter of the motor's encoder.
    pub counter: CounterParameters,
    /// Which encoder the position comes from.
    pub feedback: Feedback,
    /// Compensation of the backlash.
    pub backlash_compensation: Option<BacklashCompensation>,
    /// What changes at rest.
    pub rest: Rest,
    /// Supervision.
    pub monitors: Monitors,
}

impl Axis {
    /// An axis with law and output, every other option off. The converter is
    /// the one that the law was accepted for: its proof holds for no other.
    pub const fn new(law: Law, output: Output) -> Self {
        Self {
            law,
            output: output.of_converter(law.dac()),
            counter: CounterParameters::WORD,
            feedback: Feedback::Motor,
            backlash_compensation: None,
            rest: Rest::NONE,
            monitors: Monitors::NONE,
        }
    }

    /// The control law.
    pub const fn law(&self) -> &Law {
        &self.law
    }

    /// Converter, slew limit and quantiser.
    pub const fn output(&self) -> &Output {
        &self.output
    }

    /// Other gains; in motion together with [`AxisState::gains_changed`].
    pub const fn set_law(&mut self, law: Law) {
        self.law = law;
        self.output = self.output.of_converter(law.dac());
    }

    /// Asks for another state; it acts from the next sample on.
    ///
    /// # Errors
    /// [`Refused`] if the state does not allow it, and for the two events that
    /// the axis finds out itself; nothing has changed then.
    pub fn request(&self, state: &mut AxisState, event: Event) -> Result<State, Refused> {
        let next = state.state.after(event)?;
        match event {
            Event::Enable => {
                state.position_to_hold = true;
                // Samples in a row: those before the power went off do not count.
                state.loss = EncoderLossState::default();
                state.saturation = SaturationState::default();
            }
            Event::Reset => {
                state.latch.clear();
                // A counter that never came back starts anew; the axis has
                // to be homed.
                if state.motor.missed() != 0 {
                    state.motor = PositionState::default();
                }
                if state.load.missed() != 0 {
                    state.load = PositionState::default();
                }
            }
            Event::Disable | Event::Start => {}
            // A fault without its record, a motion that ends where its source
            // does not: neither is for others to say.
            Event::MotionEnded | Event::Fail => {
                return Err(Refused {
                    state: state.state,
                    event,
                });
            }
        }
        state.state = next;
        Ok(next)
    }
}
