//! Peaks between the ends of the steps.
//!
//! Steps are looked at a block at a time, one block late: by then most are
//! outdone. The largest rate of each state in a block bounds how far a figure
//! may stray from its ends; only where that leaves it open are the steps looked
//! at one by one. A step in which a figure may have exceeded its peak, or a piece
//! of one between changes of contact, is a candidate. Most of these are outdone
//! by what comes later, so they wait until they are many: a search by branch and
//! bound.

use super::group::{Candidate, Group, PLACES, Shared, Slot, exceeds, state_of, values_of};
use super::phase::{Kind, times_sizes_of};
use crate::exact::{DRIVING, SLOPES, VALUES, command_slopes, left_of, times_sizes};
use crate::model::motion::Motion;
use crate::model::state::{BETA, CURRENT, EPSILON};
use crate::numerics::seconds;
use crate::numerics::width::{One, Width};
use crate::observe::extremes::{CARRIAGE, FIGURES, POWER};

/// The command over a step or a piece of one in Bernstein form: where it starts, what each
/// coefficient adds to the one before it, and what it and its slope may be off by.
struct CommandRises {
    start_m: f64,
    rises: [f64; SLOPES],
    off_m: f64,
    slope_off_m: f64,
}

impl CommandRises {
    fn new(motion: &Motion, (start_s, length_s): (f64, f64), bend_m: f64) -> Self {
        let end_s = start_s + length_s;
        if !motion.breaks_between(start_s, end_s).is_empty() {
            // Its chord, which a_ref bends by T²/8 at most.
            let [start_m, end_m] = [start_s, end_s].map(|t| motion.at(t).displacement_m);
            return Self {
                start_m,
                rises: [(end_m - start_m) / 11.0; SLOPES],
                off_m: 0.125 * bend_m,
                slope_off_m: 0.5 * bend_m / 11.0,
            };
        }
        let (start_m, slopes, stray) = command_slopes(motion, start_s, length_s);
        Self {
            start_m,
            rises: slopes.map(|slope| slope / 11.0),
            off_m: stray,
            slope_off_m: stray / 11.0,
        }
    }
}

