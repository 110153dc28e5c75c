//! The step that all lanes of a group take, and which of them leave it.

use super::group::{Group, PLACES, Shared};
use super::phase::{Kind, Phase, times_sizes_of};
use super::questions::PastStep;
use crate::exact::{DRIVING, HELD, Quantity, WholeStep, sizes_of};
use crate::model::axis::Axis;
use crate::model::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT, State};
use crate::model::surroundings::Start;
use crate::numerics::seconds;
use crate::numerics::width::Width;
use crate::observe::extremes::{CARRIAGE, ENERGIES, FIGURES};

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
    /// When the step begins \[ns\].
    pub(super) time_ns: u64,
    /// The caller counts its time at the limit of the voltage.
    pub(super) counted: bool,
}

/// Quantities of guards: δ, the current and what the guide's looks at.
const STRAYS: usize = 3;

/// One step of all lanes: the driving states at both ends, and more.
#[derive(Clone, Copy)]
pub(super) struct Step<W: Width> {
    /// `m·b` of `δ = ε − m·b`.
    pub(super) offset: W::Vector,
    /// β at both ends.
    pub(super) beta: [W::Vector; 2],
    /// β̇, δ, ε̇ and I at the start.
    pub(super) from: [W::Vector; DRIVING],
    /// The same at the end.
    pub(super) to: [W::Vector; DRIVING],
    /// Rates at the start.
    rates: [W::Vector; DRIVING],
    /// Magnitudes of these.
    pub(super) sizes: W::Quad,
    /// Energies \[J\].
    pub(super) energies: [W::Vector; ENERGIES],
    /// Control points of δ between its ends.
    pub(super) inner: [W::Vector; 2],
    /// How far δ may stray from these, and a limited current and what the guide's guard looks
    /// at from their chords.
    pub(super) strays: [W::Vector; STRAYS],
}

impl<W: Width> Step<W> {
    /// The step from `y` = (β, β̇, ε, ε̇, I) in one kind of mode.
    #[inline(always)]
    fn in_kind(
        w: W,
        shared: &Shared,
        (kind, whole): (Kind, &WholeStep),
        (y, offset): (&[W::Vector; HELD], W::Vector),
        voltage_v: W::Vector,
    ) -> Self {
        let x = [
            y[BETA],
            y[BETA_DOT],
            y[EPSILON] - offset,
            y[EPSILON_DOT],
            y[CURRENT],
        ];
        let [states, others] = whole.sums(w, &x, voltage_v);
        let [end, beta_dot, delta, epsilon_dot] = w.parts(states);
        let [beta_rate, current, epsilon_rate, current_rate] = w.parts(others);
        let mut to = [beta_dot, delta, epsilon_dot, current];
        if shared.has_stiction && kind.is_stuck() {
            // γ̇ = 0 to the last bit.
            match shared.axis.joint {
                Some(_) => to[2] = to[0],
                None => to[0] = w.splat(0.0),
            }
        }
        let rates = [beta_rate, x[EPSILON_DOT], epsilon_rate, current_rate];
        let sizes = sizes_of(w, others, x[EPSILON_DOT]);
        let mut strays = [w.splat(0.0); STRAYS];
        strays[0] = whole.gap_strays(w, sizes);
        if shared.limits.is_some() {
            strays[1] = whole.current_strays(w, sizes);
        }
        if shared.has_stiction {
            strays[2] = whole.guide_strays(w, sizes);
        }
        let [_, from @ ..] = x;
        Self {
            offset,
            beta: [y[BETA], end],
            from,
            to,
            rates,
            sizes,
            energies: whole.energies(w, (x[CURRENT], &rates), voltage_v),
            // A third of the step: all kinds have the same.
            inner: whole.inner_points(w, [from[1], to[1]], [from[2], to[2]]),
            strays,
        }
    }

