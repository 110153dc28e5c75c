//! The states of all lanes, one step at a time.

use super::closer::Lane;
use super::modes::ModeNumbers;
use super::pending::{MOST_PENDING, Pending};
use super::phase::{DRIVING, Phase, closed_lanes, dot};
use super::width::Width;
use crate::axis::Axis;
use crate::error::PlantError;
use crate::exact::{CARRIAGE, FIGURES, HELD, Tables};
use crate::extremes::{Extremes, ExtremesSettings};
use crate::parameters::AxisParameters;
use crate::plant::{Plant, seconds};
use crate::state::{BETA, BETA_DOT, CURRENT, EPSILON, EPSILON_DOT, State};

/// What is a lane's own about the plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaneSetup {
    /// `b`, half the backlash \[rad\]; without meaning on a rigid axis.
    pub backlash_half_rad: f64,
    /// The command and the settling band.
    pub extremes: ExtremesSettings,
}

/// Many runs of one axis, side by side.
#[derive(Debug, Clone)]
pub struct Batch<W: Width> {
    pub(crate) width: W,
    pub(crate) axis: Axis,
    pub(crate) tables: Tables,
    pub(crate) phases: Vec<Phase<W>>,
    pub(crate) lanes: Vec<Lane>,
    pub(crate) time_ns: u64,
    /// β, β̇, ε, ε̇, I.
    pub(crate) state: [W::Array; HELD],
    pub(crate) mode: ModeNumbers<W>,
    /// ẍ, I, and how far carriage and motor are behind the command, now.
    pub(crate) figures: [W::Array; FIGURES],
    /// Sup of the figures' magnitudes over the steps' ends.
    pub(crate) peaks: [W::Array; FIGURES],
    /// What they are known to reach, between the ends too.
    pub(crate) floors: [W::Array; FIGURES],
    peak_abs_voltage_v: W::Array,
    /// What the joints' dampers have taken \[J\].
    pub(crate) joint_loss_j: W::Array,
    /// Number of the last step that ended outside the settling band.
    pub(crate) last_outside: W::Array,
    travel_m: W::Array,
    band_m: W::Array,
    /// `T²·sup|a_ref|` with the longest of the steps' lengths T \[m\].
    pub(crate) bend_m: W::Array,
    /// Steps in which a figure may have exceeded its peak between the ends, to
    /// be looked at when they are many; most are outdone by later ends.
    pub(crate) pending: Vec<Pending<W>>,
}

/// What a step began with, for the lanes that leave it.
#[derive(Debug, Clone)]
pub(crate) struct Before<W: Width> {
    pub(crate) state: [W::Array; HELD],
    pub(crate) peaks: [W::Array; FIGURES],
    pub(crate) last_outside: W::Array,
    pub(crate) joint_loss_j: W::Array,
    pub(crate) voltage_v: W::Array,
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

impl<W: Width> Batch<W> {
    /// Lanes at rest, for steps of the given lengths \[ns\]: one a sample, or two
    /// where a computation delay divides it.
    ///
    /// # Errors
    /// [`PlantError::NotAffine`] with a quadratic resistance.
    pub fn new(
        width: W,
        parameters: &AxisParameters,
        lengths_ns: &[u64],
    ) -> Result<Self, PlantError> {
        if !parameters.is_affine() {
            return Err(PlantError::NotAffine);
        }
        let zero = W::array(0.0);
        Ok(Self {
            width,
            axis: Axis::new(parameters, 0.0),
            tables: Tables::default(),
            phases: lengths_ns.iter().map(|&ns| Phase::new(ns)).collect(),
            lanes: Vec::new(),
            time_ns: 0,
            state: [zero; HELD],
            mode: ModeNumbers::new(),
            figures: [zero; FIGURES],
            peaks: [zero; FIGURES],
            floors: [zero; FIGURES],
            peak_abs_voltage_v: zero,
            joint_loss_j: zero,
            last_outside: zero,
            travel_m: zero,
            band_m: zero,
            bend_m: zero,
            pending: Vec::with_capacity(MOST_PENDING),
        })
    }

    /// Puts every lane at rest at zero. Lanes without a setup repeat the last
    /// one; there must be one at least, else nothing is started.
    pub fn start(&mut self, setups: &[LaneSetup]) {
        let Some(last) = setups.last() else { return };
        let zero = W::array(0.0);
        let longest_ns = self.phases.iter().map(|phase| phase.length_ns).max();
        let longest_s = seconds(longest_ns.unwrap_or(0));
        self.time_ns = 0;
        self.state = [zero; HELD];
        self.figures = [zero; FIGURES];
        self.peaks = [zero; FIGURES];
        self.floors = [zero; FIGURES];
        self.peak_abs_voltage_v = zero;
        self.joint_loss_j = zero;
        self.last_outside = W::array(-1.0);
        self.lanes.clear();
        self.pending.clear();
        for lane in 0..W::LANES {
            let setup = setups.get(lane).unwrap_or(last);
            let motion = &setup.extremes.motion;
            self.travel_m.as_mut()[lane] = motion.travel_m();
            self.band_m.as_mut()[lane] = setup.extremes.settling_band_m;
            self.bend_m.as_mut()[lane] = motion.peak_acceleration_mps2() * (longest_s * longest_s);
            self.lanes.push(Lane {
                plant: Plant::of_axis(self.axis.with_backlash(setup.backlash_half_rad)),
                extremes: Extremes::new(setup.extremes),
                result: Ok(()),
            });
            self.take_mode(lane);
            self.take_figures(lane);
        }
    }

