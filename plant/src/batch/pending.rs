//! Steps in which a figure may have exceeded its peak between the ends. Most are
//! outdone by later ones, so they wait until they are many.

use super::lanes::{Batch, state_of};
use super::phase::{DRIVING, closed_lanes};
use super::width::Width;
use crate::exact::{CARRIAGE, FIGURES, HELD, VALUES};

/// A step to be looked at again, lane by lane.
#[derive(Debug, Clone)]
pub(crate) struct Pending<W: Width> {
    /// Upper bounds of the figures' magnitudes; −∞ where there is no question.
    pub(crate) upper: [W::Array; FIGURES],
    /// The figures at the start.
    pub(crate) figures: [W::Array; FIGURES],
    /// How far the command moves within the step \[m\].
    pub(crate) command_m: W::Array,
    /// Size of what the following errors are the differences of \[m\].
    pub(crate) size_m: W::Array,
    pub(crate) time_ns: u64,
    pub(crate) phase: usize,
    pub(crate) state: [W::Array; HELD],
    pub(crate) offset_rad: W::Array,
    /// The flank in contact, and whether the joint is closed.
    pub(crate) joint: W::Array,
    pub(crate) closed: W::Array,
    pub(crate) voltage_v: W::Array,
    /// Whether the upper bounds are those of the sketches.
    pub(crate) enclosed: bool,
}

/// Steps that wait at most, and how many may go on waiting.
pub(crate) const MOST_PENDING: usize = 64;
pub(crate) const KEPT_PENDING: usize = 16;

/// Weights of the coefficients in the values at ¼, ½ and ¾.
const QUARTERS: [[f64; 3]; VALUES] = quarters();

const fn quarters() -> [[f64; 3]; VALUES] {
    let degree = VALUES - 1;
    let mut weights = [[0.0; 3]; VALUES];
    let (mut i, mut choices) = (0, 1.0);
    while i < VALUES {
        let mut power = [choices; 3];
        let mut factor = 0;
        while factor < degree {
            let up = factor < i;
            power[0] *= if up { 0.25 } else { 0.75 };
            power[1] *= 0.5;
            power[2] *= if up { 0.75 } else { 0.25 };
            factor += 1;
        }
        weights[i] = power;
        choices *= (degree - i) as f64 / (i + 1) as f64;
        i += 1;
    }
    weights
}

impl<W: Width> Batch<W> {
    /// Drops the pending steps that are outdone, by closer bounds where need be.
    #[inline(always)]
    pub(crate) fn sift(&mut self) {
        let mut pending = core::mem::take(&mut self.pending);
        let mut kept = 0;
        // The last first: it is more likely to outdo the others.
        for place in (0..pending.len()).rev() {
            let step = &mut pending[place];
            for figure in 0..FIGURES {
                if !step.enclosed && self.is_open(step, figure) {
                    self.enclose(step, figure);
                }
            }
            step.enclosed = true;
        }
        for place in 0..pending.len() {
            let mut open = false;
            for figure in 0..FIGURES {
                open |= self.is_open(&pending[place], figure);
            }
            if open {
                pending.swap(kept, place);
                kept += 1;
            }
        }
        pending.truncate(kept);
        self.pending = pending;
    }

    /// Whether a pending step could still raise a figure of any lane.
    #[inline(always)]
    fn is_open(&self, step: &Pending<W>, figure: usize) -> bool {
        let w = self.width;
        let all = (1_u64 << W::LANES) - 1;
        let (floor, peak) = (w.load(&self.floors[figure]), w.load(&self.peaks[figure]));
        let outdone = w.at_most(w.load(&step.upper[figure]), w.larger(floor, peak));
        w.bits(outdone) & all != all
    }