    /// Takes over the lanes of `lanes` from the step in another kind of mode.
    #[inline(always)]
    fn blend(&mut self, w: W, lanes: u64, other: &Self) {
        let lanes = w.lanes(lanes);
        for (all, of_kind) in [
            (&mut self.beta[1..], &other.beta[1..]),
            (&mut self.to, &other.to),
            (&mut self.rates, &other.rates),
            (&mut self.energies, &other.energies),
            (&mut self.inner, &other.inner),
            (&mut self.strays, &other.strays),
        ] {
            for (all, of_kind) in all.iter_mut().zip(of_kind) {
                *all = w.select(lanes, *of_kind, *all);
            }
        }
        self.sizes = w.quad_abs(w.quad(self.rates));
    }
}

/// The lanes of a group, which have their steps in common.
#[derive(Debug)]
pub struct InStep<'a, W: Width> {
    shared: &'a mut Shared,
    group: &'a mut Group<W>,
    number: usize,
    leaving: &'a mut Vec<Leaving>,
    /// β, β̇, ε, ε̇ and I of every lane: those of the group's present slot.
    y: [W::Vector; HELD],
    acceleration_mps2: W::Vector,
}

impl<'a, W: Width> InStep<'a, W> {
    #[inline(always)]
    pub(super) fn new(
        shared: &'a mut Shared,
        group: &'a mut Group<W>,
        number: usize,
        leaving: &'a mut Vec<Leaving>,
    ) -> Self {
        let w = group.width;
        let now = group.track.now();
        let y = w.load_each(&now.state);
        Self {
            acceleration_mps2: w.load(&now.acceleration_mps2),
            shared,
            group,
            number,
            leaving,
            y,
        }
    }

    /// β of every lane \[rad\].
    #[inline(always)]
    pub fn beta_rad(&self) -> W::Vector {
        let w = self.group.width;
        self.y[BETA] + w.load(&self.group.start_rad)
    }

    /// β of every lane from where its axis starts \[rad\].
    #[inline(always)]
    pub fn beta_from_start_rad(&self) -> W::Vector {
        match self.shared.start {
            Start::Centred => self.y[BETA],
            // As whoever has β makes it.
            _ => self.beta_rad() - self.group.width.load(&self.group.start_rad),
        }
    }

    /// ε of every lane \[rad\].
    #[inline(always)]
    pub fn epsilon_rad(&self) -> W::Vector {
        self.y[EPSILON]
    }

    /// ẍ of every lane \[m/s²\].
    #[inline(always)]
    pub fn acceleration_mps2(&self) -> W::Vector {
        self.acceleration_mps2
    }

    /// Advances every lane by a step of length number `phase`, under a voltage
    /// \[V\] of its own; `command_m` is x_ref at the end of the step \[m\], and of the lanes
    /// in `counted` the caller counts the time at the limit of the voltage. Returns
    /// whether the group is now held up (see [`super::Batch::catch_up`]): it must not be
    /// asked for anything before it no longer is.
    #[inline(always)]
    pub fn advance(
        &mut self,
        phase: usize,
        voltage_v: W::Vector,
        command_m: W::Vector,
        counted: u64,
    ) -> bool {
        let w = self.group.width;
        if self.group.track.block_is_full() {
            let (group, shared) = (&mut *self.group, &mut *self.shared);
            w.apart(
                #[inline(always)]
                || group.change_block(shared),
            );
        }
        let (group, shared) = (&mut *self.group, &mut *self.shared);
        let all = (1_u64 << W::LANES) - 1;
        let of_phase = &shared.phases[phase];
        let length_ns = of_phase.length_ns;
        let Some(step) = group.begin(shared, of_phase, &self.y, voltage_v) else {
            return false;
        };
        let keeps = group.keeps(shared, &step);
        let epsilon = step.to[1] + step.offset;
        // Outside the settling band at the end.
        let p = w.splat(shared.axis.pitch_m_per_rad);
        let start = w.load(&group.start_rad);
        let carriage = p * ((step.beta[1] - epsilon) + start);
        let distance = w.abs(w.load(&group.travel_m) - carriage);
        let outside = w.greater(distance, w.load(&group.band_m));
        let ends = [
            group.acceleration_after(shared, &step, epsilon),
            step.to[3],
            command_m - carriage,
            command_m - p * step.beta[1],
            voltage_v * w.max(w.abs(step.from[3]), w.abs(step.to[3])),
        ];
        self.acceleration_mps2 = ends[0];
        self.y = [step.beta[1], step.to[0], epsilon, step.to[2], step.to[3]];
        let plain = keeps == [all; 2]
            && group.has_voltage_to_spare(shared, voltage_v)
            && (w.bits(outside) == all
                || w.bits(outside) | group.stays_inside(shared, phase, (&step, distance)) == all);
        if plain {
            group.follow_outside(shared, w.bits(outside));
            group.take((phase, length_ns), 0, (&step, &ends), command_m, voltage_v);
            return false;
        }
        let (number, leaving) = (self.number, &mut *self.leaving);
        w.apart(
            #[inline(always)]
            move || {
                let looked = (distance, outside, keeps);
                let given = (voltage_v, command_m, counted);
                group.take_seldom(
                    shared,
                    (number, phase),
                    (&step, &ends),
                    looked,
                    given,
                    leaving,
                )
            },
        )
    }
}