    /// β of every lane \[rad\].
    #[inline(always)]
    pub fn beta_rad(&self) -> W::Vector {
        self.width.load(&self.state[0])
    }

    /// ε of every lane \[rad\].
    #[inline(always)]
    pub fn epsilon_rad(&self) -> W::Vector {
        self.width.load(&self.state[2])
    }

    /// ẍ of every lane \[m/s²\].
    #[inline(always)]
    pub fn acceleration_mps2(&self) -> W::Vector {
        self.width.load(&self.figures[0])
    }

    /// Advances every lane by a step of length number `phase`, under a voltage
    /// \[V\] of its own; `command_m` is x_ref at the end of the step \[m\].
    #[inline(always)]
    pub fn advance(&mut self, phase: usize, voltage_v: W::Vector, command_m: &W::Array) {
        let w = self.width;
        let step = self.step(phase, voltage_v);
        let moved = self.moved(phase, &step, voltage_v);
        let ends = self.figures_after(&step, w.load(command_m));
        let (uppers, pending) = self.uppers(phase, &step, &ends);

        // Outside the settling band at the end, or perhaps before it.
        let p = w.splat(self.axis.pitch_m_per_rad());
        let half = w.splat(0.5);
        let (travel, band) = (w.load(&self.travel_m), w.load(&self.band_m));
        let carriage = p * (step.beta[1] - (step.to[1] + step.offset));
        let distance = w.abs(travel - carriage);
        let carriage = p * (step.beta[0] - (step.from[1] + step.offset));
        let before = w.abs(travel - carriage);
        let outside = w.greater(distance, band);
        let stray = dot(w, &self.phases[phase].slopes[CARRIAGE], &step.change);
        let inside = w.at_most(w.larger(distance, before) + stray * half, band);
        let all = (1_u64 << W::LANES) - 1;
        let wanted = !(w.bits(inside) | w.bits(outside) | moved) & all;

        let pending = pending & !moved;
        if moved | wanted | pending == 0 {
            self.take(phase, &step, &ends, outside, voltage_v);
        } else {
            let before = self.before(voltage_v);
            if pending != 0 {
                self.wait((phase, moved), &step, &before, (&ends, &uppers));
            }
            self.take(phase, &step, &ends, outside, voltage_v);
            if moved | wanted != 0 {
                self.look_closer((phase, moved, wanted), &before, command_m);
            }
        }
        self.time_ns += self.phases[phase].length_ns;
    }

