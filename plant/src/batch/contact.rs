//! Lanes that have left the common step, of all groups: changes of contact are
//! followed side by side, whatever else happens as single runs.

use super::group::{Group, Shared, state_of, values_of};
use super::phase::{KINDS, Kind};
use super::questions::{PastStep, Piece, Question, Topic};
use super::step::Leaving;
use super::transition::{KindOfStep, Transition, TransitionStart};
use crate::exact::HELD;
use crate::model::axis::Drive;
use crate::model::joint::Contact;
use crate::model::state::State;
use crate::numerics::seconds;
use crate::numerics::vectors::{in_fours, widest};
use crate::numerics::width::Width;
use crate::observe::extremes::{POWER, figures_at, is_following_error};
use crate::observe::{ContactChange, Watch};

/// Lanes that wait to be followed, and room to follow them in.
#[derive(Debug, Clone)]
pub(super) struct Contacts<W: Width> {
    start: TransitionStart<W>,
    /// By phase and kind of mode: only steps of one kind go side by side.
    waiting: Vec<[Vec<Leaving>; KINDS]>,
    /// Of these, the ones that are followed now.
    chunk: Vec<Leaving>,
}

impl<W: Width> Contacts<W> {
    pub(super) fn new(phases: usize) -> Self {
        Self {
            start: TransitionStart::new(),
            waiting: (0..phases).map(|_| [const { Vec::new() }; KINDS]).collect(),
            chunk: Vec::with_capacity(W::LANES),
        }
    }

    /// Forgets the lanes that wait.
    pub(super) fn start(&mut self) {
        for list in self.waiting.iter_mut().flatten() {
            list.clear();
        }
    }

    /// Follows the lanes of `leaving` and those that wait, as many of a kind at a time
    /// as there are lanes; the rest wait on. If no group can go on without them, those that
    /// are most numerous are followed.
    #[inline(always)]
    pub(super) fn follow(
        &mut self,
        w: W,
        shared: &mut Shared,
        groups: &mut [Group<W>],
        (leaving, none_goes_on): (&mut Vec<Leaving>, bool),
    ) {
        for left in leaving.drain(..) {
            let group = &mut groups[left.group];
            match group.kind_of(&left) {
                Some(kind) => self.waiting[left.phase][kind.place()].push(left),
                None => {
                    group.advance_lane(shared, &left);
                    group.held_up -= 1;
                }
            }
        }
        let mut least = if none_goes_on { 1 } else { W::LANES };
        while let Some((phase, kind)) = self.longest(least) {
            let list = &mut self.waiting[phase][kind.place()];
            let rest = list.len().saturating_sub(W::LANES);
            self.chunk.clear();
            self.chunk.extend(list.drain(rest..));
            self.follow_chunk(w, shared, groups, (phase, kind));
            least = W::LANES;
        }
    }

    /// Phase and kind of mode of the longest list that has this many lanes at least.
    fn longest(&self, least: usize) -> Option<(usize, Kind)> {
        let all =
            (0..self.waiting.len()).flat_map(|phase| Kind::all().map(move |kind| (phase, kind)));
        let number = |&(phase, kind): &(usize, Kind)| self.waiting[phase][kind.place()].len();
        all.max_by_key(number).filter(|of| number(of) >= least)
    }

    /// Follows the lanes of the chunk, all in the same phase and kind of mode.
    #[inline(always)]
    fn follow_chunk(
        &mut self,
        w: W,
        shared: &mut Shared,
        groups: &mut [Group<W>],
        (phase, kind): (usize, Kind),
    ) {
        let steps = [kind, kind.after_contact_change()]
            .map(|kind| KindOfStep::new(&shared.axis, &shared.phases[phase], kind));
        let mut transition = None;
        if let [Some(from), Some(to)] = steps {
            self.gather(groups);
            let asked = (1_u64 << self.chunk.len()) - 1;
            transition = Some(self.start.follow(w, [from, to], asked));
        }
        for (place, left) in self.chunk.iter().enumerate() {
            let group = &mut groups[left.group];
            let followed = transition
                .as_ref()
                .filter(|transition| transition.known >> place & 1 != 0)
                .is_some_and(|transition| group.take_transition(shared, left, transition, place));
            if !followed {
                group.advance_lane(shared, left);
            }
            group.held_up -= 1;
        }
    }

