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
//! the power is off before [`AxisState::tick`] returns. Which events lead from
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

mod rare;
mod state;
mod tick;
mod words;

pub use state::AxisState;

use crate::backlash_compensation::BacklashCompensation;
use crate::law::Law;
use crate::monitor::{EncoderLossMonitor, FollowingErrorMonitor, SaturationMonitor, TickMonitor};
use crate::output::Output;
use crate::position::CounterParameters;
use crate::states::State;

/// Settings of an axis: everything that does not change in motion. What runs
/// with them is an [`AxisState`].
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
/// state.request(Event::Enable)?;
/// state.request(Event::Start)?;
/// let first = state.tick(&Inputs { tick: 0, ..Inputs::default() }, &mut source);
/// assert_eq!((first.code, first.state), (0, State::Moving));
/// let second = state.tick(&Inputs { tick: 1, motor_register: 90, ..Inputs::default() }, &mut source);
/// assert_eq!((second.code, second.state), (20, State::Holding));
/// // The emergency stop acts in the sample that sees it.
/// let stop = Inputs { tick: 2, emergency_stop: true, ..Inputs::default() };
/// let third = state.tick(&stop, &mut source);
/// assert_eq!((third.code, third.power, third.state), (0, false, State::Fault));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    law: Law,
    output: Output,
    /// The counter of the motor's encoder.
    pub counter: CounterParameters,
    /// Encoder that the position comes from.
    pub feedback: Feedback,
    /// Compensation of the backlash.
    pub backlash_compensation: Option<BacklashCompensation>,
    /// Changes at rest.
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

    /// Other gains; in motion, [`AxisState::change`] takes them over.
    pub const fn set_law(&mut self, law: Law) {
        self.law = law;
        self.output = self.output.of_converter(law.dac());
    }
}

/// Encoder that the position comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Feedback {
    /// The motor's: the paper's axis.
    #[default]
    Motor,
    /// The load's, with the damping from the motor.
    Load(CounterParameters),
}

/// Changes while the axis stands: at rest an integrator behind a
/// quantiser and a gap hunts, and these stop it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rest {
    /// Errors up to this size count as 0 for `Kp` and `Ki` while no motion runs
    /// \[counts\]; the derivative goes on.
    pub dead_band: u32,
    /// True if the integral keeps its value while no motion runs, whatever the
    /// error: what is left is then left to `Kp`.
    pub hold_integral: bool,
}

impl Rest {
    /// Nothing changes: the default.
    pub const NONE: Self = Self {
        dead_band: 0,
        hold_integral: false,
    };
}

/// Checks that run in every sample; `None` checks nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Monitors {
    /// Distance of the axis from its setpoint.
    pub following_error: Option<FollowingErrorMonitor>,
    /// An encoder that does not count.
    pub encoder_loss: Option<EncoderLossMonitor>,
    /// An output that stays at its limit.
    pub saturation: Option<SaturationMonitor>,
    /// A sample that did not come.
    pub ticks: Option<TickMonitor>,
}

impl Monitors {
    /// Nothing is monitored: the default.
    pub const NONE: Self = Self {
        following_error: None,
        encoder_loss: None,
        saturation: None,
        ticks: None,
    };
}

/// Readings of the hardware at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inputs {
    /// Number of the sample, counted by the timer that starts it.
    pub tick: u64,
    /// Register of the motor's encoder.
    pub motor_register: u32,
    /// Register of the load's encoder, where there is one; with
    /// [`Feedback::Load`] none counts as a transfer that failed.
    pub load_register: Option<u32>,
    /// True if the emergency stop is asserted.
    pub emergency_stop: bool,
    /// Transfers on the hardware's buses that failed since the last sample.
    pub failed_transfers: u32,
}

/// Results of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisOutput {
    /// Code for the converter.
    pub code: i32,
    /// True if the power stage is to be on.
    pub power: bool,
    /// The state after this sample.
    pub state: State,
    /// `e = r − c` as measured \[counts\].
    pub error_counts: i32,
    /// True if the law left a declared range: its error was held, a filtered
    /// difference was, or the integral stands at its end.
    pub out_of_range: bool,
}
