//! Memory of an axis.

use super::Axis;
use crate::backlash_compensation::BacklashCompensationState;
use crate::faults::{Fault, FaultCause, FaultLatch, FaultValues};
use crate::law::LawState;
use crate::monitor::{EncoderLossState, FollowingErrorState, SaturationState, TickState};
use crate::output::OutputState;
use crate::position::PositionState;
use crate::states::{Event, State};

/// Memory of an [`Axis`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisState {
    pub(super) law: LawState,
    pub(super) output: OutputState,
    pub(super) motor: PositionState,
    pub(super) load: PositionState,
    pub(super) backlash_compensation: BacklashCompensationState,
    pub(super) latch: FaultLatch,
    pub(super) ticks: TickState,
    pub(super) following: FollowingErrorState,
    pub(super) loss: EncoderLossState,
    pub(super) saturation: SaturationState,
    /// The last setpoint, without the backlash compensation \[counts, modulo 2^32\].
    pub(super) setpoint: i32,
    pub(super) state: State,
    /// Whether the axis was enabled since the last sample.
    pub(super) position_to_hold: bool,
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
            backlash_compensation: BacklashCompensationState::default(),
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
    pub(super) fn fail(&mut self, tick: u64, values: FaultValues, cause: FaultCause) {
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
        self.law.change_over(self.output.code());
        self.output.forget_remainder();
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
