//! One axis in service: inputs, supervision, reference, law and output, in
//! the order in which a sample runs through them.
//!
//! ```text
//!            inputs            supervision        reference          law            output
//! register ─► position.rs ─┬─► watch.rs ─┐   source ─► r            law/mod.rs    output.rs
//! tick, e-stop, bus ───────┴────────────►│   takeup.rs ─► + ─►(+)─► e ─► y ─────► code
//!                                        ▼                    ▲-
//!                             faults.rs, states.rs            └── c, motor or load
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

use crate::counts;
use crate::faults::{Fault, FaultCause, FaultLatch, FaultValues, Trip, most_urgent};
use crate::law::{Law, LawInput, LawState};
use crate::output::{Output, OutputState};
use crate::position::{CounterParameters, PositionState};
use crate::reference::{Next, Observed, Setpoint, SetpointSource};
use crate::states::{Event, Refused, State};
use crate::takeup::{TakeUp, TakeUpState};
use crate::watch::{
    EncoderLossState, EncoderLossWatch, FollowingErrorState, FollowingErrorWatch, SaturationState,
    SaturationWatch, TickState, TickWatch,
};

/// Which encoder the position comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Feedback {
    /// The motor's: the paper's axis.
    #[default]
    Motor,
    /// The load's, with the damping from the motor.
    Load(CounterParameters),
}

/// What changes while the axis stands: at rest an integrator behind a
/// quantiser and a gap hunts, and these stop it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rest {
    /// Errors up to this size count as 0 for `Kp` and `Ki` while no motion runs
    /// \[counts\]; the derivative goes on.
    pub dead_band: u32,
    /// Whether the integral keeps its value while no motion runs, whatever the
    /// error: what is left is then left to `Kp`.
    pub hold_integral: bool,
}

/// Checks that run in every sample; `None` checks nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Watches {
    /// Distance of the axis from its setpoint.
    pub following_error: Option<FollowingErrorWatch>,
    /// An encoder that does not count.
    pub encoder_loss: Option<EncoderLossWatch>,
    /// An output that stays at its limit.
    pub saturation: Option<SaturationWatch>,
    /// A sample that did not come.
    pub ticks: Option<TickWatch>,
}

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
    pub take_up: Option<TakeUp>,
    /// What changes at rest.
    pub rest: Rest,
    /// Supervision.
    pub watches: Watches,
}

/// What the hardware shows at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Inputs {
    /// Number of the sample, counted by the timer that starts it.
    pub tick: u64,
    /// Register of the motor's encoder.
    pub motor_register: u32,
    /// Register of the load's encoder, where there is one; with
    /// [`Feedback::Load`] none counts as a transfer that failed.
    pub load_register: Option<u32>,
    /// Whether the emergency stop is asserted.
    pub emergency_stop: bool,
    /// Transfers on the hardware's buses that failed since the last sample.
    pub failed_transfers: u32,
}

/// What one sample gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisOutput {
    /// Code for the converter.
    pub code: i32,
    /// Whether the power stage is to be on.
    pub power: bool,
    /// The state after this sample.
    pub state: State,
    /// `e = r − c` as measured \[counts\].
    pub error_counts: i32,
    /// Whether the law left a declared range: its error was held, a filtered
    /// difference was, or the integral stands at its end.
    pub out_of_range: bool,
}

/// The register of the load's encoder did not come.
const LOAD_NOT_READ: Trip = Trip {
    cause: FaultCause::HardwareBus,
    measured: 1,
    limit: 0,
};