    /// Takes over the starts of the chunk's lanes; the last one is repeated.
    fn gather(&mut self, groups: &[Group<W>]) {
        let start = &mut self.start;
        for place in 0..W::LANES {
            let Some(left) = self.chunk.get(place).or(self.chunk.last()) else {
                return;
            };
            let (group, y) = (&groups[left.group], &left.y);
            for (array, value) in start.y.iter_mut().zip(values_of(y)) {
                array.as_mut()[place] = value;
            }
            for (array, value) in start.commands_m.iter_mut().zip(left.commands_m) {
                array.as_mut()[place] = value;
            }
            let b = group.lanes[left.lane].plant.axis.backlash_half_rad();
            for (array, value) in [
                (&mut start.voltage_v, left.voltage_v),
                (&mut start.flank, group.mode.joint.as_ref()[left.lane]),
                (&mut start.backlash_half_rad, b),
                (&mut start.bend_m, group.bend_m.as_ref()[left.lane]),
                (&mut start.start_rad, group.start_rad.as_ref()[left.lane]),
            ] {
                array.as_mut()[place] = value;
            }
        }
    }
}

impl<W: Width> Group<W> {
    /// Advances a lane as a single run.
    #[cold]
    #[inline(never)]
    pub(super) fn advance_lane(&mut self, shared: &mut Shared, left: &Leaving) {
        let lane = left.lane;
        let run = &mut self.lanes[lane];
        run.plant.set(&left.y, left.time_ns);
        run.raise(&self.peaks, lane);
        run.raise(&self.track.ends, lane);
        let mode = run.plant.mode;
        // From here on the single run goes on with the sums.
        for (sum, energy) in run.extremes.energies_mut().into_iter().zip(&self.energies) {
            *sum = energy.as_ref()[lane];
        }
        let known_s = run.extremes.voltage_limited_s;
        if run.result.is_ok() {
            let drive = Drive::Held(left.voltage_v);
            let length_ns = shared.phases[left.phase].length_ns;
            let (plant, tables) = (&mut run.plant, &mut shared.tables);
            let extremes = &mut run.extremes;
            run.result = in_fours!(
                widest(),
                simd => plant.advance_exactly(simd, tables, &drive, length_ns, extremes)
            );
        }
        if left.counted {
            run.extremes.voltage_limited_s = known_s;
        }
        for (sum, energy) in run
            .extremes
            .energies_mut()
            .into_iter()
            .zip(&mut self.energies)
        {
            energy.as_mut()[lane] = *sum;
        }
        let y = State::from_vector(&run.plant.y);
        let changed = run.plant.mode != mode || run.plant.fresh.is_some();
        self.take_peaks(lane);
        let changed = changed || self.mode.is_unsure(lane);
        self.put(shared, (lane, changed), &y, left.commands_m[1]);
    }

    /// The kind of a lane's mode; `None` where its step is not one to be followed side by
    /// side.
    fn kind_of(&self, left: &Leaving) -> Option<Kind> {
        let run = &self.lanes[left.lane];
        // One at rest on a flank may leave it at once.
        let moves = run.plant.axis.start_rad == 0.0 || left.y.current_a != 0.0;
        let simple = moves && !self.mode.is_unsure(left.lane) && run.result.is_ok();
        simple.then(|| Kind::of(&run.plant.mode))
    }

