//! The axis in service: a sample at a time, and what its button asks for.

use firmware::axis::{Axis, AxisOutput, AxisState};
use firmware::hardware::{Board, serve};
use firmware::{Event, MotionGenerator, MotionPlan, State};

use crate::button::Button;

/// An axis on its electronics, moved to and fro by a button.
///
/// | state | a press |
/// | --- | --- |
/// | disabled | power on, holds where it stands |
/// | enabled, holding | starts the next motion |
/// | moving | power off, at once |
/// | fault | leaves the fault; the power stays off |
///
/// A motion goes forth where the axis stands nearer to its position at
/// power-up than to the end of a motion from there, and back otherwise. So it
/// stays within half a travel of these two, wherever it was stopped before.
#[derive(Debug)]
pub struct Drive<'p, B> {
    axis: Axis,
    state: AxisState,
    board: B,
    forth: &'p MotionPlan,
    back: &'p MotionPlan,
    motion: MotionGenerator<'p>,
    /// Position at which the axis is held, or will be when its motion has ended \[counts\].
    target: i32,
    button: Button,
}

impl<'p, B: Board> Drive<'p, B> {
    /// Disabled; `forth` and `back` are opposite motions.
    pub fn new(axis: Axis, board: B, forth: &'p MotionPlan, back: &'p MotionPlan) -> Self {
        Self {
            axis,
            state: AxisState::start(&axis),
            board,
            forth,
            back,
            motion: MotionGenerator::new(forth, 0),
            target: 0,
            button: Button::default(),
        }
    }

    /// The sample number `tick`, with the level of the button.
    pub fn sample(&mut self, tick: u64, button_down: bool) -> AxisOutput {
        let free = !self.state.state().is_powered();
        if self.button.pressed(button_down) {
            self.press();
        }
        let (axis, state) = (&self.axis, &mut self.state);
        let output = serve(axis, state, &mut self.board, &mut self.motion, tick);
        if let (true, Some(position)) = (free, self.state.position()) {
            self.target = position;
        }
        output
    }

    fn press(&mut self) {
        let event = match self.state.state() {
            State::Fault => Event::Reset,
            State::Disabled => Event::Enable,
            State::Moving => Event::Disable,
            State::Enabled | State::Holding => {
                self.next_motion();
                Event::Start
            }
        };
        // Each is one that its state allows.
        let _ = self.axis.request(&mut self.state, event);
    }

    fn next_motion(&mut self) {
        let towards_end = i64::from(self.forth.end()) - i64::from(self.target);
        let from_start = i64::from(self.target);
        let plan = if from_start.abs() <= towards_end.abs() {
            self.forth
        } else {
            self.back
        };
        self.motion = MotionGenerator::new(plan, self.target);
        self.target = self.target.wrapping_add(plan.end());
    }

    /// Memory of the axis.
    pub const fn state(&self) -> &AxisState {
        &self.state
    }

    /// The electronics.
    pub const fn board(&self) -> &B {
        &self.board
    }

    /// The electronics, for what is not part of a sample.
    pub const fn board_mut(&mut self) -> &mut B {
        &mut self.board
    }
}