    /// `x(T) = Φ·x + ψ(T)·load + Γ·V`, in the order of `Kernel::step`.
    #[inline(always)]
    fn step(&self, phase: usize, voltage_v: W::Vector) -> Step<W> {
        let (w, phase) = (self.width, &self.phases[phase]);
        let offset = w.load(&self.mode.offset_rad);
        let beta0 = w.load(&self.state[0]);
        let from = [
            w.load(&self.state[1]),
            w.load(&self.state[2]) - offset,
            w.load(&self.state[3]),
            w.load(&self.state[4]),
        ];
        let mut to = from;
        for (to, state) in to.iter_mut().zip([BETA_DOT, EPSILON, EPSILON_DOT, CURRENT]) {
            *to = phase.row(w, state, &from, w.load(&phase.drift[state]), voltage_v);
        }
        let base = beta0 + w.load(&phase.drift[BETA]);
        let beta1 = phase.row(w, BETA, &from, base, voltage_v);
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

    /// The lanes whose joint may change its mode within the step.
    #[inline(always)]
    fn moved(&self, phase: usize, step: &Step<W>, voltage_v: W::Vector) -> u64 {
        let (w, phase, mode) = (self.width, &self.phases[phase], &self.mode);
        let all = (1_u64 << W::LANES) - 1;
        let ends = w.smaller(mode.guard(w, step.from[1]), mode.guard(w, step.to[1]));
        let keeps = w.greater(ends, dot(w, &phase.gap_bound, &step.change));
        let moved = !w.bits(keeps) & all;
        if moved == 0 {
            return 0;
        }
        // Perhaps it keeps it after all.
        let closed = closed_lanes(w, &phase.closed);
        let rates = phase.rates.at(w, closed, &step.from, voltage_v);
        let mut lowest = ends;
        let mut delta = step.from[1];
        for rise in phase.gap.rises(w, closed, &rates) {
            delta = delta + rise;
            lowest = w.smaller(mode.guard(w, delta), lowest);
        }
        let stray = phase.gap.stray(w, closed, &rates, w.abs(step.from[1]));
        // An overflow is for the single run to report.
        let mut size = w.abs(step.beta[1]);
        for to in &step.to {
            size = size + w.abs(*to);
        }
        let finite = w.bits(w.at_most(size, w.splat(f64::MAX)));
        moved & !(w.bits(w.greater(lowest, stray)) & finite)
    }

    /// Takes a step.
    #[inline(always)]
    fn take(
        &mut self,
        phase: usize,
        step: &Step<W>,
        ends: &[W::Vector; FIGURES],
        outside: W::Mask,
        voltage_v: W::Vector,
    ) {
        let w = self.width;
        w.store(step.beta[1], &mut self.state[0]);
        w.store(step.to[0], &mut self.state[1]);
        w.store(step.to[1] + step.offset, &mut self.state[2]);
        w.store(step.to[2], &mut self.state[3]);
        w.store(step.to[3], &mut self.state[4]);
        for (i, end) in ends.iter().enumerate() {
            w.store(*end, &mut self.figures[i]);
            let peak = w.larger(w.abs(*end), w.load(&self.peaks[i]));
            w.store(peak, &mut self.peaks[i]);
        }
        let peak_v = w.larger(w.abs(voltage_v), w.load(&self.peak_abs_voltage_v));
        w.store(peak_v, &mut self.peak_abs_voltage_v);
        let loss = self.joint_loss_of(phase, step, voltage_v);
        w.store(w.load(&self.joint_loss_j) + loss, &mut self.joint_loss_j);
        let number = w.splat(crate::plant::count(self.time_ns));
        let last_outside = w.select(outside, number, w.load(&self.last_outside));
        w.store(last_outside, &mut self.last_outside);
    }

    fn before(&self, voltage_v: W::Vector) -> Before<W> {
        let mut held = W::array(0.0);
        self.width.store(voltage_v, &mut held);
        Before {
            state: self.state,
            peaks: self.peaks,
            last_outside: self.last_outside,
            joint_loss_j: self.joint_loss_j,
            voltage_v: held,
        }
    }

    /// Sets a lane's numbers to its mode.
    pub(crate) fn take_mode(&mut self, lane: usize) {
        let plant = &self.lanes[lane].plant;
        let (mode, axis) = (*plant.mode(), *plant.axis());
        self.mode.set(lane, plant);
        for phase in &mut self.phases {
            let place = self.tables.held(&axis, &mode, phase.length_ns);
            phase.set(lane, &self.tables.held[place], axis.pitch_m_per_rad());
        }
    }

    /// Sets a lane's figures and peaks at the start of the motion.
    fn take_figures(&mut self, lane: usize) {
        let figures = self.lanes[lane].plant.figures(0.0);
        for (array, value) in self.figures.iter_mut().zip(figures) {
            array.as_mut()[lane] = value;
        }
        for (array, value) in self.peaks.iter_mut().zip(figures) {
            array.as_mut()[lane] = value.abs();
        }
    }

    /// State of a lane.
    pub fn state(&self, lane: usize) -> State {
        state_of::<W>(&self.state, lane)
    }

    /// Extremes of a lane so far, or why it could not go on.
    ///
    /// # Errors
    /// The [`PlantError`] that stopped the lane; it stands where it stopped.
    #[inline(always)]
    pub fn extremes(&mut self, lane: usize) -> Result<Extremes, PlantError> {
        if !self.pending.is_empty() {
            self.sift();
            self.answer_all();
        }
        self.extremes_of(lane)
    }

    fn extremes_of(&self, lane: usize) -> Result<Extremes, PlantError> {
        let run = &self.lanes[lane];
        run.result?;
        let mut extremes = run.extremes;
        for (peak, figure) in self.peaks.iter().zip(extremes.peaks_mut()) {
            *figure = figure.max(peak.as_ref()[lane]);
        }
        let voltage_v = self.peak_abs_voltage_v.as_ref()[lane];
        extremes.peak_abs_voltage_v = extremes.peak_abs_voltage_v.max(voltage_v);
        extremes.joint_loss_j = self.joint_loss_j.as_ref()[lane];
        let start_ns = self.last_outside.as_ref()[lane];
        if start_ns >= 0.0 {
            // The end of that step, summed as a span does.
            let length_s = seconds(self.length_at(start_ns));
            let end_s = start_ns / 1e9 + length_s;
            let last_s = extremes.last_outside_band_s.map_or(end_s, |t| t.max(end_s));
            extremes.last_outside_band_s = Some(last_s);
        }
        Ok(extremes)
    }

    /// Length of the step that began at `start_ns`.
    fn length_at(&self, start_ns: f64) -> u64 {
        let sample_ns: u64 = self.phases.iter().map(|phase| phase.length_ns).sum();
        let into_ns = start_ns % crate::plant::count(sample_ns);
        let second = self.phases.len() > 1 && into_ns != 0.0;
        self.phases[usize::from(second)].length_ns
    }
}

pub(crate) fn state_of<W: Width>(arrays: &[W::Array; HELD], lane: usize) -> State {
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
