//! One sample of the backlash compensation, and its memory.

use super::parabola::Mixed;
use super::{BacklashCompensation, Trigger};
use crate::counts::difference;
use crate::reference::Setpoint;

/// A flank of the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Flank {
    /// None yet: the joint counts as centred.
    #[default]
    Neither,
    /// The motor pushes in the positive direction.
    Positive,
    /// The motor pushes in the negative direction.
    Negative,
}

/// Memory of the backlash compensation. The default is an offset of 0, the joint centred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BacklashCompensationState {
    /// `T` of the running or the last move \[counts\].
    travel: Mixed,
    /// `T(j) − T(j − 1)` of the last sample \[counts per sample\].
    velocity: Mixed,
    /// Samples that the running move still takes; 0 at rest.
    left: u32,
    /// Position of the last setpoint \[counts\].
    previous_position: Option<i32>,
    /// The flank that the reference has last asked for.
    wanted: Flank,
    /// The flank that the running move leads to, or the last one led to.
    flank: Flank,
    /// Whether that move started at the centre.
    from_centre: bool,
}

impl BacklashCompensationState {
    /// Whether the offset is on its way, or about to be: the axis is not in
    /// position before this is over.
    #[inline]
    pub fn is_under_way(&self) -> bool {
        self.left > 0 || self.wanted != self.flank
    }
}

impl BacklashCompensation {
    /// The offset of this sample \[motor counts\], for the setpoint of this
    /// sample; to be called once a sample, also while the reference rests.
    #[inline]
    pub fn step(&self, state: &mut BacklashCompensationState, setpoint: &Setpoint) -> i32 {
        let previous = state.previous_position.replace(setpoint.position);
        let rate = match self.trigger {
            Trigger::Acceleration => setpoint.acceleration,
            Trigger::Velocity if setpoint.velocity != 0 => setpoint.velocity,
            Trigger::Velocity => previous.map_or(0, |last| difference(setpoint.position, last)),
        };
        if rate > 0 {
            state.wanted = Flank::Positive;
        } else if rate < 0 {
            state.wanted = Flank::Negative;
        }

        let samples = self.samples();
        if state.left == 0 && state.wanted != state.flank {
            state.from_centre = state.flank == Flank::Neither;
            state.flank = state.wanted;
            state.left = samples;
            state.travel = Mixed::default();
        }
        if state.left > 0 {
            state.velocity = if state.left == samples {
                self.first
            } else if state.left > self.half_samples {
                state.velocity.plus(self.change, self.n2)
            } else if state.left == self.half_samples {
                state.velocity
            } else {
                state.velocity.minus(self.change, self.n2)
            };
            // T(j) ← T(j − 1) + (T(j) − T(j − 1))
            state.travel = state.travel.plus(state.velocity, self.n2);
            state.left = state.left.wrapping_sub(1);
        }
        self.offset(state)
    }

    /// The nearest integer to the exact offset, half away from zero.
    #[inline]
    const fn offset(&self, state: &BacklashCompensationState) -> i32 {
        // All magnitudes are at most 2·B ≤ 2^25: nothing wraps.
        let Mixed { whole, part } = state.travel;
        let ahead = if state.from_centre {
            // T/2, half up: floor((T + 1)/2)
            whole.wrapping_add(1).wrapping_shr(1)
        } else {
            // T − B, half up where it is not negative, half down where it is
            let rest = self.n2.wrapping_sub(part);
            let up = part > rest || (part == rest && whole >= self.half_gap_counts);
            let nearest = if up { whole.wrapping_add(1) } else { whole };
            nearest.wrapping_sub(self.half_gap_counts)
        };
        match state.flank {
            Flank::Neither => 0,
            Flank::Positive => ahead.cast_signed(),
            Flank::Negative => ahead.cast_signed().wrapping_neg(),
        }
    }
}
