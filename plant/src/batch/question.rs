//! Steps of a lane, or pieces of steps between changes of contact, in which a
//! figure may have exceeded its peak. Most are outdone by what comes later, so
//! they wait until they are many.

use super::group::Group;
use super::lanes::Shared;
use super::width::Width;
use crate::exact::{SLOPES, VALUES, command_slopes};
use crate::model::motion::Motion;
use crate::model::state::State;
use crate::numerics::seconds;
use crate::observe::extremes::{CARRIAGE, FIGURES};

/// A step to be looked at again, or a piece of one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question {
    /// Upper bounds of the figures' magnitudes; −∞ where there is no question.
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

/// The command over a step in Bernstein form: what each coefficient adds to the
/// one before it, and what it and its slope may be off by.
struct CommandRises {
    rises: [f64; SLOPES],
    off_m: f64,
    slope_off_m: f64,
}

impl CommandRises {
    fn new(motion: &Motion, question: &Question, length_ns: u64, bend_m: f64) -> Self {
        let (start_s, length_s) = (seconds(question.time_ns), seconds(length_ns));
        let end_s = start_s + length_s;
        if motion.breaks_s().iter().any(|&t| start_s < t && t < end_s) {
            // Its chord, which a_ref bends by T²/8 at most.
            let [start_m, end_m] = question.commands_m;
            return Self {
                rises: [(end_m - start_m) / 11.0; SLOPES],
                off_m: 0.125 * bend_m,
                slope_off_m: 0.5 * bend_m / 11.0,
            };
        }
        let (_, slopes, stray) = command_slopes(motion, start_s, length_s);
        Self {
            rises: slopes.map(|slope| slope / 11.0),
            off_m: stray,
            slope_off_m: stray / 11.0,
        }
    }
}

/// Twelve additions, and what the terms at the start have lost.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Questions of a lane that wait at most; how many may go on waiting without a
/// look at their sketches, and with one.
const MOST: usize = 96;
const KEPT_UNSEEN: usize = 64;
const KEPT: usize = 80;

/// Weights of the coefficients in the values at ¼, ½ and ¾.
const QUARTERS: [[f64; VALUES]; 3] = quarters();

const fn quarters() -> [[f64; VALUES]; 3] {
    let degree = VALUES - 1;
    let mut weights = [[0.0; VALUES]; 3];
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
        let mut place = 0;
        while place < 3 {
            weights[place][i] = power[place];
            place += 1;
        }
        choices *= (degree - i) as f64 / (i + 1) as f64;
        i += 1;
    }
    weights
}

impl<W: Width> Group<W> {
    /// Lets a question wait; if there are many, they are looked at.
    #[inline(always)]
    pub(super) fn ask(&mut self, shared: &mut Shared, lane: usize, question: Question) {
        if self.lanes[lane].questions.len() >= MOST {
            self.drop_outdone(lane);
            if self.lanes[lane].questions.len() > KEPT_UNSEEN {
                self.enclose_all(shared, lane);
            }
            if self.lanes[lane].questions.len() > KEPT {
                self.answer_all(shared, lane);
            }
        }
        self.lanes[lane].questions.push(question);
    }

    /// Answers all questions of a lane.
    #[inline(always)]
    pub(super) fn answer(&mut self, shared: &mut Shared, lane: usize) {
        if !self.lanes[lane].questions.is_empty() {
            self.drop_outdone(lane);
            self.enclose_all(shared, lane);
            self.answer_all(shared, lane);
        }
    }

    /// What a lane is known to reach.
    pub(super) fn known_of(&self, lane: usize) -> [f64; FIGURES] {
        core::array::from_fn(|i| {
            let (peak, end) = (
                self.peaks[i].as_ref()[lane],
                self.track.ends[i].as_ref()[lane],
            );
            peak.max(end).max(self.floors[i].as_ref()[lane])
        })
    }

    /// Drops the questions that are outdone.
    fn drop_outdone(&mut self, lane: usize) {
        let known = self.known_of(lane);
        let questions = &mut self.lanes[lane].questions;
        questions.retain(|question| exceeds(&question.upper, &known) != 0);
    }

    /// Lowers the upper bounds by the sketches, of the last question first: it is
    /// more likely to outdo the others.
    #[inline(always)]
    fn enclose_all(&mut self, shared: &Shared, lane: usize) {
        let mut questions = core::mem::take(&mut self.lanes[lane].questions);
        let mut known = self.known_of(lane);
        for question in questions.iter_mut().rev() {
            if !question.enclosed && question.piece.is_none() {
                let open = exceeds(&question.upper, &known);
                let mut command = None;
                for figure in (0..FIGURES).filter(|figure| open >> figure & 1 != 0) {
                    let floor = self.enclose(shared, (lane, figure), question, &mut command);
                    known[figure] = known[figure].max(floor);
                }
            }
            question.enclosed = true;
        }
        questions.retain(|question| exceeds(&question.upper, &known) != 0);
        self.lanes[lane].questions = questions;
        for (floor, known) in self.floors.iter_mut().zip(known) {
            let floor = &mut floor.as_mut()[lane];
            *floor = floor.max(known);
        }
    }

