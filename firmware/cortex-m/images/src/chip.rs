//! Chip as the server asks for it.

use firmware::SetpointTable;
use firmware_link::{Identity, Target};
use parts::image;

use crate::board::{NAME, TABLE_CAPACITY, TICK_PARTS, TIMER_HZ};
use crate::processor::Timer;

/// Empty pairs that are measured, and parts into which a tick is divided.
///
/// A pair takes no whole number of SysTick's ticks, so that one measurement
/// says too little. 125 of them meet the timer at every phase that 128 ns an instruction
/// have against 40 or 62.5 ns a tick, and their sum is the pair's time in 125ths
/// of a tick without any error; a sample's own is then below one tick, which is
/// less than an instruction.
const PARTS: u32 = TICK_PARTS;

/// Frequency of what [`Target::elapsed`] counts \[Hz\].
const PARTS_HZ: u32 = TIMER_HZ * PARTS;

/// Timer, stack and identity.
#[derive(Debug)]
pub struct Chip {
    timer: Timer,
    started: u32,
    /// An empty measurement \[parts of a tick\].
    empty: u32,
}

impl Chip {
    /// Starts the timer and measures what an empty pair takes.
    pub fn at_start() -> Self {
        let mut chip = Self {
            timer: Timer::start(),
            started: 0,
            empty: 0,
        };
        let mut sum = 0_u32;
        for _ in 0..PARTS {
            chip.start();
            sum = sum.wrapping_add(chip.ticks());
        }
        chip.empty = sum;
        chip
    }

    /// Since [`Target::start`], with what the measurement itself takes. Never
    /// inlined, so that it takes the same everywhere.
    #[inline(never)]
    fn ticks(&mut self) -> u32 {
        self.timer.since(self.started)
    }
}

impl Target for Chip {
    fn identity(&self) -> Identity {
        image::identity::<SetpointTable<TABLE_CAPACITY>>(NAME, TABLE_CAPACITY, PARTS_HZ)
    }

    #[inline(never)]
    fn start(&mut self) {
        self.started = self.timer.now();
    }

    fn elapsed(&mut self) -> u32 {
        let parts = self.ticks().wrapping_mul(PARTS);
        parts.saturating_sub(self.empty)
    }

    fn stack_bytes(&self) -> u32 {
        image::deepest_stack_bytes()
    }
}
