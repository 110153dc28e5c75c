//! Steps of a group that have not been looked at: the last ones, and those that
//! wait as candidates for an extreme.

use super::width::Width;
use crate::exact::{DRIVING, HELD};
use crate::model::state::State;
use crate::observe::extremes::FIGURES;

/// Places for the steps that have not been looked at, and for now.
pub(super) const PLACES: usize = 32;

/// Steps of a block: two of them, the step that is taken, and now.
const BLOCK: usize = PLACES / 2 - 1;

/// What a step begins with.
#[derive(Debug, Clone)]
pub(super) struct Slot<W: Width> {
    /// β, β̇, ε, ε̇, I.
    pub(super) state: [W::Array; HELD],
    /// The flank in contact: −1, 0 or 1; 1 without a gap.
    pub(super) flank: W::Array,
    /// x_ref \[m\].
    pub(super) command_m: W::Array,
    pub(super) time_ns: u64,
    /// What it is made with.
    pub(super) voltage_v: W::Array,
    pub(super) phase: usize,
    /// The lanes that leave it.
    pub(super) moved: u64,
}

/// Steps that have not been looked at, and what is largest within them.
#[derive(Debug, Clone)]
pub(super) struct Track<W: Width> {
    pub(super) slots: Box<[Slot<W>; PLACES]>,
    /// Steps taken; those from `first` on have not been looked at, those from
    /// `second` on are of the present block.
    pub(super) now: usize,
    pub(super) first: usize,
    pub(super) second: usize,
    /// Of the present block: sup of the figures' magnitudes over the ends of its
    /// steps, over what its first one and those after a change of contact begin
    /// with, and of the changes of the driving states.
    pub(super) ends: [W::Array; FIGURES],
    pub(super) starts: [W::Array; FIGURES],
    pub(super) changes: [W::Array; DRIVING],
    /// Of the block before: the larger of the first two, and the third.
    pub(super) sizes_before: [W::Array; FIGURES],
    pub(super) changes_before: [W::Array; DRIVING],
}

impl<W: Width> Track<W> {
    pub(super) fn new() -> Self {
        let zero = W::array(0.0);
        let slot = Slot {
            state: [zero; HELD],
            flank: zero,
            command_m: zero,
            time_ns: 0,
            voltage_v: zero,
            phase: 0,
            moved: 0,
        };
        Self {
            slots: Box::new(core::array::from_fn(|_| slot.clone())),
            now: 0,
            first: 0,
            second: 0,
            ends: [zero; FIGURES],
            starts: [zero; FIGURES],
            changes: [zero; DRIVING],
            sizes_before: [zero; FIGURES],
            changes_before: [zero; DRIVING],
        }
    }

    /// At rest at zero.
    pub(super) fn start(&mut self) {
        let zero = W::array(0.0);
        (self.now, self.first, self.second) = (0, 0, 0);
        let slot = &mut self.slots[0];
        slot.state = [zero; HELD];
        (slot.flank, slot.command_m, slot.time_ns) = (zero, zero, 0);
        (self.ends, self.starts) = ([zero; FIGURES], [zero; FIGURES]);
        self.changes = [zero; DRIVING];
    }

    /// What the next step begins with.
    #[inline(always)]
    pub(super) fn now(&self) -> &Slot<W> {
        &self.slots[self.now % PLACES]
    }

    #[inline(always)]
    pub(super) fn now_mut(&mut self) -> &mut Slot<W> {
        &mut self.slots[self.now % PLACES]
    }

    /// Takes a step, which the lanes of `moved` leave; returns where it ends.
    #[inline(always)]
    pub(super) fn step(
        &mut self,
        w: W,
        (phase, length_ns): (usize, u64),
        voltage_v: W::Vector,
        moved: u64,
    ) -> &mut Slot<W> {
        let slot = self.now_mut();
        w.store(voltage_v, &mut slot.voltage_v);
        (slot.phase, slot.moved) = (phase, moved);
        let (flank, time_ns) = (slot.flank, slot.time_ns + length_ns);
        self.now += 1;
        let slot = self.now_mut();
        (slot.flank, slot.time_ns) = (flank, time_ns);
        slot
    }

    /// Whether the present block is full.
    #[inline(always)]
    pub(super) fn block_is_full(&self) -> bool {
        self.now - self.second == BLOCK
    }
}

/// A step to be looked at again, or a piece of one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// Upper bounds of the figures' magnitudes; −∞ where there is no candidate.
    pub(super) upper: [f64; FIGURES],
    pub(super) state: State,
    /// The flank in contact: −1, 0 or 1.
    pub(super) flank: f64,
    pub(super) voltage_v: f64,
    pub(super) phase: usize,
    pub(super) time_ns: u64,
    /// x_ref at both ends of a whole step \[m\].
    pub(super) commands_m: [f64; 2],
    /// The piece, where it is one.
    pub(super) piece: Option<Piece>,
    /// Whether the upper bounds are those of the sketches.
    pub(super) enclosed: bool,
}

/// A piece of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) start_s: f64,
    pub(super) length_s: f64,
    pub(super) end: State,
}

/// The figures whose upper bounds exceed what is known, as bits.
pub(super) fn exceeds(upper: &[f64; FIGURES], known: &[f64; FIGURES]) -> u8 {
    let mut open = 0;
    for (i, (upper, known)) in upper.iter().zip(known).enumerate() {
        let outdone = upper <= known;
        open |= u8::from(!outdone) << i;
    }
    open
}
