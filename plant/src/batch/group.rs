//! The states of the lanes of one group, one step at a time.

use super::closer::Lane;
use super::lanes::{LaneSetup, Shared};
use super::modes::ModeNumbers;
use super::phase::{DRIVING, Steps, dot_pairs, numbers_of};
use super::track::Track;
use super::width::Width;
use crate::error::PlantError;
use crate::exact::{CARRIAGE, FIGURES, HELD};
use crate::extremes::Extremes;
use crate::plant::{Plant, seconds};
use crate::resistance::GuideMode;
use crate::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT, State};

/// As many runs as there are lanes, at the same time.
#[derive(Debug, Clone)]
pub(crate) struct Group<W: Width> {
    pub(super) width: W,
    /// The step of each length with the numbers of every lane's mode.
    pub(super) steps: Vec<Steps<W>>,
    pub(super) lanes: Vec<Lane>,
    /// How many of them are runs; the others repeat the last.
    pub(super) runs: usize,
    /// The last steps.
    pub(super) track: Track<W>,
    pub(super) mode: ModeNumbers<W>,
    pub(super) backlash_half_rad: W::Array,
    /// ẍ now \[m/s²\].
    pub(super) acceleration_mps2: W::Array,
    /// Sup of the figures' magnitudes over the ends of the steps before the
    /// present block.
    pub(super) peaks: [W::Array; FIGURES],
    /// What they are known to reach, between the ends too.
    pub(super) floors: [W::Array; FIGURES],
    peak_abs_voltage_v: W::Array,
    /// What the joints' dampers have taken \[J\].
    pub(super) joint_loss_j: W::Array,
    /// Number of the last step that ended outside the settling band; of the last
    /// one in which no lane did anything else, where that is later.
    pub(super) last_outside: W::Array,
    all_outside: f64,
    travel_m: W::Array,
    band_m: W::Array,
    /// `T²·sup|a_ref|` with the longest of the steps' lengths T \[m\].
    pub(super) bend_m: W::Array,
}

/// A lane that has left the common step, with what it began that with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaving {
    pub(super) group: usize,
    pub(super) lane: usize,
    pub(super) phase: usize,
    pub(super) y: State,
    pub(super) voltage_v: f64,
    /// x_ref at both ends of the step \[m\].
    pub(super) commands_m: [f64; 2],
    /// Number of the step.
    pub(super) time_ns: u64,
}

/// One step of all lanes: the driving states at both ends, and more.
pub(super) struct Step<W: Width> {
    /// `m·b` of `δ = ε − m·b`.
    pub(super) offset: W::Vector,
    /// β at both ends.
    pub(super) beta: [W::Vector; 2],
    /// β̇, δ, ε̇ and I at the start.
    pub(super) from: [W::Vector; DRIVING],
    /// The same at the end.
    pub(super) to: [W::Vector; DRIVING],
    /// |to − from|
    pub(super) change: [W::Vector; DRIVING],
}

impl<W: Width> Group<W> {
    pub(super) fn new(width: W, phases: usize) -> Self {
        let zero = W::array(0.0);
        Self {
            width,
            steps: (0..phases).map(|_| Steps::new()).collect(),
            lanes: Vec::with_capacity(W::LANES),
            runs: 0,
            track: Track::new(),
            mode: ModeNumbers::new(),
            backlash_half_rad: zero,
            acceleration_mps2: zero,
            peaks: [zero; FIGURES],
            floors: [zero; FIGURES],
            peak_abs_voltage_v: zero,
            joint_loss_j: zero,
            last_outside: zero,
            all_outside: -1.0,
            travel_m: zero,
            band_m: zero,
            bend_m: zero,
        }
    }

    /// Puts every lane at rest at zero. Lanes without a setup repeat the last.
    pub(super) fn start(&mut self, shared: &mut Shared, setups: &[LaneSetup], last: &LaneSetup) {
        let zero = W::array(0.0);
        let longest_ns = shared.phases.iter().map(|phase| phase.length_ns).max();
        let longest_s = seconds(longest_ns.unwrap_or(0));
        self.track.start();
        self.runs = setups.len();
        self.peaks = [zero; FIGURES];
        self.floors = [zero; FIGURES];
        self.peak_abs_voltage_v = zero;
        self.joint_loss_j = zero;
        self.last_outside = W::array(-1.0);
        self.all_outside = -1.0;
        for lane in 0..W::LANES {
            let setup = setups.get(lane).unwrap_or(last);
            let motion = &setup.extremes.motion;
            self.travel_m.as_mut()[lane] = motion.travel_m();
            self.band_m.as_mut()[lane] = setup.extremes.settling_band_m;
            self.bend_m.as_mut()[lane] = motion.peak_acceleration_mps2() * (longest_s * longest_s);
            let axis = shared.axis.with_backlash(setup.backlash_half_rad);
            self.backlash_half_rad.as_mut()[lane] = axis.backlash_half_rad();
            let (plant, extremes) = (Plant::of_axis(axis), Extremes::new(setup.extremes));
            match self.lanes.get_mut(lane) {
                Some(run) => run.start(plant, extremes),
                None => self.lanes.push(Lane::new(plant, extremes)),
            }
            self.take_mode(shared, lane);
            self.take_figures(lane);
        }
    }

