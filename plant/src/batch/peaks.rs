//! Peaks between the ends of the steps.
//!
//! Steps are looked at a block at a time, one block late: by then most are
//! outdone. The largest rate of each state in a block bounds how far a figure
//! may stray from its ends; only where that leaves it open are the steps looked
//! at one by one, and their sketches asked. What remains is a question that waits
//! ([`super::questions`]).

use super::answers::CommandSketch;
use super::group::{Group, PLACES, Shared, Slot, state_of};
use super::phase::times_sizes_of;
use super::questions::{PastStep, Question, Topic};
use crate::exact::{HELD, behind_figure, times_sizes};
use crate::model::state::{BETA, CURRENT, EPSILON};
use crate::numerics::seconds;
use crate::numerics::width::Width;
use crate::observe::extremes::{CARRIAGE, FIGURES, POWER, is_following_error};

/// The solution over a step, of all lanes.
struct Course<W: Width> {
    /// `m·b` of `δ = ε − m·b`.
    offset_rad: W::Vector,
    voltage_v: W::Vector,
    /// β, β̇, δ, ε̇ and I at its start, and their rates.
    x: [W::Vector; HELD],
    rates: [W::Vector; HELD],
    /// Magnitudes of the rates of the driving states.
    sizes: W::Quad,
}

impl<W: Width> Group<W> {
    /// Looks at what still waits for a look.
    #[inline(always)]
    pub(super) fn look_back(&mut self, shared: &mut Shared) {
        self.change_block(shared);
        self.change_block(shared);
        self.answer_all(shared);
        self.follow_outside(shared, 0);
        self.look_at_entries(shared);
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
        track.rates = W::quad_array(0.0);
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
        let sizes = w.load_quad(&track.rates_before);
        for (i, open) in open.iter_mut().enumerate() {
            let mut chord = times_sizes(w, &shared.most_chords[i], sizes);
            if is_following_error(i) {
                chord = chord + half_bend;
            } else if i == POWER {
                chord = w.load(&track.voltage_before_v) * chord;
            }
            let upper = w.load(&track.sizes_before[i]) + chord;
            *open = w.bits(w.at_most(upper, w.load(&self.peaks[i]))) & all != all;
        }
        if open == [false; FIGURES] {
            return;
        }
        for step in (track.first..track.second).rev() {
            self.look_at_step(shared, step, open);
        }
    }

    /// Looks at the figures of `open` within a step; where they may exceed their
    /// peaks, that is asked.
    #[inline(always)]
    fn look_at_step(&mut self, shared: &mut Shared, step: usize, open: [bool; FIGURES]) {
        let course = self.course(shared, &self.track.slots[step % PLACES]);
        let mut command = None;
        for figure in (0..FIGURES).filter(|&figure| open[figure]) {
            let (lanes, chord) = self.exceeding(shared, (step, figure), &course);
            if lanes == 0 {
                continue;
            }
            let kinds = self.track.slots[step % PLACES].kinds;
            for (kind, of_kind) in kinds.present() {
                let asked = lanes & of_kind;
                if asked == 0 {
                    continue;
                }
                let from = &self.track.slots[step % PLACES];
                let topic = Topic {
                    phase: from.phase,
                    kind,
                    figure,
                };
                let bounds = (chord, &mut command);
                let (left, upper) = self.enclose(shared, topic, (from, &course), bounds, asked);
                let uppers = self.width.stored(upper);
                for lane in (0..W::LANES).filter(|lane| left >> lane & 1 != 0) {
                    let from = &self.track.slots[step % PLACES];
                    let question = Question {
                        upper: uppers.as_ref()[lane],
                        lane,
                        step: PastStep {
                            state: state_of::<W>(&from.state, lane),
                            mode: self.mode_at(from, lane),
                            voltage_v: from.voltage_v.as_ref()[lane],
                            phase: from.phase,
                            time_ns: from.time_ns,
                        },
                        piece: None,
                    };
                    self.ask(shared, topic, question);
                }
            }
        }
    }