impl<W: Width> Group<W> {
    /// The lanes that are within the settling band over the whole step, at the end of which
    /// they are this far from the travel.
    #[inline(always)]
    fn stays_inside(
        &self,
        shared: &Shared,
        phase: usize,
        (step, distance): (&Step<W>, W::Vector),
    ) -> u64 {
        let w = self.width;
        let before = self.distance_before(shared, step);
        let closed = w.greater(w.abs(w.load(&self.track.now().flank)), w.splat(0.5));
        let strays = &shared.phases[phase].chords[CARRIAGE];
        let farthest = w.max(distance, before) + times_sizes_of(w, closed, strays, step.sizes);
        w.bits(w.at_most(farthest, w.load(&self.band_m)))
    }

    /// How far the carriage is from the travel at the start of a step \[m\].
    #[inline(always)]
    fn distance_before(&self, shared: &Shared, step: &Step<W>) -> W::Vector {
        let w = self.width;
        let p = w.splat(shared.axis.pitch_m_per_rad);
        let start = w.load(&self.start_rad);
        let carriage = p * ((step.beta[0] - (step.from[1] + step.offset)) + start);
        w.abs(w.load(&self.travel_m) - carriage)
    }

    /// Follows which lanes end a step outside the settling band; the step that begins now ends
    /// so in those of `outside`.
    #[inline(always)]
    pub(super) fn follow_outside(&mut self, shared: &Shared, outside: u64) {
        let entered = core::mem::replace(&mut self.outside, outside) & !outside;
        if entered != 0 {
            self.note_outside(shared, entered);
        }
    }

    /// Notes the end of the step before as the last one outside.
    #[cold]
    #[inline(never)]
    fn note_outside(&mut self, shared: &Shared, lanes: u64) {
        let before = &self.track.slots[self.track.now.wrapping_sub(1) % PLACES];
        // The end as spans sum it up.
        let end_s = seconds(before.time_ns) + shared.phases[before.phase].length_s;
        for (lane, last_s) in self.last_outside.as_mut().iter_mut().enumerate() {
            if lanes >> lane & 1 != 0 {
                *last_s = end_s;
            }
        }
    }

