//! The last steps of a group, and whether a figure may exceed its peak within
//! them, between the ends.
//!
//! Steps are looked at a block at a time, one block late: by then most are
//! outdone. The largest change of each state in a block bounds how far a figure
//! may stray from its ends; only where that leaves a question open are the steps
//! looked at one by one.

use super::group::Group;
use super::lanes::Shared;
use super::phase::{DRIVING, dot_pairs};
use super::question::Question;
use super::width::Width;
use crate::exact::HELD;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT};
use crate::observe::extremes::{CARRIAGE, FIGURES};

/// Places for the steps that have not been looked at, and for now.
const PLACES: usize = 32;

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
    voltage_v: W::Array,
    phase: usize,
    /// The lanes that leave it.
    moved: u64,
}

/// Steps that have not been looked at, and what is largest within them.
#[derive(Debug, Clone)]
pub(super) struct Track<W: Width> {
    slots: Box<[Slot<W>; PLACES]>,
    /// Steps taken; those from `first` on have not been looked at, those from
    /// `second` on are of the present block.
    now: usize,
    first: usize,
    second: usize,
    /// Of the present block: sup of the figures' magnitudes over the ends of its
    /// steps, over what its first one and those after a change of contact begin
    /// with, and of the changes of the driving states.
    pub(super) ends: [W::Array; FIGURES],
    pub(super) starts: [W::Array; FIGURES],
    pub(super) changes: [W::Array; DRIVING],
    /// Of the block before: the larger of the first two, and the third.
    sizes_before: [W::Array; FIGURES],
    changes_before: [W::Array; DRIVING],
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

impl<W: Width> Group<W> {
    /// Looks at the block before the present one, which takes its place.
    #[inline(always)]
    pub(super) fn change_block(&mut self, shared: &mut Shared) {
        let w = self.width;
        for (peak, end) in self.peaks.iter_mut().zip(&self.track.ends) {
            w.store(w.max(w.load(peak), w.load(end)), peak);
        }
        self.look_at_block(shared);
        let figures = self.figures_at(shared, self.track.now());
        let track = &mut self.track;
        for (i, figure) in figures.into_iter().enumerate() {
            let size = w.max(w.load(&track.ends[i]), w.load(&track.starts[i]));
            w.store(size, &mut track.sizes_before[i]);
            w.store(w.abs(figure), &mut track.starts[i]);
        }
        track.changes_before = track.changes;
        track.ends = [W::array(0.0); FIGURES];
        track.changes = [W::array(0.0); DRIVING];
        (track.first, track.second) = (track.second, track.now);
    }

    /// Looks at the block before the present one.
    #[inline(always)]
    fn look_at_block(&mut self, shared: &mut Shared) {
        let (w, track) = (self.width, &self.track);
        if track.first == track.second {
            return;
        }
        let all = (1_u64 << W::LANES) - 1;
        let half_bend = w.load(&self.bend_m) * w.splat(0.125);
        let mut open = [false; FIGURES];
        for (i, open) in open.iter_mut().enumerate() {
            let mut chord = w.splat(0.0);
            for (most, change) in shared.most_chords[i].iter().zip(&track.changes_before) {
                chord = chord + w.splat(*most) * w.load(change);
            }
            if i >= CARRIAGE {
                chord = chord + half_bend;
            }
            let upper = w.load(&track.sizes_before[i]) + chord;
            *open = w.bits(w.at_most(upper, self.known(i))) & all != all;
        }
        if open == [false; FIGURES] {
            return;
        }
        for step in (track.first..track.second).rev() {
            self.look_at_step(shared, step, open);
        }
    }

    /// What the lanes are known to reach.
    #[inline(always)]
    fn known(&self, figure: usize) -> W::Vector {
        let w = self.width;
        w.max(w.load(&self.floors[figure]), w.load(&self.peaks[figure]))
    }