    /// As [`super::InStep::advance`].
    #[inline(always)]
    pub(super) fn advance(
        &mut self,
        shared: &mut Shared,
        (number, phase): (usize, usize),
        voltage_v: W::Vector,
        command: W::Vector,
        leaving: &mut Vec<Leaving>,
    ) -> bool {
        let w = self.width;
        let all = (1_u64 << W::LANES) - 1;
        if self.track.block_is_full() {
            self.change_block(shared);
        }
        let step = self.step(phase, voltage_v);
        let keeps = self.keeps(phase, &step);
        // Outside the settling band at the end.
        let p = w.splat(shared.axis.pitch_m_per_rad());
        let epsilon = step.to[1] + step.offset;
        let carriage = p * (step.beta[1] - epsilon);
        let distance = w.abs(w.load(&self.travel_m) - carriage);
        let outside = w.greater(distance, w.load(&self.band_m));
        let ends = [
            self.acceleration_after(shared, &step, epsilon),
            step.to[3],
            command - carriage,
            command - p * step.beta[1],
        ];
        if w.bits(w.both(keeps, outside)) == all {
            self.all_outside = crate::plant::count(self.track.now().time_ns);
            self.take(shared, (phase, 0), (&step, &ends), command, voltage_v);
            return false;
        }
        let moved = self.moved(shared, phase, (&step, keeps), voltage_v);
        let mut wanted = !(w.bits(outside) | moved) & all;
        if wanted != 0 {
            // Or perhaps before it.
            let carriage = p * (step.beta[0] - (step.from[1] + step.offset));
            let before = w.abs(w.load(&self.travel_m) - carriage);
            let flank = w.load(&self.track.now().flank);
            let closed = w.greater(w.abs(flank), w.splat(0.5));
            let strays = &shared.phases[phase].chords[CARRIAGE];
            let stray = dot_pairs(w, closed, strays, &step.change);
            let farthest = w.max(distance, before) + stray;
            wanted &= !w.bits(w.at_most(farthest, w.load(&self.band_m)));
        }
        if wanted != 0 {
            self.look_at_band(shared, phase, wanted, voltage_v);
        }
        let first = leaving.len();
        if moved != 0 {
            self.leave((number, phase), moved, (voltage_v, command), leaving);
        }
        let now = crate::plant::count(self.track.now().time_ns);
        let outside = w.bits(outside) & !moved;
        for (lane, last) in self.last_outside.as_mut().iter_mut().enumerate() {
            let before = last.max(self.all_outside);
            *last = if outside >> lane & 1 != 0 {
                now
            } else {
                before
            };
        }
        self.all_outside = -1.0;
        let (peaks, joint_loss_j) = (self.track.ends, self.joint_loss_j);
        self.take(shared, (phase, moved), (&step, &ends), command, voltage_v);
        for left in &leaving[first..] {
            let lane = left.lane;
            self.joint_loss_j.as_mut()[lane] = joint_loss_j.as_ref()[lane];
            for (new, old) in self.track.ends.iter_mut().zip(&peaks) {
                new.as_mut()[lane] = old.as_ref()[lane];
            }
        }
        moved != 0
    }

    /// ẍ at the end of a step.
    #[inline(always)]
    fn acceleration_after(&self, shared: &Shared, step: &Step<W>, epsilon: W::Vector) -> W::Vector {
        let (w, mode, axis) = (self.width, &self.mode, &shared.axis);
        let p = w.splat(axis.pitch_m_per_rad());
        let to = &step.to;
        // From ε as the single run knows it; and no torque is 0, not −0.
        let delta = epsilon - step.offset;
        let mut torque = w.load(&mode.stiffness) * delta + w.load(&mode.damping) * to[2];
        torque = torque + w.splat(0.0);
        if axis.joint.is_none() {
            let motor = axis.motor().torque_constant_nm_per_a;
            torque = (w.splat(motor) * to[3]) / w.splat(axis.gear_ratio());
        }
        let a1 = w.splat(axis.resistance().linear_ns_per_rad);
        let force = w.load(&mode.resistance_n) + a1 * (to[0] - to[2]);
        p * ((torque - p * force) / w.splat(axis.moved_inertia()))
    }

