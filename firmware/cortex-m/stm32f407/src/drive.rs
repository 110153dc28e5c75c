//! The axis in service: a sample at a time, the button that moves it, and the
//! numbers of its samples.

use firmware::axis::{Axis, AxisOutput, AxisState};
use firmware::hardware::{Board, serve};
use firmware::{Event, Motion, PlannedMotion, State};

/// A motion of a drive: up to 64 stretches.
pub type Planned = PlannedMotion<64>;

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
    state: AxisState,
    /// The electronics.
    pub board: B,
    forth: &'p Planned,
    back: &'p Planned,
    motion: Motion<'p>,
    /// Position at which the axis is held, or will be when its motion has ended \[counts\].
    target: i32,
    button: Button,
}

impl<'p, B: Board> Drive<'p, B> {
    /// Disabled; `forth` and `back` are opposite motions.
    pub fn new(axis: Axis, board: B, forth: &'p Planned, back: &'p Planned) -> Self {
        Self {
            state: AxisState::start(&axis),
            board,
            forth,
            back,
            motion: Motion::new(forth, 0),
            target: 0,
            button: Button::default(),
        }
    }

    /// Memory of the axis.
    pub const fn state(&self) -> &AxisState {
        &self.state
    }

    /// The sample number `tick`, with the level of the button.
    pub fn sample(&mut self, tick: u64, button_down: bool) -> AxisOutput {
        let free = !self.state.state().is_powered();
        if self.button.pressed(button_down) {
            self.press();
        }
        let output = serve(&mut self.state, &mut self.board, &mut self.motion, tick);
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
        let _ = self.state.request(event);
    }

    fn next_motion(&mut self) {
        let towards_end = i64::from(self.forth.end()) - i64::from(self.target);
        let from_start = i64::from(self.target);
        let plan = if from_start.abs() <= towards_end.abs() {
            self.forth
        } else {
            self.back
        };
        self.motion = Motion::new(plan, self.target);
        self.target = self.target.wrapping_add(plan.end());
    }
}

/// Samples that a level must last: 20 ms at 1 ms, longer than any bounce of
/// the small buttons on such boards.
const STEADY_SAMPLES: u8 = 20;

/// A push button without its bounces: finds the presses in the samples of a button.
///
/// One that is down when the program starts, or stuck, gives none: it must be
/// up first.
///
/// ```
/// use stm32f407_drive::Button;
///
/// let mut button = Button::default();
/// let mut presses = |down, samples| (0..samples).filter(|_| button.pressed(down)).count();
/// assert_eq!(presses(true, 100), 0);
/// assert_eq!(presses(false, 20), 0);
/// assert_eq!(presses(true, 19), 0);
/// assert_eq!(presses(true, 100), 1);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Button {
    down: bool,
    /// Samples in a row with the other level.
    other: u8,
}

impl Default for Button {
    fn default() -> Self {
        Self {
            down: true,
            other: 0,
        }
    }
}

impl Button {
    /// One sample of the level; whether a press begins with it.
    pub fn pressed(&mut self, down: bool) -> bool {
        if down == self.down {
            self.other = 0;
            return false;
        }
        self.other = self.other.saturating_add(1);
        if self.other < STEADY_SAMPLES {
            return false;
        }
        self.other = 0;
        self.down = down;
        down
    }
}

/// Turns a counter of 32 bits, which counts the sample times without the
/// program, into numbers of samples.
///
/// A sample that ends after the next one should have begun has not kept its
/// time, although none is missing: [`Ticks::overrun`] makes it count as one
/// more, so that the monitor over missed ticks sees both.
///
/// ```
/// use stm32f407_drive::Ticks;
///
/// let mut ticks = Ticks::default();
/// assert_eq!(ticks.number(u32::MAX), u64::from(u32::MAX));
/// assert_eq!(ticks.number(0), 1 << 32);
/// ticks.overrun();
/// assert_eq!(ticks.number(1), (1 << 32) + 2);
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct Ticks {
    counter: u32,
    number: u64,
}

impl Ticks {
    /// The number of the sample at which the counter reads `counter`; it is
    /// asked for more often than the counter wraps, every 49 days at 1 ms.
    pub fn number(&mut self, counter: u32) -> u64 {
        let passed = counter.wrapping_sub(self.counter);
        self.counter = counter;
        self.number = self.number.wrapping_add(u64::from(passed));
        self.number
    }

    /// The sample before has ended too late.
    pub fn overrun(&mut self) {
        self.number = self.number.wrapping_add(1);
    }
}