    /// Looks at the figures of `open` within a step; where they may exceed their
    /// peaks, it has to wait for a closer look.
    #[inline(always)]
    fn look_at_step(&mut self, shared: &mut Shared, step: usize, open: [bool; FIGURES]) {
        let w = self.width;
        let all = (1_u64 << W::LANES) - 1;
        let slots = &self.track.slots;
        let (from, to) = (&slots[step % PLACES], &slots[(step + 1) % PLACES]);
        let phase = &shared.phases[from.phase];
        let closed = w.greater(w.abs(w.load(&from.flank)), w.splat(0.5));
        let mut changes = [w.splat(0.0); DRIVING];
        for (change, state) in changes
            .iter_mut()
            .zip([BETA_DOT, EPSILON, EPSILON_DOT, CURRENT])
        {
            *change = w.abs(w.load(&to.state[state]) - w.load(&from.state[state]));
        }
        let never = w.splat(f64::NEG_INFINITY);
        let mut uppers = [W::array(f64::NEG_INFINITY); FIGURES];
        let mut lanes = 0;
        for i in (0..FIGURES).filter(|&i| open[i]) {
            let start = self.figure_at(shared, from, (closed, i));
            let end = self.figure_at(shared, to, (closed, i));
            let size = w.max(w.abs(start), w.abs(end));
            let mut chord = dot_pairs(w, closed, &phase.chords[i], &changes);
            if i >= CARRIAGE {
                chord = chord + w.load(&self.bend_m) * w.splat(0.125);
            }
            let upper = size + chord;
            let below = w.at_most(upper, self.known(i));
            if (w.bits(below) | from.moved) & all == all {
                continue;
            }
            let mut slope = dot_pairs(w, closed, &phase.slopes[i], &changes);
            if i >= CARRIAGE {
                slope = slope + w.load(&self.bend_m) * w.splat(0.5);
            }
            let outdone = w.either(below, w.greater(w.abs(end - start), slope));
            w.store(w.select(outdone, never, upper), &mut uppers[i]);
            lanes |= !(w.bits(outdone) | from.moved) & all;
        }
        for lane in (0..self.runs).filter(|lane| lanes >> lane & 1 != 0) {
            let slots = &self.track.slots;
            let (from, to) = (&slots[step % PLACES], &slots[(step + 1) % PLACES]);
            let of = |array: &W::Array| array.as_ref()[lane];
            let question = Question {
                upper: uppers.each_ref().map(of),
                state: super::group::state_of::<W>(&from.state, lane),
                flank: of(&from.flank),
                voltage_v: of(&from.voltage_v),
                phase: from.phase,
                time_ns: from.time_ns,
                commands_m: [of(&from.command_m), of(&to.command_m)],
                piece: None,
                enclosed: false,
            };
            self.ask(shared, lane, question);
        }
    }

    /// The figures at a slot.
    #[inline(always)]
    fn figures_at(&self, shared: &Shared, slot: &Slot<W>) -> [W::Vector; FIGURES] {
        let w = self.width;
        let closed = w.greater(w.abs(w.load(&slot.flank)), w.splat(0.5));
        let mut figures = [w.splat(0.0); FIGURES];
        for (i, figure) in figures.iter_mut().enumerate() {
            *figure = self.figure_at(shared, slot, (closed, i));
        }
        figures
    }

    /// A figure at a slot, with the joint open or closed.
    #[inline(always)]
    fn figure_at(
        &self,
        shared: &Shared,
        slot: &Slot<W>,
        (closed, figure): (W::Mask, usize),
    ) -> W::Vector {
        let w = self.width;
        let axis = &shared.axis;
        let p = w.splat(axis.pitch_m_per_rad());
        let y = |state: usize| w.load(&slot.state[state]);
        match figure {
            0 => {
                let mut torque = w.splat(0.0);
                if let Some(joint) = axis.joint {
                    let delta = y(EPSILON) - w.load(&slot.flank) * w.load(&self.backlash_half_rad);
                    let carries = w.splat(joint.stiffness_nm_per_rad) * delta
                        + w.splat(joint.damping_nms_per_rad) * y(EPSILON_DOT);
                    torque = w.select(closed, carries, torque);
                } else {
                    let motor = axis.motor().torque_constant_nm_per_a / axis.gear_ratio();
                    torque = w.splat(motor) * y(CURRENT);
                }
                let a1 = w.splat(axis.resistance().linear_ns_per_rad);
                let force = w.load(&self.mode.resistance_n) + a1 * (y(BETA_DOT) - y(EPSILON_DOT));
                p * ((torque - p * force) / w.splat(axis.moved_inertia()))
            }
            1 => y(CURRENT),
            CARRIAGE => w.load(&slot.command_m) - p * (y(BETA) - y(EPSILON)),
            _ => w.load(&slot.command_m) - p * y(BETA),
        }
    }

    /// Looks at all steps that have not been looked at.
    #[inline(always)]
    pub(super) fn look_at_track(&mut self, shared: &mut Shared) {
        self.change_block(shared);
        self.change_block(shared);
    }
}
