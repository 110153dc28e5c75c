//! What the axis is to do in a sample: its setpoint, and what changes at rest.

use super::{Axis, AxisState};
use crate::backlash_compensation::BacklashCompensationState;
use crate::faults::Trip;
use crate::law::{LawInput, LawState};
use crate::reference::{Next, Observed, Setpoint, SetpointSource};
use crate::states::{Event, State};

impl Axis {
    /// The setpoint of this sample, backlash compensation included.
    #[inline(always)]
    pub(super) fn reference(
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
            let code = state.output.code();
            state.law = if state.state == State::Enabled || code != 0 {
                LawState::take_over(code)
            } else {
                // Started in the same breath, from rest.
                LawState::default()
            };
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
    pub(super) fn at_rest(&self, state: &AxisState, input: LawInput) -> LawInput {
        let stands = matches!(state.state, State::Holding | State::Enabled)
            && !state.backlash_compensation.is_under_way();
        LawInput {
            within_dead_band: stands && input.error.unsigned_abs() <= self.rest.dead_band,
            hold_integral: stands && self.rest.hold_integral,
            ..input
        }
    }
}