    /// Takes a step that a lane may leave, or in which it may have left the settling
    /// band; returns whether one leaves it.
    #[inline(always)]
    fn take_seldom(
        &mut self,
        shared: &mut Shared,
        (number, phase): (usize, usize),
        (step, ends): (&Step<W>, &[W::Vector; FIGURES]),
        (distance, outside, keeps): (W::Vector, W::Mask, [u64; 2]),
        (voltage_v, command, counted): (W::Vector, W::Vector, u64),
        leaving: &mut Vec<Leaving>,
    ) -> bool {
        let all = (1_u64 << W::LANES) - 1;
        let moved = self.moved(shared, phase, (step, keeps));
        // Inside at the end, but perhaps not before it.
        let outside = self.width.bits(outside) & !moved;
        let inside = self.stays_inside(shared, phase, (step, distance));
        let wanted = !(outside | moved | inside) & all;
        if wanted != 0 {
            let before = self.distance_before(shared, step);
            let starts_outside = self.width.greater(before, self.width.load(&self.band_m));
            let starts_outside = self.width.bits(starts_outside);
            self.note_entry(shared, phase, (wanted, starts_outside), voltage_v);
        }
        let first = leaving.len();
        if moved != 0 {
            let given = (voltage_v, command, counted);
            self.leave((number, phase), moved, given, leaving);
        }
        self.count_limits(shared, phase, !(moved | counted) & all, voltage_v);
        self.follow_outside(shared, outside);
        let (peaks, energies) = (self.track.ends, self.energies);
        let largest_v = self.track.voltage_v;
        let length_ns = shared.phases[phase].length_ns;
        self.take((phase, length_ns), moved, (step, ends), command, voltage_v);
        for left in &leaving[first..] {
            let lane = left.lane;
            if shared.limits.is_some() {
                // The motor has less than was commanded, perhaps.
                self.track.voltage_v.as_mut()[lane] = largest_v.as_ref()[lane];
            }
            let sums = self.energies.iter_mut().zip(&energies);
            for (new, old) in sums.chain(self.track.ends.iter_mut().zip(&peaks)) {
                new.as_mut()[lane] = old.as_ref()[lane];
            }
        }
        moved != 0
    }

    /// ẍ at the end of a step.
    #[inline(always)]
    fn acceleration_after(&self, shared: &Shared, step: &Step<W>, epsilon: W::Vector) -> W::Vector {
        let (w, mode, axis) = (self.width, &self.mode, &shared.axis);
        let p = w.splat(axis.pitch_m_per_rad);
        let to = &step.to;
        // From ε as the single run knows it; and no torque is 0, not −0.
        let delta = epsilon - step.offset;
        let mut torque = w.load(&mode.stiffness) * delta + w.load(&mode.damping) * to[2];
        torque = torque + w.splat(0.0);
        if axis.joint.is_none() {
            let motor = axis.motor.torque_constant_nm_per_a;
            torque = (w.splat(motor) * to[3]) / w.splat(axis.gear_ratio);
        }
        let a1 = axis.resistance.linear_ns_per_rad;
        let mut force = w.load(&mode.resistance_n);
        if a1 != 0.0 {
            force = force + w.splat(a1) * (to[0] - to[2]);
        }
        let force = force + w.splat(axis.load_force_n);
        let slides = (torque - p * force) * w.splat(axis.pitch_per_inertia);
        match shared.has_stiction {
            true => w.select(mode.is_stuck(w), w.splat(0.0), slides),
            false => slides,
        }
    }

    /// Every lane's step: a pass for each kind of mode that there is.
    #[inline(always)]
    fn begin(
        &self,
        shared: &Shared,
        phase: &Phase,
        y: &[W::Vector; HELD],
        voltage_v: W::Vector,
    ) -> Option<Step<W>> {
        let w = self.width;
        let start = (y, w.load(&self.mode.offset_rad));
        let (first, others) = self.kinds.first_and_others();
        let whole = &phase.of(first)?.step;
        let mut step = Step::in_kind(w, shared, (first, whole), start, voltage_v);
        if W::LANES > 1 {
            for (kind, lanes) in others {
                let whole = &phase.of(kind)?.step;
                let of_kind = Step::in_kind(w, shared, (kind, whole), start, voltage_v);
                step.blend(w, lanes, &of_kind);
            }
        }
        Some(step)
    }