    /// `x(T) = Φ·x + ψ(T)·load + Γ·V`, in the order of `Kernel::step`.
    #[inline(always)]
    fn step(&self, phase: usize, voltage_v: W::Vector) -> Step<W> {
        let (w, steps) = (self.width, &self.steps[phase]);
        let offset = w.load(&self.mode.offset_rad);
        let state = &self.track.now().state;
        let beta0 = w.load(&state[0]);
        let from = [
            w.load(&state[1]),
            w.load(&state[2]) - offset,
            w.load(&state[3]),
            w.load(&state[4]),
        ];
        let mut to = from;
        for (to, state) in to.iter_mut().zip([BETA_DOT, EPSILON, EPSILON_DOT, CURRENT]) {
            *to = steps.row(w, state, &from, None, voltage_v);
        }
        let beta1 = steps.row(w, BETA, &from, Some(beta0), voltage_v);
        let change = [
            w.abs(to[0] - from[0]),
            w.abs(to[1] - from[1]),
            w.abs(to[2] - from[2]),
            w.abs(to[3] - from[3]),
        ];
        Step {
            offset,
            beta: [beta0, beta1],
            from,
            to,
            change,
        }
    }

    /// The lanes whose joint keeps its mode over the step, by the chord bound.
    #[inline(always)]
    fn keeps(&self, phase: usize, step: &Step<W>) -> W::Mask {
        let (w, mode) = (self.width, &self.mode);
        let ends = w.min(mode.guard(w, step.from[1]), mode.guard(w, step.to[1]));
        w.greater(ends, self.steps[phase].gap_strays(w, &step.change))
    }

    /// Of the lanes that do not, those in which the sketch does not exclude a
    /// change either.
    #[inline(always)]
    fn moved(
        &self,
        shared: &Shared,
        phase: usize,
        (step, keeps): (&Step<W>, W::Mask),
        voltage_v: W::Vector,
    ) -> u64 {
        let (w, mode) = (self.width, &self.mode);
        let all = (1_u64 << W::LANES) - 1;
        let mut moved = !w.bits(keeps) & all;
        // Beyond the guard at the end, it has changed for certain.
        let beyond = w.bits(w.greater(w.splat(0.0), mode.guard(w, step.to[1])));
        let mut open = moved & !beyond;
        if open == 0 {
            return moved;
        }
        // An overflow is for the single run to report.
        let mut size = w.abs(step.beta[1]);
        for to in &step.to {
            size = size + w.abs(*to);
        }
        open &= w.bits(w.at_most(size, w.splat(f64::MAX)));
        let (mut from, mut held) = ([W::array(0.0); DRIVING], W::array(0.0));
        for (array, vector) in from.iter_mut().zip(&step.from) {
            w.store(*vector, array);
        }
        w.store(voltage_v, &mut held);
        for lane in (0..W::LANES).filter(|lane| open >> lane & 1 != 0) {
            let x = from.each_ref().map(|array| array.as_ref()[lane]);
            let closed = self.track.now().flank.as_ref()[lane] != 0.0;
            let guard = |delta: f64| mode.guard_of(lane, delta);
            if shared.phases[phase].gap_holds(closed, &x, held.as_ref()[lane], guard) {
                moved &= !(1 << lane);
            }
        }
        moved
    }

    /// Takes a step, which the lanes of `moved` leave.
    #[inline(always)]
    fn take(
        &mut self,
        shared: &Shared,
        (phase, moved): (usize, u64),
        (step, ends): (&Step<W>, &[W::Vector; FIGURES]),
        command_m: W::Vector,
        voltage_v: W::Vector,
    ) {
        let w = self.width;
        let loss = self.joint_loss_of(phase, step, voltage_v);
        w.store(w.load(&self.joint_loss_j) + loss, &mut self.joint_loss_j);
        let length_ns = shared.phases[phase].length_ns;
        let slot = self.track.step(w, (phase, length_ns), voltage_v, moved);
        w.store(step.beta[1], &mut slot.state[0]);
        w.store(step.to[0], &mut slot.state[1]);
        w.store(step.to[1] + step.offset, &mut slot.state[2]);
        w.store(step.to[2], &mut slot.state[3]);
        w.store(step.to[3], &mut slot.state[4]);
        w.store(command_m, &mut slot.command_m);
        w.store(ends[0], &mut self.acceleration_mps2);
        for (largest, end) in self.track.ends.iter_mut().zip(ends) {
            w.store(w.max(w.abs(*end), w.load(largest)), largest);
        }
        for (largest, change) in self.track.changes.iter_mut().zip(&step.change) {
            w.store(w.max(*change, w.load(largest)), largest);
        }
        let peak_v = w.max(w.abs(voltage_v), w.load(&self.peak_abs_voltage_v));
        w.store(peak_v, &mut self.peak_abs_voltage_v);
    }