    /// Lowers the upper bounds of a figure in a pending step, and raises the
    /// floors that others must exceed.
    #[inline(always)]
    fn enclose(&mut self, step: &mut Pending<W>, figure: usize) {
        let (w, phase) = (self.width, &self.phases[step.phase]);
        let (zero, never) = (w.splat(0.0), w.splat(f64::NEG_INFINITY));
        let idle = w.at_most(w.load(&step.upper[figure]), never);
        let closed = closed_lanes(w, &step.closed);
        let from: [W::Vector; DRIVING] = [
            w.load(&step.state[1]),
            w.load(&step.state[2]) - w.load(&step.offset_rad),
            w.load(&step.state[3]),
            w.load(&step.state[4]),
        ];
        let rates = phase.rates.at(w, closed, &from, w.load(&step.voltage_v));
        // The command as its chord, which a_ref bends by T²/8 at most.
        let (mut moves, mut bend, mut sign) = (zero, zero, w.splat(1.0));
        if figure >= CARRIAGE {
            moves = w.load(&step.command_m) / w.splat(11.0);
            bend = w.load(&self.bend_m) * w.splat(0.125);
            sign = w.splat(-1.0);
        }
        let start = w.load(&step.figures[figure]);
        let (mut value, mut upper) = (start, w.abs(start));
        let mut inner = [zero; 3];
        for (sum, weight) in inner.iter_mut().zip(&QUARTERS[0]) {
            *sum = start * w.splat(*weight);
        }
        let (mut lowest, mut highest) = (w.splat(f64::INFINITY), never);
        let sketch = &phase.figures[figure];
        let rises = sketch.rises(w, closed, &rates);
        for (rise, weights) in rises.into_iter().zip(&QUARTERS[1..]) {
            let rise = sign * rise + moves;
            lowest = w.smaller(rise, lowest);
            highest = w.larger(rise, highest);
            value = value + rise;
            upper = w.larger(w.abs(value), upper);
            for (sum, weight) in inner.iter_mut().zip(weights) {
                *sum = *sum + value * w.splat(*weight);
            }
        }
        let size = w.abs(start) + w.load(&step.size_m);
        let own = sketch.stray(w, closed, &rates, size);
        // The slope, per eleventh of a step, by which the polynomial is off.
        let off = (own + bend * w.splat(4.0)) / w.splat(11.0);
        let monotone = w.greater(w.larger(lowest, zero - highest), off);
        // The new one where the old one is not a number.
        upper = w.smaller(w.load(&step.upper[figure]), upper + (own + bend));
        upper = w.select(idle, never, w.select(monotone, never, upper));
        w.store(upper, &mut step.upper[figure]);
        let old = w.load(&self.floors[figure]);
        let mut floor = old;
        for value in inner {
            floor = w.larger(w.abs(value) - (own + bend), floor);
        }
        w.store(w.select(idle, old, floor), &mut self.floors[figure]);
    }

    /// Looks at all pending steps, the last first.
    #[cold]
    #[inline(never)]
    pub(crate) fn answer_all(&mut self) {
        let mut pending = core::mem::take(&mut self.pending);
        for step in pending.drain(..).rev() {
            for lane in 0..W::LANES {
                let questions = self.questions(&step, lane);
                if questions != 0 {
                    self.answer(&step, lane, questions);
                }
            }
        }
        self.pending = pending;
    }

    /// Which figures of a lane a pending step could still raise.
    fn questions(&self, step: &Pending<W>, lane: usize) -> u8 {
        let mut questions = 0;
        let known = self.lanes[lane].extremes.peaks();
        for (i, known) in known.into_iter().enumerate() {
            let peak = self.peaks[i].as_ref()[lane].max(known);
            let floor = peak.max(self.floors[i].as_ref()[lane]);
            let outdone = step.upper[i].as_ref()[lane] <= floor;
            questions |= u8::from(!outdone) << i;
        }
        questions
    }

    /// Looks at one lane of a pending step.
    fn answer(&mut self, step: &Pending<W>, lane: usize, questions: u8) {
        let run = &mut self.lanes[lane];
        run.raise(&self.peaks, lane);
        let state = state_of::<W>(&step.state, lane);
        let mut plant = run.plant.at(&state, step.time_ns);
        plant.set_contact(step.joint.as_ref()[lane]);
        plant.look(
            &mut self.tables,
            step.voltage_v.as_ref()[lane],
            self.phases[step.phase].length_ns,
            questions,
            &mut run.extremes,
        );
        self.raise_floors(lane);
    }

    /// Raises a lane's floors to the peaks of its single run.
    pub(crate) fn raise_floors(&mut self, lane: usize) {
        let known = self.lanes[lane].extremes.peaks();
        for (floor, known) in self.floors.iter_mut().zip(known) {
            let floor = &mut floor.as_mut()[lane];
            *floor = floor.max(known);
        }
    }
}