    /// Lowers the upper bound of a figure in a whole step; returns what it
    /// reaches for certain. `command` is kept from figure to figure.
    #[inline(always)]
    fn enclose(
        &self,
        shared: &Shared,
        (lane, figure): (usize, usize),
        question: &mut Question,
        command: &mut Option<CommandRises>,
    ) -> f64 {
        let phase = &shared.phases[question.phase];
        let run = &self.lanes[lane];
        let y = &question.state;
        let closed = question.flank != 0.0;
        let delta = y.epsilon_rad - question.flank * run.plant.axis.backlash_half_rad();
        let from = [y.beta_dot_radps, delta, y.epsilon_dot_radps, y.current_a];
        let rates = phase.rates.at(closed, &from, question.voltage_v);
        let p = shared.axis.pitch_m_per_rad();
        let start_m = question.commands_m[0];
        let start = match figure {
            0 => run.plant.acceleration_at_mps2(y, question.flank),
            1 => y.current_a,
            CARRIAGE => start_m - p * (y.beta_rad - y.epsilon_rad),
            _ => start_m - p * y.beta_rad,
        };
        let sketch = &phase.figures[figure];
        let mut rises = sketch.rises(closed, &rates);
        let mut off = sketch.stray(closed, &rates, start.abs());
        // The slope, per eleventh of a step, by which the polynomial is off.
        let mut slope_off = off / 11.0;
        if figure >= CARRIAGE {
            let command = match command {
                Some(command) => command,
                None => {
                    let bend_m = self.bend_m.as_ref()[lane];
                    let motion = &run.extremes.settings.motion;
                    command.insert(CommandRises::new(motion, question, phase.length_ns, bend_m))
                }
            };
            for (rise, of_command) in rises.iter_mut().zip(&command.rises) {
                *rise = of_command - *rise;
            }
            let size = (start_m.abs() + p * y.beta_rad.abs()) * ROUNDING;
            off += command.off_m + size;
            slope_off += command.slope_off_m + size;
        }
        let mut values = [start; VALUES];
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut upper = start.abs();
        for i in 1..VALUES {
            let rise = rises[i - 1];
            lowest = lowest.min(rise);
            highest = highest.max(rise);
            values[i] = values[i - 1] + rise;
            upper = upper.max(values[i].abs());
        }
        upper += off;
        let before = &mut question.upper[figure];
        if lowest.max(-highest) > slope_off {
            *before = f64::NEG_INFINITY;
        } else if *before > upper || before.is_nan() {
            *before = upper;
        }
        let mut floor = f64::NEG_INFINITY;
        for weights in &QUARTERS {
            let mut inner = 0.0;
            for (weight, value) in weights.iter().zip(&values) {
                inner += weight * value;
            }
            floor = floor.max(inner.abs() - off);
        }
        floor
    }

    /// Looks at all questions of a lane, the last first.
    #[cold]
    #[inline(never)]
    fn answer_all(&mut self, shared: &mut Shared, lane: usize) {
        while let Some(question) = self.lanes[lane].questions.pop() {
            let open = exceeds(&question.upper, &self.known_of(lane));
            if open == 0 {
                continue;
            }
            let run = &mut self.lanes[lane];
            run.raise(&self.peaks, lane);
            run.raise(&self.track.ends, lane);
            let mut plant = run.plant.at(&question.state, question.time_ns);
            plant.set_contact(question.flank);
            let (tables, extremes) = (&mut shared.tables, &mut run.extremes);
            let length_ns = shared.phases[question.phase].length_ns;
            let step = (question.voltage_v, length_ns);
            match question.piece {
                None => plant.look_at_step(tables, step, open, extremes),
                Some(piece) => {
                    let times_s = (piece.start_s, piece.length_s);
                    plant.look_at_piece(tables, step, times_s, (&piece.end, open), extremes);
                }
            }
            self.raise_floors(lane);
        }
    }

    /// Raises a lane's floors to the peaks of its single run.
    pub(super) fn raise_floors(&mut self, lane: usize) {
        let known = self.lanes[lane].extremes.peaks();
        for (floor, known) in self.floors.iter_mut().zip(known) {
            let floor = &mut floor.as_mut()[lane];
            *floor = floor.max(known);
        }
    }
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