    /// Notes what the lanes of `moved` begin the step with.
    #[inline(always)]
    fn leave(
        &self,
        (group, phase): (usize, usize),
        moved: u64,
        (voltage_v, command): (W::Vector, W::Vector),
        leaving: &mut Vec<Leaving>,
    ) {
        let now = self.track.now();
        let (mut held, mut command_m) = (W::array(0.0), W::array(0.0));
        self.width.store(voltage_v, &mut held);
        self.width.store(command, &mut command_m);
        for lane in (0..W::LANES).filter(|lane| moved >> lane & 1 != 0) {
            leaving.push(Leaving {
                group,
                lane,
                phase,
                y: self.state(lane),
                voltage_v: held.as_ref()[lane],
                commands_m: [now.command_m.as_ref()[lane], command_m.as_ref()[lane]],
                time_ns: now.time_ns,
            });
        }
    }

    /// Sets a lane's numbers to its mode.
    pub(super) fn take_mode(&mut self, shared: &mut Shared, lane: usize) {
        let plant = &self.lanes[lane].plant;
        let (mode, axis) = (*plant.mode(), *plant.axis());
        self.mode.set(lane, plant);
        self.track.now_mut().flank.as_mut()[lane] = self.mode.joint.as_ref()[lane];
        let closed = mode.joint.carries();
        let mut learnt = false;
        for (phase, steps) in shared.phases.iter_mut().zip(&mut self.steps) {
            match phase.numbers(closed) {
                Some(numbers)
                    if mode.guide == GuideMode::AsWritten && (steps.knows_loss || !closed) =>
                {
                    steps.set(lane, numbers);
                }
                _ => {
                    let place = shared.tables.held(&axis, &mode, phase.length_ns);
                    let table = &shared.tables.held[place];
                    learnt |= phase.learn(table, &axis);
                    steps.set(lane, &numbers_of(table));
                    steps.learn_loss(table);
                }
            }
        }
        if learnt {
            shared.find_most_chords();
        }
    }

    /// Sets a lane's figures and peaks at the start of the motion.
    fn take_figures(&mut self, lane: usize) {
        let figures = self.lanes[lane].plant.figures(0.0);
        self.acceleration_mps2.as_mut()[lane] = figures[0];
        let starts = self.track.starts.iter_mut().zip(&mut self.peaks);
        for ((start, peak), figure) in starts.zip(figures) {
            start.as_mut()[lane] = figure.abs();
            peak.as_mut()[lane] = figure.abs();
        }
    }

    /// State of a lane.
    pub(super) fn state(&self, lane: usize) -> State {
        state_of::<W>(&self.track.now().state, lane)
    }

    /// Looks at what still waits for a look.
    #[inline(always)]
    pub(super) fn look_back(&mut self, shared: &mut Shared) {
        self.look_at_track(shared);
        for lane in 0..W::LANES {
            self.answer(shared, lane);
        }
    }

    /// Extremes of a lane so far, where nothing waits.
    pub(super) fn extremes_of(
        &self,
        lengths_ns: &[u64],
        lane: usize,
    ) -> Result<Extremes, PlantError> {
        let run = &self.lanes[lane];
        run.result?;
        let mut extremes = run.extremes;
        for (peak, figure) in self.peaks.iter().zip(extremes.peaks_mut()) {
            *figure = figure.max(peak.as_ref()[lane]);
        }
        let voltage_v = self.peak_abs_voltage_v.as_ref()[lane];
        extremes.peak_abs_voltage_v = extremes.peak_abs_voltage_v.max(voltage_v);
        extremes.joint_loss_j = self.joint_loss_j.as_ref()[lane];
        let start_ns = self.last_outside.as_ref()[lane].max(self.all_outside);
        if start_ns >= 0.0 {
            // The end of that step, summed as a span does.
            let length_s = seconds(length_at(lengths_ns, start_ns));
            let end_s = start_ns / 1e9 + length_s;
            let last_s = extremes.last_outside_band_s.map_or(end_s, |t| t.max(end_s));
            extremes.last_outside_band_s = Some(last_s);
        }
        Ok(extremes)
    }
}

/// Length of the step that began at `start_ns`.
fn length_at(lengths_ns: &[u64], start_ns: f64) -> u64 {
    let sample_ns: u64 = lengths_ns.iter().sum();
    let into_ns = start_ns % crate::plant::count(sample_ns);
    let second = lengths_ns.len() > 1 && into_ns != 0.0;
    lengths_ns[usize::from(second)]
}

pub(super) fn state_of<W: Width>(arrays: &[W::Array; HELD], lane: usize) -> State {
    let value = |place: usize| arrays[place].as_ref()[lane];
    State {
        beta_rad: value(0),
        beta_dot_radps: value(1),
        epsilon_rad: value(2),
        epsilon_dot_radps: value(3),
        current_a: value(4),
        beta_integral_rads: 0.0,
    }
}