    /// Takes over what lane number `place` of a transition has done; `false` where its
    /// settling band needs a closer look.
    fn take_transition(
        &mut self,
        shared: &mut Shared,
        left: &Leaving,
        transition: &Transition<W>,
        place: usize,
    ) -> bool {
        let lane = left.lane;
        let of = |arrays: &[W::Array; HELD]| state_of::<W>(arrays, place);
        let (before, after, end) = (
            of(&transition.before),
            of(&transition.after),
            of(&transition.end),
        );
        let at = |array: &W::Array| array.as_ref()[place];
        // As spans sum it up.
        let length_s = shared.phases[left.phase].length_s;
        let change_s = at(&transition.change_s);
        let start_s = seconds(left.time_ns);
        let (middle_s, left_s) = (start_s + change_s, length_s - change_s);

        let run = &mut self.lanes[lane];
        let p = shared.axis.pitch_m_per_rad;
        let (travel_m, band_m) = (
            run.extremes.settings.motion.travel_m(),
            run.extremes.settings.settling_band_m,
        );
        let start_rad = run.plant.axis.start_rad;
        let distance_m = |y: &State| (travel_m - p * (y.gamma_rad() + start_rad)).abs();
        if distance_m(&end) > band_m {
            let outside_s = Some(middle_s + left_s);
            if outside_s > run.extremes.last_outside_band_s {
                run.extremes.last_outside_band_s = outside_s;
            }
        } else {
            let ends = [(&left.y, &before), (&after, &end)];
            let strays = transition.carriage_strays_m.iter().map(at);
            let inside = |((from, to), stray_m): ((&State, &State), f64)| {
                distance_m(from).max(distance_m(to)) + stray_m <= band_m
            };
            if !ends.into_iter().zip(strays).all(inside) {
                return false;
            }
        }

        if let Some([limit_v, _]) = shared.limits {
            let voltage_v = left.voltage_v.abs();
            let peak_v = &mut run.extremes.peak_abs_voltage_v;
            *peak_v = peak_v.max(voltage_v);
            if voltage_v >= limit_v && !left.counted {
                for piece_s in [change_s, left_s] {
                    run.extremes.voltage_limited_s += piece_s;
                }
            }
        }
        for piece_j in &transition.energies_j {
            for (sum, energy_j) in self.energies.iter_mut().zip(piece_j) {
                sum.as_mut()[lane] += at(energy_j);
            }
        }

        let start_mode = run.plant.mode;
        let end_mode = start_mode.with_contact(at(&transition.flank));
        let from = run.plant.contact();
        run.plant.set(&end, left.time_ns);
        run.plant.mode = end_mode;
        let to = run.plant.contact();
        let accelerations = transition
            .acceleration_mps2
            .each_ref()
            .map(|ends| ends.each_ref().map(at));
        run.extremes.contact_change(&ContactChange {
            time_s: middle_s,
            from,
            to,
            impact: from == Contact::Open,
            epsilon_dot_radps: after.epsilon_dot_radps,
            acceleration_before_mps2: accelerations[0][1],
            acceleration_after_mps2: accelerations[1][0],
        });
        let currents = [left.y.current_a, before.current_a, end.current_a];
        let powers = currents.map(|current_a| left.voltage_v * current_a);
        for (i, sizes) in [
            (0, accelerations.as_flattened()),
            (1, &currents),
            (POWER, &powers),
        ] {
            let peak = &mut self.track.ends[i].as_mut()[lane];
            *peak = sizes.iter().fold(*peak, |peak, size| peak.max(size.abs()));
        }
        for (piece, uppers) in transition.uppers.iter().enumerate() {
            for (figure, upper) in uppers.iter().enumerate() {
                let upper = at(upper);
                if upper <= self.known_of(lane, figure) || lane >= self.runs {
                    continue;
                }
                let (mode, state, end, start_s, length_s) = match piece {
                    0 => (&start_mode, &left.y, &before, start_s, change_s),
                    _ => (&end_mode, &after, &end, middle_s, left_s),
                };
                if is_following_error(figure) {
                    // At the ends, where it is not known yet.
                    let run = &self.lanes[lane];
                    let motion = &run.extremes.settings.motion;
                    for (y, time_s) in [(state, start_s), (end, start_s + length_s)] {
                        let given = (motion.at(time_s).displacement_m, left.voltage_v);
                        let y = y.to_vector();
                        let figures = figures_at(&run.plant.axis, mode, &y, given);
                        let peak = &mut self.track.ends[figure].as_mut()[lane];
                        *peak = peak.max(figures[figure].abs());
                    }
                }
                let topic = Topic {
                    phase: left.phase,
                    kind: Kind::of(mode),
                    figure,
                };
                let question = Question {
                    upper,
                    lane,
                    step: PastStep {
                        state: *state,
                        mode: *mode,
                        voltage_v: left.voltage_v,
                        phase: left.phase,
                        time_ns: left.time_ns,
                    },
                    piece: Some(Piece {
                        start_s,
                        length_s,
                        end: *end,
                    }),
                };
                self.ask(shared, topic, question);
            }
        }
        self.put(shared, (lane, true), &end, left.commands_m[1]);
        true
    }
}