    /// The lanes whose joint keeps its mode over the step, and those whose guide and current
    /// do, by the cubic and the chords.
    #[inline(always)]
    fn keeps(&self, shared: &Shared, step: &Step<W>) -> [u64; 2] {
        let (w, mode) = (self.width, &self.mode);
        let [gap, current, guide] = step.strays;
        let [c, d] = step.inner;
        let lowest = mode.lowest_guard(w, &[step.from[1], c, d, step.to[1]]);
        // No number where a state is not finite, which excludes nothing.
        let [a, b, c, d] = step.to;
        let none = w.splat(0.0) * ((step.beta[1] + a) + ((b + c) + d));
        let joint = w.bits(w.greater(lowest, gap + none));
        let mut within = (1 << W::LANES) - 1;
        if let Some([_, limit_a]) = shared.limits {
            let ends = w.max(w.abs(step.from[3]), w.abs(step.to[3]));
            within = w.bits(w.greater(w.splat(limit_a) - ends, current));
        }
        if !shared.has_stiction {
            return [joint, within];
        }
        let (from, to) = (
            self.guide_guard(&shared.axis, &step.from),
            self.guide_guard(&shared.axis, &step.to),
        );
        let guide = w.bits(w.greater(w.min(from, to), guide));
        [joint, guide & within]
    }

    /// True if no lane has a limited current and all the voltage that there is.
    #[inline(always)]
    fn has_voltage_to_spare(&self, shared: &Shared, voltage_v: W::Vector) -> bool {
        let w = self.width;
        shared
            .limits
            .is_none_or(|[limit_v, _]| w.bits(w.at_most(w.splat(limit_v), w.abs(voltage_v))) == 0)
    }

    /// Counts the step as time at the limit of the voltage where the current is limited, in
    /// the lanes of `asked`.
    fn count_limits(&mut self, shared: &Shared, phase: usize, asked: u64, voltage_v: W::Vector) {
        let Some([limit_v, _]) = shared.limits else {
            return;
        };
        let length_s = shared.phases[phase].length_s;
        let held = self.width.stored(voltage_v);
        for (lane, voltage_v) in held.as_ref().iter().enumerate() {
            if asked >> lane & 1 != 0 && voltage_v.abs() >= limit_v {
                self.lanes[lane].extremes.voltage_limited_s += length_s;
            }
        }
    }

    /// The guard of the guide, from the driving states.
    #[inline(always)]
    fn guide_guard(&self, axis: &Axis, x: &[W::Vector; DRIVING]) -> W::Vector {
        let (w, mode) = (self.width, &self.mode);
        let torque = match axis.joint {
            Some(_) => w.load(&mode.stiffness) * x[1] + w.load(&mode.damping) * x[2],
            None => w.splat(axis.motor.torque_nm(1.0) / axis.gear_ratio) * x[3],
        };
        mode.guide_guard(w, x[0] - x[2], torque - w.splat(axis.load_torque_nm()))
    }

    /// Of the lanes that do not keep their mode for certain, those in which the sketch of
    /// the gap does not exclude a change either.
    #[inline(always)]
    fn moved(
        &self,
        shared: &Shared,
        phase: usize,
        (step, [joint, others]): (&Step<W>, [u64; 2]),
    ) -> u64 {
        let (w, mode) = (self.width, &self.mode);
        let all = (1_u64 << W::LANES) - 1;
        let mut moved = !(joint & others) & all;
        // Beyond the guard at the end, it has changed for certain.
        let beyond = w.bits(w.greater(w.splat(0.0), mode.guard(w, step.to[1])));
        let mut open = moved & others & !beyond;
        if open == 0 {
            return moved;
        }
        // An overflow is for the single run to report.
        let mut size = w.abs(step.beta[1]);
        for to in &step.to {
            size = size + w.abs(*to);
        }
        open &= w.bits(w.at_most(size, w.splat(f64::MAX)));
        let ([a, b, c, d], [e, f, g, h]) = (step.from, step.rates);
        let from = (&[step.beta[0], a, b, c, d], &[a, e, f, g, h]);
        let gap = (w.splat(1.0), w.splat(0.0));
        for (kind, lanes) in self.kinds.present() {
            let asked = open & lanes;
            if asked == 0 {
                continue;
            }
            let Some(held) = shared.phases[phase].of(kind) else {
                continue;
            };
            let linear = held.table.quantity(Quantity::Delta);
            if let Some(curve) = linear.curve(w, &held.table.levels, from, gap) {
                let lowest = mode.lowest_guard(w, &curve.values);
                moved &= !(asked & w.bits(w.greater(lowest, curve.stray)));
            }
        }
        moved
    }

