//! One sample of the axis: its setpoint, its supervision, its law, its output.

use super::{Axis, AxisOutput, AxisState, Feedback, Inputs};
use crate::backlash_compensation::BacklashCompensationState;
use crate::counts;
use crate::faults::{FaultCause, FaultValues, Trip, most_urgent};
use crate::law::{Begin, LawInput};
use crate::reference::{Next, Observed, Setpoint, SetpointSource};
use crate::states::{Event, State};

/// The register of the load's encoder did not come.
const LOAD_NOT_READ: Trip = Trip::new(FaultCause::HardwareBus, 1, 0);

/// Readings of the encoders \[counts\].
struct Seen {
    /// Of the encoder that closes the loop.
    position: i32,
    motor_position: i32,
    motor_difference: i32,
    load_position: Option<i32>,
    /// Movement while the axis is driven; 0 where one of two stands still.
    moved: i32,
}

/// Keeps the more urgent of two trips; nearly always there is none.
#[inline(always)]
fn note(trip: &mut Option<Trip>, other: Option<Trip>) {
    if other.is_some() {
        *trip = most_urgent(*trip, other);
    }
}

impl Axis {
    /// One sample.
    #[inline(always)]
    pub fn tick(
        &self,
        state: &mut AxisState,
        inputs: &Inputs,
        source: &mut impl SetpointSource,
    ) -> AxisOutput {
        // 1. Inputs.
        let mut trip = self.hardware_trip(state, inputs);
        let seen = self.read(state, inputs, &mut trip);
        let code_in_force = state.law.code();
        // What follows in this sample leads from one powered state to another.
        let powered = state.state.is_powered();
        // A drive that runs down after a Disable is still one that drives.
        if let (true, Some(monitor)) = (powered | (code_in_force != 0), &self.monitors.encoder_loss)
        {
            let lost = monitor.check(&mut state.loss, code_in_force, seen.moved);
            note(&mut trip, lost);
        }

        // 2. Reference.
        let observed = Observed {
            position: seen.motor_position,
            load_position: seen.load_position,
            code: code_in_force,
        };
        let (setpoint, underrun) = self.reference(state, seen.position, &observed, source);
        note(&mut trip, underrun);

        // 3. e = r − c                                       eq. 20, 22 [counts]
        let error_counts = counts::difference(setpoint.position, seen.position);
        if let (true, Some(monitor)) = (powered, &self.monitors.following_error) {
            let too_far = monitor.check(&mut state.following, error_counts, setpoint.velocity);
            note(&mut trip, too_far);
        }

        // 4. Law and output, unless the sample ends in safety.
        let mut out_of_range = false;
        let mut code = code_in_force;
        if trip.is_none() && powered {
            let input = LawInput {
                error: error_counts,
                difference: seen.motor_difference,
                velocity: setpoint.velocity,
                acceleration: setpoint.acceleration,
                ..LawInput::default()
            };
            (code, out_of_range) = self.drive(state, input);
            if let Some(monitor) = &self.monitors.saturation {
                let at_limit = self.output.dac().is_limit(code);
                trip = monitor.check(&mut state.saturation, at_limit);
            }
        }

        // 5. End.
        if let Some(trip) = trip {
            let values = FaultValues {
                setpoint: setpoint.position,
                position: seen.position,
                error: error_counts,
                code,
                measured: trip.measured,
                limit: trip.limit,
            };
            state.fail(inputs.tick, values, trip.cause);
        }
        let (code, power) = self.end(state, code);
        AxisOutput {
            code,
            power,
            state: state.state,
            error_counts,
            out_of_range,
        }
    }