    /// The runs in which a figure may exceed its peak between the ends of a step, and the
    /// upper bound of its magnitude, both by the chord.
    #[inline(always)]
    fn exceeding(
        &self,
        shared: &Shared,
        (step, figure): (usize, usize),
        course: &Course<W>,
    ) -> (u64, W::Vector) {
        let w = self.width;
        let slots = &self.track.slots;
        let (from, to) = (&slots[step % PLACES], &slots[(step + 1) % PLACES]);
        let phase = &shared.phases[from.phase];
        let closed = w.greater(w.abs(w.load(&from.flank)), w.splat(0.5));
        let mut start = self.figure_at(shared, from, figure);
        let mut end = self.figure_at(shared, to, figure);
        let mut chord = times_sizes_of(w, closed, &phase.chords[figure], course.sizes);
        // The power is under one voltage all along.
        let size_v = w.abs(course.voltage_v);
        if figure == POWER {
            for per_volt in [&mut start, &mut end, &mut chord] {
                *per_volt = size_v * *per_volt;
            }
        }
        let bend = w.load(&self.bend_m);
        if is_following_error(figure) {
            chord = chord + bend * w.splat(0.125);
        }
        let upper = w.max(w.abs(start), w.abs(end)) + chord;
        let below = w.at_most(upper, w.load(&self.peaks[figure]));
        let runs = (1_u64 << self.runs) - 1;
        let left = runs & !(w.bits(below) | from.moved);
        if left == 0 {
            return (0, upper);
        }
        let mut slope = times_sizes_of(w, closed, &phase.slopes[figure], course.sizes);
        if figure == POWER {
            slope = size_v * slope;
        } else if is_following_error(figure) {
            slope = slope + bend * w.splat(0.5);
        }
        let monotone = w.greater(w.abs(end - start), slope);
        (left & !w.bits(monotone), upper)
    }

    /// Of the lanes of `asked`, those in which the sketch of the figure over the step from a
    /// slot does not exclude it either, and its upper bound. The command's sketch is kept from
    /// figure to figure.
    #[inline(always)]
    fn enclose(
        &self,
        shared: &Shared,
        topic: Topic,
        (from, course): (&Slot<W>, &Course<W>),
        (chord, command): (W::Vector, &mut Option<CommandSketch<W>>),
        mut asked: u64,
    ) -> (u64, W::Vector) {
        let (w, figure) = (self.width, topic.figure);
        let phase = &shared.phases[topic.phase];
        let Some(held) = phase.of(topic.kind) else {
            return (asked, chord);
        };
        let screw_load = held.system.screw_load;
        let of_axis = [shared.axis.pitch_m_per_rad, screw_load];
        let offset_rad = course.offset_rad - w.load(&self.start_rad);
        let (quantity, scale) = behind_figure(w, figure, of_axis, [offset_rad, course.voltage_v]);
        let (table, start) = (&held.table, (&course.x, &course.rates));
        let linear = table.quantity(quantity);
        let Some(mut curve) = linear.curve(w, &table.levels, start, scale) else {
            return (asked, chord);
        };
        let mut smooth = asked;
        if is_following_error(figure) {
            let start_s = seconds(from.time_ns);
            let command = command.get_or_insert_with(|| {
                CommandSketch::new(|lane| {
                    let motion = &self.lanes[lane].extremes.settings.motion;
                    Some((motion, start_s, phase.length_s))
                })
            });
            smooth &= command.smooth;
            curve = command.less(w, &curve);
        }
        let upper = curve.upper(w);
        let below = w.bits(w.at_most(upper, w.load(&self.peaks[figure])));
        asked &= !(smooth & (below | curve.is_monotone(w)));
        (asked, w.select(w.lanes(smooth), upper, chord))
    }

    /// The solution from a slot on.
    #[inline(always)]
    fn course(&self, shared: &Shared, slot: &Slot<W>) -> Course<W> {
        let w = self.width;
        let y = w.load_each(&slot.state);
        let offset_rad = w.load(&slot.flank) * w.load(&self.backlash_half_rad);
        let x = [y[0], y[1], y[2] - offset_rad, y[3], y[4]];
        let voltage_v = w.load(&slot.voltage_v);
        let mut rates = [w.splat(0.0); HELD];
        for (kind, lanes) in slot.kinds.present() {
            let Some(table) = shared.phases[slot.phase].of(kind) else {
                continue;
            };
            let of_kind = table.step.rates(w, &x, voltage_v);
            for (rate, of_kind) in rates.iter_mut().zip(of_kind) {
                *rate = w.select(w.lanes(lanes), of_kind, *rate);
            }
        }
        let [_, a, b, c, d] = rates;
        Course {
            offset_rad,
            voltage_v,
            x,
            rates,
            sizes: w.quad_abs(w.quad([a, b, c, d])),
        }
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
}