/// Twelve additions, and what the terms at the start have lost.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Candidates of a lane that wait at most; how many may go on waiting without a
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
    /// Looks at what still waits for a look.
    #[inline(always)]
    pub(super) fn look_back(&mut self, shared: &mut Shared) {
        self.look_at_track(shared);
        for lane in 0..W::LANES {
            self.resolve(shared, lane);
        }
    }

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
        track.rates_before = track.rates;
        track.voltage_before_v = track.voltage_v;
        let peak_v = w.max(w.load(&track.voltage_v), w.load(&self.peak_abs_voltage_v));
        w.store(peak_v, &mut self.peak_abs_voltage_v);
        track.voltage_v = W::array(0.0);
        track.ends = [W::array(0.0); FIGURES];
        track.rates = [W::array(0.0); DRIVING];
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
        let sizes = track.rates_before.each_ref().map(
            #[inline(always)]
            |array| w.load(array),
        );
        for (i, open) in open.iter_mut().enumerate() {
            let mut chord = times_sizes(w, &shared.most_chords[i], &sizes);
            if (CARRIAGE..POWER).contains(&i) {
                chord = chord + half_bend;
            } else if i == POWER {
                chord = w.load(&track.voltage_before_v) * chord;
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

    /// Magnitudes that the lanes are known to reach.
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
        let sizes = self.rate_sizes(shared, from);
        let never = w.splat(f64::NEG_INFINITY);
        let mut uppers = [W::array(f64::NEG_INFINITY); FIGURES];
        let mut lanes = 0;
        for i in (0..FIGURES).filter(|&i| open[i]) {
            let mut start = self.figure_at(shared, from, i);
            let mut end = self.figure_at(shared, to, i);
            let mut chord = times_sizes_of(w, closed, &phase.chords[i], &sizes);
            // The power is under one voltage all along.
            let size_v = w.abs(w.load(&from.voltage_v));
            if i == POWER {
                for per_volt in [&mut start, &mut end, &mut chord] {
                    *per_volt = size_v * *per_volt;
                }
            }
            let size = w.max(w.abs(start), w.abs(end));
            if (CARRIAGE..POWER).contains(&i) {
                chord = chord + w.load(&self.bend_m) * w.splat(0.125);
            }
            let upper = size + chord;
            let below = w.at_most(upper, self.known(i));
            if (w.bits(below) | from.moved) & all == all {
                continue;
            }
            let mut slope = times_sizes_of(w, closed, &phase.slopes[i], &sizes);
            if i == POWER {
                slope = size_v * slope;
            } else if i >= CARRIAGE {
                slope = slope + w.load(&self.bend_m) * w.splat(0.5);
            }
            let outdone = w.either(below, w.greater(w.abs(end - start), slope));
            w.store(w.select(outdone, never, upper), &mut uppers[i]);
            lanes |= !(w.bits(outdone) | from.moved) & all;
        }
        for lane in (0..self.runs).filter(|lane| lanes >> lane & 1 != 0) {
            let from = &self.track.slots[step % PLACES];
            let of = |array: &W::Array| array.as_ref()[lane];
            let candidate = Candidate {
                upper: uppers.each_ref().map(of),
                state: state_of::<W>(&from.state, lane),
                mode: self.mode_at(from, lane),
                voltage_v: of(&from.voltage_v),
                phase: from.phase,
                time_ns: from.time_ns,
                piece: None,
                enclosed: false,
            };
            self.add_candidate(shared, lane, candidate);
        }
    }

    /// Magnitudes of the rates of the driving states at a slot.
    #[inline(always)]
    fn rate_sizes(&self, shared: &Shared, slot: &Slot<W>) -> [W::Vector; DRIVING] {
        let w = self.width;
        let y = slot.state.each_ref().map(
            #[inline(always)]
            |array| w.load(array),
        );
        let offset = w.load(&slot.flank) * w.load(&self.backlash_half_rad);
        let x = [y[0], y[1], y[2] - offset, y[3], y[4]];
        let mut sizes = [w.splat(0.0); DRIVING];
        for (kind, lanes) in slot.kinds.present(shared.has_stiction) {
            let Some(of_kind) = shared.phases[slot.phase].of(kind) else {
                continue;
            };
            let [_, rates @ ..] = of_kind.step.rates(w, &x, w.load(&slot.voltage_v));
            for (size, rate) in sizes.iter_mut().zip(rates) {
                *size = w.select(w.lanes(lanes), w.abs(rate), *size);
            }
        }
        sizes
    }

    /// The figures at a slot.
    #[inline(always)]
    fn figures_at(&self, shared: &Shared, slot: &Slot<W>) -> [W::Vector; FIGURES] {
        let mut figures = [self.width.splat(0.0); FIGURES];
        // No power: its steps know theirs at both ends.
        for (i, figure) in figures.iter_mut().enumerate().take(POWER) {
            *figure = self.figure_at(shared, slot, i);
        }
        figures
    }

    /// A figure at a slot; the power per volt.
    #[inline(always)]
    fn figure_at(&self, shared: &Shared, slot: &Slot<W>, figure: usize) -> W::Vector {
        let w = self.width;
        let p = w.splat(shared.axis.pitch_m_per_rad);
        let y = |state: usize| w.load(&slot.state[state]);
        match figure {
            0 => w.load(&slot.acceleration_mps2),
            1 | POWER => y(CURRENT),
            CARRIAGE => {
                let gamma = (y(BETA) - y(EPSILON)) + w.load(&self.start_rad);
                w.load(&slot.command_m) - p * gamma
            }
            _ => w.load(&slot.command_m) - p * y(BETA),
        }
    }

    /// Looks at all steps that have not been looked at.
    #[inline(always)]
    pub(super) fn look_at_track(&mut self, shared: &mut Shared) {
        self.change_block(shared);
        self.change_block(shared);
    }

    /// Lets a candidate wait; if there are many, they are looked at.
    #[inline(always)]
    pub(super) fn add_candidate(&mut self, shared: &mut Shared, lane: usize, candidate: Candidate) {
        if self.lanes[lane].candidates.len() >= MOST {
            self.prune(lane);
            if self.lanes[lane].candidates.len() > KEPT_UNSEEN {
                self.enclose_all(shared, lane);
            }
            if self.lanes[lane].candidates.len() > KEPT {
                self.resolve_all(shared, lane);
            }
        }
        self.lanes[lane].candidates.push(candidate);
    }

    /// Resolves all candidates of a lane.
    #[inline(always)]
    pub(super) fn resolve(&mut self, shared: &mut Shared, lane: usize) {
        if !self.lanes[lane].candidates.is_empty() {
            self.prune(lane);
            self.enclose_all(shared, lane);
            self.resolve_all(shared, lane);
        }
    }

    /// Drops the candidates that are outdone.
    fn prune(&mut self, lane: usize) {
        let known = self.known_of(lane);
        let candidates = &mut self.lanes[lane].candidates;
        candidates.retain(|candidate| exceeds(&candidate.upper, &known) != 0);
    }

    /// Lowers the upper bounds by the sketches, of the last candidate first: it is
    /// more likely to outdo the others.
    #[inline(always)]
    fn enclose_all(&mut self, shared: &Shared, lane: usize) {
        let mut candidates = core::mem::take(&mut self.lanes[lane].candidates);
        let mut known = self.known_of(lane);
        for candidate in candidates.iter_mut().rev() {
            if !candidate.enclosed {
                let open = exceeds(&candidate.upper, &known);
                let mut command = None;
                for figure in (0..FIGURES).filter(|figure| open >> figure & 1 != 0) {
                    let floor = self.enclose(shared, (lane, figure), candidate, &mut command);
                    known[figure] = known[figure].max(floor);
                }
            }
            candidate.enclosed = true;
        }
        candidates.retain(|candidate| exceeds(&candidate.upper, &known) != 0);
        self.lanes[lane].candidates = candidates;
        for (floor, known) in self.floors.iter_mut().zip(known) {
            let floor = &mut floor.as_mut()[lane];
            *floor = floor.max(known);
        }
    }

    /// Lowers the upper bound of a figure in a step or a piece of one; returns what it
    /// reaches for certain. `command` is kept from figure to figure.
    #[inline(always)]
    fn enclose(
        &self,
        shared: &Shared,
        (lane, figure): (usize, usize),
        candidate: &mut Candidate,
        command: &mut Option<CommandRises>,
    ) -> f64 {
        let phase = &shared.phases[candidate.phase];
        let run = &self.lanes[lane];
        let y = &candidate.state;
        let (axis, mode) = (&run.plant.axis, &candidate.mode);
        let Some(of_kind) = phase.of(Kind::of(mode)) else {
            return f64::NEG_INFINITY;
        };
        let mut x = values_of(y);
        x[EPSILON] -= axis.offset_rad(mode);
        let rates = of_kind.step.rates(One, &x, candidate.voltage_v);
        let whole_s = phase.length_s;
        let (start_s, length_s) = match &candidate.piece {
            None => (seconds(candidate.time_ns), whole_s),
            Some(piece) => (piece.start_s, piece.length_s),
        };
        let p = shared.axis.pitch_m_per_rad;
        // What the plant makes of it, from the start of the piece on, over the whole step.
        let sketch = &of_kind.figures[figure];
        let own = match figure {
            0 => axis.carriage_acceleration_mps2(mode, &y.to_vector()),
            CARRIAGE => p * ((y.beta_rad - y.epsilon_rad) + axis.start_rad),
            1 | POWER => y.current_a,
            _ => p * y.beta_rad,
        };
        let scale = if figure == POWER {
            candidate.voltage_v
        } else {
            1.0
        };
        let (rises, stray) = sketch.over(&rates, own.abs());
        let mut off = scale.abs() * stray;
        let mut values = [0.0; VALUES];
        for (i, rise) in rises.iter().enumerate() {
            values[i + 1] = values[i] + scale * rise;
        }
        let theta = length_s / whole_s;
        if candidate.piece.is_some() {
            values = left_of(One, &values, theta);
        }
        // The slope, per eleventh of the piece, by which the polynomial is off.
        let mut slope_off = theta * off / 11.0;
        let mut start = scale * own;
        if (CARRIAGE..POWER).contains(&figure) {
            let command = command.get_or_insert_with(|| {
                let motion = &run.extremes.settings.motion;
                CommandRises::new(motion, (start_s, length_s), self.bend_m.as_ref()[lane])
            });
            let mut ahead_m = 0.0;
            for (i, value) in values.iter_mut().enumerate() {
                *value = ahead_m - *value;
                ahead_m += command.rises.get(i).copied().unwrap_or(0.0);
            }
            start = command.start_m - own;
            let size = (command.start_m.abs() + p * y.beta_rad.abs()) * ROUNDING;
            off += command.off_m + size;
            slope_off += command.slope_off_m + size;
        }
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut upper = start.abs();
        for pair in values.windows(2) {
            let rise = pair[1] - pair[0];
            lowest = lowest.min(rise);
            highest = highest.max(rise);
        }
        for value in &mut values {
            *value += start;
            upper = upper.max(value.abs());
        }
        upper += off;
        let before = &mut candidate.upper[figure];
        // What a piece has at its ends is known but for the errors.
        let ends_known = candidate.piece.is_none() || !(CARRIAGE..POWER).contains(&figure);
        if ends_known && lowest.max(-highest) > slope_off {
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

    /// Looks at all candidates of a lane, the last first.
    #[cold]
    #[inline(never)]
    fn resolve_all(&mut self, shared: &mut Shared, lane: usize) {
        while let Some(candidate) = self.lanes[lane].candidates.pop() {
            let open = exceeds(&candidate.upper, &self.known_of(lane));
            if open == 0 {
                continue;
            }
            let run = &mut self.lanes[lane];
            run.raise(&self.peaks, lane);
            run.raise(&self.track.ends, lane);
            let mut plant = run.plant.at(&candidate.state, candidate.time_ns);
            plant.mode = candidate.mode;
            let (tables, extremes) = (&mut shared.tables, &mut run.extremes);
            let length_ns = shared.phases[candidate.phase].length_ns;
            let step = (candidate.voltage_v, length_ns);
            match candidate.piece {
                None => {
                    let sought = (open, f64::INFINITY);
                    plant.look_at_step(tables, step, sought, extremes);
                }
                Some(piece) => {
                    let times_s = (piece.start_s, piece.length_s);
                    plant.look_at_piece(tables, step, times_s, (&piece.end, open), extremes);
                }
            }
            self.raise_floors(lane);
        }
    }
}