    /// Both encoders.
    #[inline(always)]
    fn read(&self, state: &mut AxisState, inputs: &Inputs, trip: &mut Option<Trip>) -> Seen {
        let motor = self.counter.read(&mut state.motor, inputs.motor_register);
        note(trip, motor.glitch);
        let mut seen = Seen {
            position: motor.position,
            motor_position: motor.position,
            motor_difference: motor.difference,
            moved: motor.difference,
            load_position: inputs.load_register.map(u32::cast_signed),
        };
        if let Feedback::Load(counter) = self.feedback {
            if let Some(register) = inputs.load_register {
                let load = counter.read(&mut state.load, register);
                note(trip, load.glitch);
                seen.position = load.position;
                // With two encoders both must move.
                if load.difference == 0 {
                    seen.moved = 0;
                }
            } else {
                // No register is not a register that reads 0.
                note(trip, Some(LOAD_NOT_READ));
                seen.position = state.load.position().unwrap_or_default();
            }
            seen.load_position = state.load.position();
        }
        seen
    }

    /// The law's code, and whether the law left a declared range.
    #[inline(always)]
    fn drive(&self, state: &mut AxisState, input: LawInput) -> (i32, bool) {
        let input = self.at_rest(state, input);
        let code = match state.begin.take() {
            None => self.law.step(&self.output, &mut state.law, &input),
            Some(begin) => self.law.begin(&self.output, &mut state.law, &input, begin),
        };
        (code, state.law.take_left_range())
    }

    /// The code that really goes out, and whether with power.
    #[inline(always)]
    fn end(&self, state: &mut AxisState, code: i32) -> (i32, bool) {
        match state.state {
            State::Fault => (state.law.safe(), false),
            // A drive that is switched off in order keeps its power until its
            // output has come to 0.
            State::Disabled => {
                let code = state.law.towards_zero(&self.output);
                (code, code != 0)
            }
            State::Enabled | State::Moving | State::Holding => (code, true),
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
            code: state.law.code(),
            measured: i64::from(failed_transfers),
            limit: 0,
        };
        state.fail(tick, values, FaultCause::HardwareBus);
        AxisOutput {
            code: state.law.safe(),
            power: false,
            state: state.state,
            error_counts,
            out_of_range: false,
        }
    }

    /// Trips that the hardware itself reports.
    #[inline(always)]
    fn hardware_trip(&self, state: &mut AxisState, inputs: &Inputs) -> Option<Trip> {
        let monitor = self.monitors.ticks;
        let mut trip = monitor.and_then(|monitor| monitor.check(&mut state.ticks, inputs.tick));
        if inputs.failed_transfers != 0 {
            let failed = i64::from(inputs.failed_transfers);
            note(
                &mut trip,
                Some(Trip::new(FaultCause::HardwareBus, failed, 0)),
            );
        }
        if inputs.emergency_stop {
            note(&mut trip, Some(Trip::EMERGENCY_STOP));
        }
        trip
    }

    /// The setpoint of this sample, backlash compensation included.
    #[inline(always)]
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
            state.backlash_compensation = BacklashCompensationState::default();
            let goes_on = state.state == State::Enabled || state.law.code() != 0;
            state.begin = Some(if goes_on {
                Begin::FromCode
            } else {
                // Started in the same breath, from rest.
                Begin::AtRest
            });
        }
        let mut powered = true;
        match state.state {
            State::Disabled | State::Fault => {
                setpoint.position = position;
                powered = false;
            }
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
        if let (true, Some(backlash_compensation)) = (powered, &self.backlash_compensation) {
            let offset = backlash_compensation.step(&mut state.backlash_compensation, &setpoint);
            setpoint.position = setpoint.position.wrapping_add(offset);
        }
        (setpoint, underrun)
    }

    /// Dead band and held integral while the axis stands.
    #[inline(always)]
    fn at_rest(&self, state: &AxisState, input: LawInput) -> LawInput {
        let stands = matches!(state.state, State::Holding | State::Enabled)
            && !state.backlash_compensation.is_under_way();
        LawInput {
            within_dead_band: stands && input.error.unsigned_abs() <= self.rest.dead_band,
            hold_integral: stands && self.rest.hold_integral,
            ..input
        }
    }
}
