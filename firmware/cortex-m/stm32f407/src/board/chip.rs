//! Chip as the link's server asks for it: name, image, time, stack.

use cortex_m::peripheral::{DCB, DWT};
use firmware::{CAPACITY, SetpointTable};
use firmware_link::{Identity, Target};
use parts::image;

use super::clock::Clocks;

/// Empty measurements, of which the shortest counts: the caches are warm then.
const EMPTY_PAIRS: u32 = 8;

/// Cycle counter, stack and identity.
#[derive(Debug)]
pub(super) struct Chip {
    identity: Identity,
    started: u32,
    /// Cycles of an empty measurement.
    empty: u32,
}

impl Chip {
    /// Starts the cycle counter, and reads the image.
    pub(super) fn start(mut dcb: DCB, mut dwt: DWT, clocks: &Clocks) -> Self {
        dcb.enable_trace();
        dwt.set_cycle_count(0);
        dwt.enable_cycle_counter();
        let mut chip = Self {
            identity: image::identity::<SetpointTable<CAPACITY>>(
                *b"f407\0\0\0\0",
                CAPACITY,
                clocks.core_hz,
            ),
            started: 0,
            empty: 0,
        };
        let mut shortest = u32::MAX;
        for _ in 0..EMPTY_PAIRS {
            chip.start();
            shortest = shortest.min(chip.elapsed());
        }
        chip.empty = shortest;
        chip
    }
}

impl Target for Chip {
    fn identity(&self) -> Identity {
        self.identity
    }

    /// Holds interrupts back until [`Target::elapsed`]: a sample takes less than
    /// a byte on the line does, so none is lost.
    fn start(&mut self) {
        cortex_m::interrupt::disable();
        self.started = DWT::cycle_count();
    }

    fn elapsed(&mut self) -> u32 {
        let cycles = DWT::cycle_count().wrapping_sub(self.started);
        // SAFETY: they were held back by `start`, in the main loop and in no
        // critical section.
        unsafe { cortex_m::interrupt::enable() };
        cycles.saturating_sub(self.empty)
    }

    fn stack_bytes(&self) -> u32 {
        image::deepest_stack_bytes()
    }
}
