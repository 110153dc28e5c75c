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

mod tick;

use crate::backlash_compensation::{BacklashCompensation, BacklashCompensationState};
use crate::faults::{Fault, FaultCause, FaultLatch, FaultValues};
use crate::law::{Begin, Law, LawState};
use crate::monitor::{
    EncoderLossMonitor, EncoderLossState, FollowingErrorMonitor, FollowingErrorState,
    SaturationMonitor, SaturationState, TickMonitor, TickState,
};
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

/// Memory of an [`Axis`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisState {
    law: LawState,
    motor: PositionState,
    load: PositionState,
    backlash_compensation: BacklashCompensationState,
    latch: FaultLatch,
    ticks: TickState,
    following: FollowingErrorState,
    loss: EncoderLossState,
    saturation: SaturationState,
    /// The last setpoint, without the backlash compensation \[counts, modulo 2^32\].
    setpoint: i32,
    state: State,
    /// True if the axis was enabled since the last sample.
    position_to_hold: bool,
    /// Memory that the next sample of the law begins with, where it does not go
    /// on from the one before.
    begin: Option<Begin>,
}

/// The whole memory of an axis is small enough for the smallest chips.
const _: () = assert!(size_of::<AxisState>() < 256, "state of an axis: 256 bytes");

impl AxisState {
    /// Before the first sample: disabled, code 0.
    pub fn start(axis: &Axis) -> Self {
        Self {
            law: LawState::start(&axis.output),
            motor: PositionState::default(),
            load: PositionState::default(),
            backlash_compensation: BacklashCompensationState::default(),
            latch: FaultLatch::default(),
            ticks: TickState::default(),
            following: FollowingErrorState::default(),
            loss: EncoderLossState::default(),
            saturation: SaturationState::default(),
            setpoint: 0,
            state: State::Disabled,
            position_to_hold: false,
            begin: Some(Begin::AtRest),
        }
    }

    /// Keeps the first fault and ends in its state.
    fn fail(&mut self, tick: u64, values: FaultValues, cause: FaultCause) {
        self.latch.trip(Fault {
            cause,
            tick,
            values,
        });
        // Any state ends in the fault; the table has no refusal for it.
        self.state = self.state.after(Event::Fail).unwrap_or(State::Fault);
    }

    /// The register of the last good reading of the motor's encoder, for a
    /// sample whose reading failed.
    pub fn last_registers(&self) -> (u32, Option<u32>) {
        let register = |position: Option<i32>| position.map(i32::cast_unsigned);
        (
            register(self.motor.position()).unwrap_or_default(),
            register(self.load.position()),
        )
    }

    /// Tells that the next sample comes with another law: the output goes on
    /// from where it stands, whatever the gains are.
    pub fn gains_changed(&mut self) {
        self.begin = Some(match self.begin {
            Some(Begin::AtRest | Begin::FromCode) => Begin::FromCode,
            Some(Begin::OtherGains) | None => Begin::OtherGains,
        });
    }

    /// The state.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Position of the motor \[counts, modulo 2^32\]; `None` before the first
    /// sample, and after the reset of a glitch that never came back: the axis
    /// has lost its reference then and must be homed.
    pub const fn position(&self) -> Option<i32> {
        self.motor.position()
    }

    /// The fault that is latched.
    pub const fn fault(&self) -> Option<&Fault> {
        self.latch.get()
    }

    /// Largest `|e|` since the start or the last reset of the peak \[counts\];
    /// kept by the following-error monitor.
    pub const fn peak_error_counts(&self) -> u32 {
        self.following.peak()
    }

    /// Starts the peak of `|e|` anew.
    pub const fn reset_peak_error(&mut self) {
        self.following.reset_peak();
    }

    /// Memory of the law.
    pub const fn law(&self) -> &LawState {
        &self.law
    }
}

/// Readings of the hardware at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