    /// Notes the step that begins now in the lanes of `wanted`: it ends within the settling
    /// band, but may have been outside. Only the last such step counts, unless it stays inside.
    #[cold]
    #[inline(never)]
    fn note_entry(
        &mut self,
        shared: &mut Shared,
        phase: usize,
        (wanted, starts_outside): (u64, u64),
        voltage_v: W::Vector,
    ) {
        let held = self.width.stored(voltage_v);
        for lane in (0..self.runs).filter(|lane| wanted >> lane & 1 != 0) {
            let entry = PastStep {
                state: self.state(lane),
                mode: self.lanes[lane].plant.mode,
                voltage_v: held.as_ref()[lane],
                phase,
                time_ns: self.track.now().time_ns,
            };
            let before = self.lanes[lane].entry.replace(entry);
            if let Some(before) = before
                && starts_outside >> lane & 1 == 0
            {
                self.lanes[lane].look_at_entry(shared, &before);
            }
        }
    }

    /// Takes a step, which the lanes of `moved` leave.
    #[inline(always)]
    fn take(
        &mut self,
        (phase, length_ns): (usize, u64),
        moved: u64,
        (step, ends): (&Step<W>, &[W::Vector; FIGURES]),
        command_m: W::Vector,
        voltage_v: W::Vector,
    ) {
        let w = self.width;
        for (sum, energy) in self.energies.iter_mut().zip(step.energies) {
            w.store(w.load(sum) + energy, sum);
        }
        let slot = self.track.step(w, (phase, length_ns), voltage_v, moved);
        w.store(step.beta[1], &mut slot.state[0]);
        w.store(step.to[0], &mut slot.state[1]);
        w.store(step.to[1] + step.offset, &mut slot.state[2]);
        w.store(step.to[2], &mut slot.state[3]);
        w.store(step.to[3], &mut slot.state[4]);
        w.store(command_m, &mut slot.command_m);
        w.store(ends[0], &mut slot.acceleration_mps2);
        for (largest, end) in self.track.ends.iter_mut().zip(ends) {
            w.store(w.max(w.abs(*end), w.load(largest)), largest);
        }
        let rates = w.quad_max(step.sizes, w.load_quad(&self.track.rates));
        w.store_quad(rates, &mut self.track.rates);
        let largest_v = &mut self.track.voltage_v;
        w.store(w.max(w.abs(voltage_v), w.load(largest_v)), largest_v);
    }

    /// Notes what the lanes of `moved` begin the step with.
    #[inline(always)]
    fn leave(
        &mut self,
        (group, phase): (usize, usize),
        moved: u64,
        (voltage_v, command, counted): (W::Vector, W::Vector, u64),
        leaving: &mut Vec<Leaving>,
    ) {
        self.held_up += moved.count_ones() as usize;
        let now = self.track.now();
        let held = self.width.stored(voltage_v);
        let command_m = self.width.stored(command);
        for lane in (0..W::LANES).filter(|lane| moved >> lane & 1 != 0) {
            leaving.push(Leaving {
                group,
                lane,
                phase,
                y: self.state(lane),
                voltage_v: held.as_ref()[lane],
                commands_m: [now.command_m.as_ref()[lane], command_m.as_ref()[lane]],
                time_ns: now.time_ns,
                counted: counted >> lane & 1 != 0,
            });
        }
    }
}
