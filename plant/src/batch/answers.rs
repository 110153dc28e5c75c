//! The answers to the questions that wait, as many at a time as go side by side: where the
//! sketch of a figure turns, the solution around that place tells how large it is. What a sketch
//! leaves open is searched as in a single run.

use super::group::{Group, Shared};
use super::questions::{KEPT, MOST, Question, Topic};
use crate::exact::{
    Curve, HELD, SLOPES, Window, behind_figure, command_slopes, held_state, magnitude_at_turn,
    magnitude_behind, scaled,
};
use crate::model::motion::Motion;
use crate::numerics::width::{One, Width};
use crate::observe::extremes::is_following_error;

/// The command of every lane over its step or piece, as a sketch.
pub(super) struct CommandSketch<W: Width> {
    start_m: W::Array,
    slopes: [W::Array; SLOPES],
    stray: W::Array,
    /// The lanes in which there is one: it has no break.
    pub(super) smooth: u64,
}

impl<W: Width> CommandSketch<W> {
    /// Of the motions, starts and lengths \[s\] of the lanes that have some.
    pub(super) fn new<'m>(of_lane: impl Fn(usize) -> Option<(&'m Motion, f64, f64)>) -> Self {
        let mut sketch = Self {
            start_m: W::array(0.0),
            slopes: [W::array(0.0); SLOPES],
            stray: W::array(0.0),
            smooth: 0,
        };
        // Lanes often have one command at one time.
        let mut last = None;
        for lane in 0..W::LANES {
            let Some(given) = of_lane(lane) else { continue };
            let slopes = match last {
                Some((known, slopes)) if known == given => slopes,
                _ => command_slopes(given.0, given.1, given.2),
            };
            last = Some((given, slopes));
            let Some((start_m, slopes, stray)) = slopes else {
                continue;
            };
            sketch.smooth |= 1 << lane;
            sketch.start_m.as_mut()[lane] = start_m;
            sketch.stray.as_mut()[lane] = stray;
            for (array, slope) in sketch.slopes.iter_mut().zip(slopes) {
                array.as_mut()[lane] = slope;
            }
        }
        sketch
    }

    /// The command less a quantity.
    #[inline(always)]
    pub(super) fn less(&self, w: W, own: &Curve<W>) -> Curve<W> {
        let mut slopes = own.slopes;
        for (slope, array) in slopes.iter_mut().zip(&self.slopes) {
            *slope = w.load(array);
        }
        own.less_from(w, (w.load(&self.start_m), slopes, w.load(&self.stray)))
    }
}

impl<W: Width> Group<W> {
    /// Lets a question wait; if there are many of its topic, they are answered.
    #[inline(always)]
    pub(super) fn ask(&mut self, shared: &mut Shared, topic: Topic, question: Question) {
        let list = &mut self.questions.lists[topic.place()];
        list.push(question);
        if list.len() >= MOST {
            self.width.apart(
                #[inline(always)]
                || self.thin_out(shared, topic),
            );
        }
    }

    /// Drops the questions of a topic that are outdone, and answers the others if they are
    /// many.
    #[inline(always)]
    fn thin_out(&mut self, shared: &mut Shared, topic: Topic) {
        let mut list = core::mem::take(&mut self.questions.lists[topic.place()]);
        list.retain(|question| self.is_open(topic.figure, question));
        if list.len() > KEPT {
            self.answer(shared, topic, &mut list);
        }
        self.questions.lists[topic.place()] = list;
    }

    /// Answers all that wait.
    #[inline(always)]
    pub(super) fn answer_all(&mut self, shared: &mut Shared) {
        for topic in Topic::all(shared.phases.len()) {
            let mut list = core::mem::take(&mut self.questions.lists[topic.place()]);
            self.answer(shared, topic, &mut list);
            self.questions.lists[topic.place()] = list;
        }
    }

    /// True if the figure is not known to be larger elsewhere.
    fn is_open(&self, figure: usize, question: &Question) -> bool {
        let outdone = question.upper <= self.known_of(question.lane, figure);
        !outdone
    }

    /// Answers the questions of a list, the last ones first: they are more likely to outdo the
    /// others.
    #[inline(always)]
    fn answer(&mut self, shared: &mut Shared, topic: Topic, list: &mut Vec<Question>) {
        let mut chunk = core::mem::take(&mut self.questions.chunk);
        while !list.is_empty() {
            while chunk.len() < W::LANES
                && let Some(question) = list.pop()
            {
                if self.is_open(topic.figure, &question) {
                    chunk.push(question);
                }
            }
            if !chunk.is_empty() {
                self.answer_chunk(shared, topic, &chunk);
                chunk.clear();
            }
        }
        self.questions.chunk = chunk;
    }

    /// Answers as many questions of a topic as go side by side.
    #[inline(always)]
    fn answer_chunk(&mut self, shared: &mut Shared, topic: Topic, chunk: &[Question]) {
        let known = self.answer_at_turns(shared, topic, chunk);
        for (place, question) in chunk.iter().enumerate() {
            if known >> place & 1 == 0 {
                self.search(shared, topic, question);
            }
        }
    }