impl Axis {
    /// An axis with law and output, every other option off. The converter is
    /// the one that the law was accepted for: its proof holds for no other.
    pub fn new(law: Law, output: Output) -> Self {
        Self {
            law,
            output: output.of_converter(law.dac()),
            counter: CounterParameters::default(),
            feedback: Feedback::Motor,
            take_up: None,
            rest: Rest::default(),
            watches: Watches::default(),
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

    /// One sample.
    pub fn tick(
        &self,
        state: &mut AxisState,
        inputs: &Inputs,
        source: &mut impl SetpointSource,
    ) -> AxisOutput {
        // 1. Inputs.
        let motor = self.counter.read(&mut state.motor, inputs.motor_register);
        // What moves while the axis is driven; with two encoders both must.
        let mut moved = motor.difference;
        let (position, load_position, load_trip) = match self.feedback {
            Feedback::Motor => (
                motor.position,
                inputs.load_register.map(u32::cast_signed),
                None,
            ),
            Feedback::Load(counter) => match inputs.load_register {
                Some(register) => {
                    let load = counter.read(&mut state.load, register);
                    if load.difference == 0 {
                        moved = 0;
                    }
                    (load.position, Some(load.position), load.glitch)
                }
                // No register is not a register that reads 0.
                None => {
                    let last = state.load.position();
                    (last.unwrap_or_default(), last, Some(LOAD_NOT_READ))
                }
            },
        };
        let mut trip = most_urgent(self.hardware_trip(state, inputs), motor.glitch);
        trip = most_urgent(trip, load_trip);
        let code_in_force = state.output.code();
        if let (true, Some(watch)) = (state.state.is_powered(), &self.watches.encoder_loss) {
            let lost = watch.check(&mut state.loss, code_in_force, moved);
            trip = most_urgent(trip, lost);
        }

        // 2. Reference.
        let observed = Observed {
            position: motor.position,
            load_position,
            code: code_in_force,
        };
        let (setpoint, underrun) = self.reference(state, position, &observed, source);
        trip = most_urgent(trip, underrun);

        // 3. e = r − c                                       eq. 20, 22 [counts]
        let error_counts = counts::difference(setpoint.position, position);
        if let (true, Some(watch)) = (state.state.is_powered(), &self.watches.following_error) {
            let too_far = watch.check(&mut state.following, error_counts, setpoint.velocity);
            trip = most_urgent(trip, too_far);
        }

        // 4. Law and output, unless the sample ends in safety.
        let mut out_of_range = false;
        let mut code = code_in_force;
        if trip.is_none() && state.state.is_powered() {
            let input = LawInput {
                error: error_counts,
                difference: motor.difference,
                velocity: setpoint.velocity,
                acceleration: setpoint.acceleration,
                ..LawInput::default()
            };
            let input = self.at_rest(state, input);
            let window = self.output.window(&state.output);
            let law = self.law.step(&mut state.law, &input, window);
            let bits = self.law.words().sum_fraction_bits;
            code = self.output.code(&mut state.output, law.sum, bits, window);
            out_of_range = law.error_limited | law.difference_limited | law.integral_limited;
            if let Some(watch) = &self.watches.saturation {
                let at_limit = self.output.dac().is_limit(code);
                trip = watch.check(&mut state.saturation, at_limit);
            }
        }
        if let Some(trip) = trip {
            state.fail(
                inputs.tick,
                FaultValues {
                    setpoint: setpoint.position,
                    position,
                    error: error_counts,
                    code,
                    measured: trip.measured,
                    limit: trip.limit,
                },
                trip.cause,
            );
        }
        match state.state {
            State::Fault => code = self.output.safe(&mut state.output),
            State::Disabled => code = self.output.towards_zero(&mut state.output),
            State::Enabled | State::Moving | State::Holding => {}
        }
        AxisOutput {
            code,
            // A drive that is switched off in order keeps its power until its
            // output has come to 0.
            power: state.state.is_powered() || code != 0,
            state: state.state,
            error_counts,
            out_of_range,
        }
    }

    /// The sample of `tick` has computed its output, but the hardware did not
    /// take it: the axis stops in the same sample.
    pub fn output_failed(
        &self,
        state: &mut AxisState,
        tick: u64,
        failed_transfers: u32,
    ) -> AxisOutput {
        let position = state.motor.position().unwrap_or_default();
        let error_counts = counts::difference(state.setpoint, position);
        let values = FaultValues {
            setpoint: state.setpoint,
            position,
            error: error_counts,
            code: state.output.code(),
            measured: i64::from(failed_transfers),
            limit: 0,
        };
        state.fail(tick, values, FaultCause::HardwareBus);
        AxisOutput {
            code: self.output.safe(&mut state.output),
            power: false,
            state: state.state,
            error_counts,
            out_of_range: false,
        }
    }

    /// What the hardware itself reports.
    fn hardware_trip(&self, state: &mut AxisState, inputs: &Inputs) -> Option<Trip> {
        let stop = inputs.emergency_stop.then_some(Trip::EMERGENCY_STOP);
        let bus = (inputs.failed_transfers != 0).then_some(Trip {
            cause: FaultCause::HardwareBus,
            measured: i64::from(inputs.failed_transfers),
            limit: 0,
        });
        let missed = self
            .watches
            .ticks
            .and_then(|watch| watch.check(&mut state.ticks, inputs.tick));
        most_urgent(stop, most_urgent(bus, missed))
    }

    /// The setpoint of this sample, take-up included.
    fn reference(
        &self,
        state: &mut AxisState,
        position: i32,
        observed: &Observed,
        source: &mut impl SetpointSource,
    ) -> (Setpoint, Option<Trip>) {
        let mut underrun = None;
        let mut setpoint = Setpoint {
            position: state.setpoint,
            ..Setpoint::default()
        };
        if core::mem::take(&mut state.position_to_hold) {
            // Hold where the axis stands, and go on from the code in force.
            setpoint.position = position;
            state.take_up = TakeUpState::default();
            let code = state.output.code();
            state.law = if state.state == State::Enabled || code != 0 {
                LawState::take_over(code)
            } else {
                // Started in the same breath, from rest.
                LawState::default()
            };
        }
        match state.state {
            State::Disabled | State::Fault => setpoint.position = position,
            State::Enabled | State::Holding => {}
            State::Moving => match source.next(observed) {
                Next::Setpoint(next) => setpoint = next,
                Next::Last(last) => {
                    setpoint = last;
                    state.state = state
                        .state
                        .after(Event::MotionEnded)
                        .unwrap_or(State::Holding);
                }
                Next::Underrun => underrun = Some(Trip::SETPOINT_UNDERRUN),
            },
        }
        state.setpoint = setpoint.position;
        if let (true, Some(take_up)) = (state.state.is_powered(), &self.take_up) {
            let offset = take_up.step(&mut state.take_up, &setpoint);
            setpoint.position = setpoint.position.wrapping_add(offset);
        }
        (setpoint, underrun)
    }

    /// Dead band and held integral while the axis stands.
    fn at_rest(&self, state: &AxisState, input: LawInput) -> LawInput {
        let stands =
            matches!(state.state, State::Holding | State::Enabled) && !state.take_up.is_under_way();
        LawInput {
            within_dead_band: stands && input.error.unsigned_abs() <= self.rest.dead_band,
            hold_integral: stands && self.rest.hold_integral,
            ..input
        }
    }
}

/// Memory of an [`Axis`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisState {
    law: LawState,
    output: OutputState,
    motor: PositionState,
    load: PositionState,
    take_up: TakeUpState,
    latch: FaultLatch,
    ticks: TickState,
    following: FollowingErrorState,
    loss: EncoderLossState,
    saturation: SaturationState,
    /// The last setpoint, without the take-up \[counts, modulo 2^32\].
    setpoint: i32,
    state: State,
    /// Whether the axis was enabled since the last sample.
    position_to_hold: bool,
}

/// The whole memory of an axis is small enough for the smallest chips.
const _: () = assert!(size_of::<AxisState>() < 256, "state of an axis: 256 bytes");

impl AxisState {
    /// Before the first sample: disabled, code 0.
    pub fn start(axis: &Axis) -> Self {
        Self {
            law: LawState::default(),
            output: axis.output.start(),
            motor: PositionState::default(),
            load: PositionState::default(),
            take_up: TakeUpState::default(),
            latch: FaultLatch::default(),
            ticks: TickState::default(),
            following: FollowingErrorState::default(),
            loss: EncoderLossState::default(),
            saturation: SaturationState::default(),
            setpoint: 0,
            state: State::Disabled,
            position_to_hold: false,
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
    pub(crate) fn last_registers(&self) -> (u32, Option<u32>) {
        let register = |position: Option<i32>| position.map(i32::cast_unsigned);
        (
            register(self.motor.position()).unwrap_or_default(),
            register(self.load.position()),
        )
    }

    /// Tells that the next sample comes with another law: the output goes on
    /// from where it stands, whatever the gains are.
    pub fn gains_changed(&mut self) {
        self.law.change_over(self.output.code());
        self.output.forget_remainder();
    }

    /// The state.
    pub const fn state(&self) -> State {
        self.state
    }

    /// The fault that is latched.
    pub const fn fault(&self) -> Option<&Fault> {
        self.latch.get()
    }

    /// Largest `|e|` since the start or the last reset of the peak \[counts\];
    /// kept by the following-error watch.
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
