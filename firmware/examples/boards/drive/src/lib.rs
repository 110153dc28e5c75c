//! The part of the boards' examples that knows no chip: the axis, its motion, the
//! button that starts it. It is the one place that calls the firmware; a
//! board brings [`Panel`], and calls [`Drive::sample`] every [`PERIOD_US`].
//!
//! | state | a press of the button |
//! | --- | --- |
//! | disabled | power on, and 25 mm forth in 1 s: keep them free |
//! | enabled, moving, holding | power off |
//! | fault | leaves the fault, the power stays off |

#![no_std]

#[allow(
    clippy::panic,
    clippy::unreadable_literal,
    reason = "as printed; a constant ends the build where something is refused"
)]
#[rustfmt::skip]
mod axis;

use core::cell::Cell;

use critical_section::Mutex;
use firmware::axis::{AxisOutput, AxisState};
use firmware::hardware::serve;
use firmware::{Board, Event, Fault, Motion, MotionPlan, PlannedMotion, State};
use static_cell::StaticCell;

pub use axis::AXIS;

/// `Δt` \[µs\].
pub const PERIOD_US: u32 = 1_000;

/// Full scale of the output: a PWM of so many counts a period has the 13 bits of
/// [`AXIS`], one bit of them the direction.
pub const PWM_COUNTS: u16 = 4_096;

/// Samples of 20 ms: a button's bounces are shorter.
const STEADY_SAMPLES: u8 = 20;

/// A motion of at most 64 stretches, 4 KiB.
type Planned = PlannedMotion<64>;

/// What a drive asks of a board besides [`Board`].
pub trait Panel: Board {
    /// Steps of [`Panel::counter`] in a sample.
    const COUNTS_PER_SAMPLE: u32;

    /// A counter that goes on without the program, through all 32 bits, so that
    /// a sample that is left out shows in it.
    fn counter(&self) -> u32;

    /// Level of the button.
    fn button_is_down(&self) -> bool;

    /// Tells the watchdog that the samples come.
    fn feed(&mut self);
}

/// The duties of both inputs of an H-bridge for a code, forth and back.
pub fn duties(code: i32) -> [u16; 2] {
    [code.max(0), code.min(0)].map(|part| {
        let counts = part.unsigned_abs().min(PWM_COUNTS.into());
        u16::try_from(counts).unwrap_or(0)
    })
}

/// Counts of a quadrature encoder, from its levels, for a chip that has no counter.
pub struct Quadrature {
    levels: [bool; 2],
}

impl Quadrature {
    /// Counts from these levels of A and B on.
    pub const fn new(levels: [bool; 2]) -> Self {
        Self { levels }
    }

    /// One count forth where A leads B, one back where B leads A; `None` where both
    /// have changed: one of the edges is lost.
    pub fn step(&mut self, levels: [bool; 2]) -> Option<i32> {
        let [a_before, b_before] = core::mem::replace(&mut self.levels, levels);
        let [a, b] = levels;
        match (a != a_before, b != b_before) {
            (false, false) => Some(0),
            (true, true) => None,
            _ if a_before == b => Some(1),
            _ => Some(-1),
        }
    }
}

/// The axis on its board.
pub struct Drive<B> {
    board: B,
    state: AxisState,
    planned: &'static Planned,
    motion: Motion<'static>,
    /// Counter at the last sample, as it would be without any lateness.
    counter: Option<u32>,
    tick: u64,
    /// Samples that the button is down.
    down: u8,
}

impl<B: Panel> Drive<B> {
    /// Disabled; none for a second drive, or if there is no such motion.
    pub fn new(board: B) -> Option<Self> {
        static PLANNED: StaticCell<Planned> = StaticCell::new();
        let quarter_ps = 250_000_000_000;
        let intervals_ps = [quarter_ps, 0, quarter_ps, 0, quarter_ps, 0, quarter_ps];
        let plan = MotionPlan::new(10_000 << 32, intervals_ps, PERIOD_US * 1_000).ok()?;
        let planned = Planned::new(&plan, AXIS.law().words()).ok()?;
        let planned: &Planned = PLANNED.try_init(planned)?;
        Some(Self {
            board,
            state: AxisState::start(&AXIS),
            planned,
            motion: Motion::new(planned, 0),
            counter: None,
            tick: 0,
            // One that is stuck down starts nothing.
            down: u8::MAX,
        })
    }

    /// Runs the sample that begins now.
    pub fn sample(&mut self) -> AxisOutput {
        self.board.feed();
        self.count();
        self.down = if self.board.button_is_down() {
            self.down.saturating_add(1)
        } else {
            0
        };
        if self.down == STEADY_SAMPLES {
            self.press();
        }
        let (state, board) = (&mut self.state, &mut self.board);
        serve(state, board, &mut self.motion, self.tick)
    }

    /// The fault that is latched.
    pub fn fault(&self) -> Option<&Fault> {
        self.state.fault()
    }

    /// Numbers the sample: the nearest, whose interrupt may be up to half a
    /// sample late.
    fn count(&mut self) {
        let now = self.board.counter();
        let last = self.counter.unwrap_or(now);
        let half = B::COUNTS_PER_SAMPLE / 2;
        let passed = now.wrapping_sub(last).wrapping_add(half) / B::COUNTS_PER_SAMPLE;
        self.counter = Some(last.wrapping_add(passed * B::COUNTS_PER_SAMPLE));
        self.tick += u64::from(passed);
    }

    fn press(&mut self) {
        let events: &[Event] = match self.state.state() {
            State::Fault => &[Event::Reset],
            State::Disabled => {
                let start = self.state.position().unwrap_or(0);
                self.motion = Motion::new(self.planned, start);
                &[Event::Enable, Event::Start]
            }
            State::Enabled | State::Moving | State::Holding => &[Event::Disable],
        };
        for event in events {
            // Each is one that its state allows.
            let _ = self.state.request(*event);
        }
    }
}

/// The place at which a program leaves its drive for the interrupt of a sample.
pub struct Slot<T: 'static>(Mutex<Cell<Option<&'static mut T>>>);

impl<T: Send> Slot<T> {
    /// Still empty.
    pub const fn new() -> Self {
        Self(Mutex::new(Cell::new(None)))
    }

    /// Puts the drive there.
    pub fn put(&self, drive: &'static mut T) {
        critical_section::with(|section| self.0.borrow(section).set(Some(drive)));
    }

    /// Runs `sample` with the drive, if it is there; other interrupts are let in.
    pub fn with(&self, sample: impl FnOnce(&mut T)) {
        if let Some(drive) = critical_section::with(|section| self.0.borrow(section).take()) {
            sample(drive);
            self.put(drive);
        }
    }
}

impl<T: Send> Default for Slot<T> {
    fn default() -> Self {
        Self::new()
    }
}