    /// Raises the peaks to the figure's magnitudes where its sketches turn; returns the places
    /// of the questions that this has answered.
    #[inline(always)]
    fn answer_at_turns(&mut self, shared: &Shared, topic: Topic, chunk: &[Question]) -> u64 {
        let (w, figure) = (self.width, topic.figure);
        let phase = &shared.phases[topic.phase];
        let Some(table) = phase.of(topic.kind) else {
            return 0;
        };
        let Some(grid) = &table.table.grid else {
            return 0;
        };
        let zero = W::array(0.0);
        let (mut x, mut known) = ([zero; HELD], zero);
        let (mut offset_rad, mut voltage_v) = (zero, zero);
        let mut length_s = W::array(phase.length_s);
        for (place, question) in chunk.iter().enumerate() {
            let axis = &self.lanes[question.lane].plant.axis;
            let offset = axis.offset_rad(&question.step.mode);
            let start = held_state(&question.step.state.to_vector(), offset);
            for (array, value) in x.iter_mut().zip(start.iter()) {
                array.as_mut()[place] = *value;
            }
            offset_rad.as_mut()[place] = offset - axis.start_rad;
            voltage_v.as_mut()[place] = question.step.voltage_v;
            length_s.as_mut()[place] = question.times_s(phase.length_s).1;
            known.as_mut()[place] = self.known_of(question.lane, figure);
        }
        let x = w.load_each(&x);
        let [voltage_v, length_s] = [w.load(&voltage_v), w.load(&length_s)];
        let of_axis = [shared.axis.pitch_m_per_rad, table.system.screw_load];
        let given = [w.load(&offset_rad), voltage_v];
        let (quantity, scale) = behind_figure(w, figure, of_axis, given);
        let linear = table.table.quantity(quantity);
        let rates = table.step.rates(w, &x, voltage_v);
        let Some(whole) = linear.curve(w, &table.table.levels, (&x, &rates), scale) else {
            return 0;
        };
        let mut curve = whole.until(w, length_s / w.splat(phase.length_s));
        let mut asked = (1_u64 << chunk.len()) - 1;
        let motion_of = |place: usize| -> Option<(&Motion, f64, f64)> {
            let question = chunk.get(place)?;
            let (start_s, length_s) = question.times_s(phase.length_s);
            let motion = &self.lanes[question.lane].extremes.settings.motion;
            Some((motion, start_s, length_s))
        };
        if is_following_error(figure) {
            let command = CommandSketch::<W>::new(motion_of);
            asked &= command.smooth;
            curve = command.less(w, &curve);
        }
        let below = w.bits(w.at_most(curve.upper(w), w.load(&known)));
        let none = asked & (below | curve.is_monotone(w));
        let (theta, turns) = curve.turn(w, asked & !none);
        if turns == 0 {
            return none;
        }
        let time_s = theta * length_s;
        let local = grid.near(w, &table.system.a, (&x, &rates), time_s);
        let q = scaled::<W>(local.quantity(w, &linear.row), scale);
        let sigma = local.window.sigma(time_s);
        let (magnitude, mut found) = match is_following_error(figure) {
            false => magnitude_at_turn(w, &q, sigma, turns),
            true => {
                let (mut magnitudes, mut found) = (zero, 0);
                let (centre_s, half_s) = (w.stored(local.window.centre_s), local.window.half_s);
                let (half_s, sigma) = (w.stored(half_s), w.stored(sigma));
                let q = w.stored_each(&q);
                for place in (0..W::LANES).filter(|place| turns >> place & 1 != 0) {
                    let of = |array: &W::Array| array.as_ref()[place];
                    let Some((motion, start_s, _)) = motion_of(place) else {
                        continue;
                    };
                    let window = Window::<One> {
                        centre_s: of(&centre_s),
                        half_s: of(&half_s),
                    };
                    let (command, q) = ((motion, start_s), q.each_ref().map(of));
                    if let Some(size) = magnitude_behind(&window, &q, command, of(&sigma)) {
                        magnitudes.as_mut()[place] = size;
                        found |= 1 << place;
                    }
                }
                (w.load(&magnitudes), found)
            }
        };
        found &= turns;
        let magnitudes = w.stored(magnitude);
        for (place, question) in chunk.iter().enumerate() {
            if found >> place & 1 != 0 {
                let peak = &mut self.peaks[figure].as_mut()[question.lane];
                *peak = peak.max(magnitudes.as_ref()[place]);
            }
        }
        none | found
    }

    /// Answers a question as a single run does.
    #[cold]
    #[inline(never)]
    fn search(&mut self, shared: &mut Shared, topic: Topic, question: &Question) {
        let lane = question.lane;
        let run = &mut self.lanes[lane];
        run.raise(&self.peaks, lane);
        run.raise(&self.track.ends, lane);
        let sought = (1 << topic.figure, f64::INFINITY);
        run.look_at(shared, (&question.step, question.piece.as_ref()), sought);
        self.take_peaks(lane);
    }
}
