//! The states of all lanes, one step at a time.

use super::phase::{DRIVING, FIGURES, Phase, Row};
use super::width::Width;
use crate::axis::{Axis, Drive};
use crate::error::PlantError;
use crate::exact::{HELD, Tables};
use crate::extremes::{Extremes, ExtremesSettings};
use crate::joint::JointMode;
use crate::parameters::AxisParameters;
use crate::plant::{Plant, seconds};
use crate::resistance::GuideMode;
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
    width: W,
    axis: Axis,
    tables: Tables,
    phases: Vec<Phase<W>>,
    lanes: Vec<Lane>,
    time_ns: u64,
    /// β, β̇, ε, ε̇, I.
    state: [W::Array; HELD],
    mode: ModeNumbers<W>,
    /// ẍ, I, and how far carriage and motor are behind the command, now.
    figures: [W::Array; FIGURES],
    /// Sup of the figures' magnitudes over the steps' ends.
    peaks: [W::Array; FIGURES],
    /// What the figures are known to exceed between the ends.
    floors: [W::Array; FIGURES],
    peak_abs_voltage_v: W::Array,
    /// Number of the last step that ended outside the settling band.
    last_outside: W::Array,
    travel_m: W::Array,
    band_m: W::Array,
    /// `sup|a_ref|` \[m/s²\].
    peak_command_mps2: W::Array,
    /// Steps in which a figure may have exceeded its peak between the ends, to
    /// be looked at when they are many; most are outdone by later ends.
    pending: Vec<Pending<W>>,
}

/// A step to be looked at again, lane by lane.
#[derive(Debug, Clone)]
struct Pending<W: Width> {
    /// Upper bounds of the figures' magnitudes; −∞ where there is no question.
    upper: [W::Array; FIGURES],
    time_ns: u64,
    phase: usize,
    state: [W::Array; HELD],
    joint: W::Array,
    voltage_v: W::Array,
    /// Whether the upper bounds are those of the quarters.
    enclosed: bool,
}

/// Steps that wait at most, and how many may go on waiting.
const MOST_PENDING: usize = 48;
const KEPT_PENDING: usize = 24;

/// What the lanes' modes make of the equations.
#[derive(Debug, Clone)]
struct ModeNumbers<W: Width> {
    /// `m·b` of `δ = ε − m·b`.
    offset_rad: W::Array,
    /// The guard `base + side·δ − open·|δ|`, positive within the mode.
    base: W::Array,
    side: W::Array,
    open: W::Array,
    /// `k` and `c` while a flank carries, else 0.
    stiffness: W::Array,
    damping: W::Array,
    /// a0 against the motion.
    resistance_n: W::Array,
    /// The flank in contact: −1, 0 or 1.
    joint: W::Array,
}

/// The single run that a lane is.
#[derive(Debug, Clone)]
struct Lane {
    plant: Plant,
    extremes: Extremes,
    result: Result<(), PlantError>,
}

/// What a step has found before it is taken.
struct Step<W: Width> {
    state: [W::Array; HELD],
    figures: [W::Array; FIGURES],
    peaks: [W::Array; FIGURES],
    last_outside: W::Array,
    voltage_v: W::Array,
    command_m: W::Array,
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
            mode: ModeNumbers {
                offset_rad: zero,
                base: zero,
                side: zero,
                open: zero,
                stiffness: zero,
                damping: zero,
                resistance_n: zero,
                joint: zero,
            },
            figures: [zero; FIGURES],
            peaks: [zero; FIGURES],
            floors: [zero; FIGURES],
            peak_abs_voltage_v: zero,
            last_outside: zero,
            travel_m: zero,
            band_m: zero,
            peak_command_mps2: zero,
            pending: Vec::with_capacity(MOST_PENDING),
        })
    }

    /// Puts every lane at rest at zero. Lanes without a setup repeat the last
    /// one; there must be one at least, else nothing is started.
    pub fn start(&mut self, setups: &[LaneSetup]) {
        let Some(last) = setups.last() else { return };
        let zero = W::array(0.0);
        self.time_ns = 0;
        self.state = [zero; HELD];
        self.figures = [zero; FIGURES];
        self.peaks = [zero; FIGURES];
        self.floors = [zero; FIGURES];
        self.peak_abs_voltage_v = zero;
        self.last_outside = W::array(-1.0);
        self.lanes.clear();
        self.pending.clear();
        for lane in 0..W::LANES {
            let setup = setups.get(lane).unwrap_or(last);
            let motion = &setup.extremes.motion;
            self.travel_m.as_mut()[lane] = motion.travel_m();
            self.band_m.as_mut()[lane] = setup.extremes.settling_band_m;
            self.peak_command_mps2.as_mut()[lane] = motion.peak_acceleration_mps2();
            self.lanes.push(Lane {
                plant: Plant::of_axis(self.axis.with_backlash(setup.backlash_half_rad)),
                extremes: Extremes::new(setup.extremes),
                result: Ok(()),
            });
            self.take_mode(lane);
            self.take_figures(lane, 0.0);
        }
    }

    /// β of every lane \[rad\].
    #[inline(always)]
    pub fn beta_rad(&self) -> W::Vector {
        self.width.load(&self.state[0])
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
        let step = &self.phases[phase];
        let mode = &self.mode;
        let (p, inertia) = (
            w.splat(self.axis.pitch_m_per_rad()),
            w.splat(self.axis.moved_inertia()),
        );

        // x(T) = Φ·x + ψ(T)·load + Γ·V, in the order of `Kernel::step`.
        let offset = w.load(&mode.offset_rad);
        let beta0 = w.load(&self.state[0]);
        let from = [
            w.load(&self.state[1]),
            w.load(&self.state[2]) - offset,
            w.load(&self.state[3]),
            w.load(&self.state[4]),
        ];
        let beta1 = step.row(w, BETA, &from, beta0 + w.load(&step.drift[BETA]), voltage_v);
        let to = [
            step.row(w, BETA_DOT, &from, w.load(&step.drift[BETA_DOT]), voltage_v),
            step.row(w, EPSILON, &from, w.load(&step.drift[EPSILON]), voltage_v),
            step.row(
                w,
                EPSILON_DOT,
                &from,
                w.load(&step.drift[EPSILON_DOT]),
                voltage_v,
            ),
            step.row(w, CURRENT, &from, w.load(&step.drift[CURRENT]), voltage_v),
        ];

        // Does the joint keep its mode?
        let signed = [
            to[0] - from[0],
            to[1] - from[1],
            to[2] - from[2],
            to[3] - from[3],
        ];
        let change = [
            w.abs(signed[0]),
            w.abs(signed[1]),
            w.abs(signed[2]),
            w.abs(signed[3]),
        ];
        let ends = w.smaller(mode.guard(w, from[1]), mode.guard(w, to[1]));
        let all = (1_u64 << W::LANES) - 1;
        let mut moved = !w.bits(w.greater(ends, dot(w, &step.gap_bound, &change))) & all;
        if moved != 0 {
            // Perhaps it does after all: the same with the quarters.
            let mut lowest = ends;
            for row in &step.gap_points {
                let delta = from[1] + dot(w, row, &signed);
                lowest = w.smaller(lowest, mode.guard(w, delta));
            }
            moved &= !w.bits(w.greater(lowest, dot(w, &step.gap_fine_bound, &change)));
        }

        // The figures at the end.
        let epsilon1 = to[1] + offset;
        let gamma_dot = to[0] - to[2];
        // From ε as the single run knows it; and no torque is 0, not −0.
        let delta = epsilon1 - offset;
        let mut torque = w.load(&mode.stiffness) * delta + w.load(&mode.damping) * to[2];
        torque = torque + w.splat(0.0);
        if self.axis.joint.is_none() {
            let motor = self.axis.motor().torque_constant_nm_per_a;
            torque = (w.splat(motor) * to[3]) / w.splat(self.axis.gear_ratio());
        }
        let a1 = w.splat(self.axis.resistance().linear_ns_per_rad);
        let force = w.load(&mode.resistance_n) + a1 * gamma_dot;
        let carriage_m = p * (beta1 - epsilon1);
        let command = w.load(command_m);
        let figures = [
            p * ((torque - p * force) / inertia),
            to[3],
            command - carriage_m,
            command - p * beta1,
        ];

        // May one of them exceed its peak between the ends?
        let half = w.splat(0.5);
        let seconds_now = w.splat(seconds(step.length_ns));
        let bend = w.load(&self.peak_command_mps2) * (seconds_now * seconds_now) * half;
        let mut pending = 0;
        let mut peaks = self.peaks;
        let mut uppers = self.peaks;
        let mut carriage_slope = w.splat(0.0);
        let never = w.splat(f64::NEG_INFINITY);
        for (i, end) in figures.iter().enumerate() {
            let start = w.load(&self.figures[i]);
            let mut slope = dot(w, &step.slopes[i], &change);
            if i == CARRIAGE {
                carriage_slope = slope;
            }
            if i >= CARRIAGE {
                slope = slope + bend;
            }
            let ends = w.larger(w.abs(start), w.abs(*end));
            let peak = w.larger(w.abs(*end), w.load(&self.peaks[i]));
            let turns = w.greater(slope, w.abs(*end - start));
            let mut upper = w.select(turns, ends + slope * half, never);
            if w.bits(w.greater(upper, peak)) & all != 0 {
                let mut chord = dot(w, &step.chords[i], &change);
                if i >= CARRIAGE {
                    chord = chord + bend * half * half;
                }
                upper = w.select(turns, ends + chord, never);
                pending |= w.bits(w.greater(upper, peak));
            }
            w.store(upper, &mut uppers[i]);
            w.store(peak, &mut peaks[i]);
        }
        // Outside the settling band at the end, or perhaps before it.
        let (travel, band) = (w.load(&self.travel_m), w.load(&self.band_m));
        let distance = w.abs(travel - carriage_m);
        let before = w.abs(travel - p * (beta0 - (from[1] + offset)));
        let outside = w.greater(distance, band);
        let near = w.greater(w.larger(distance, before) + carriage_slope * half, band);
        let wanted = w.bits(near) & !w.bits(outside) & all & !moved;
        let number = w.splat(crate::plant::count(self.time_ns));
        let mut last_outside = self.last_outside;
        w.store(
            w.select(outside, number, w.load(&last_outside)),
            &mut last_outside,
        );
        let peak_v = w.larger(w.abs(voltage_v), w.load(&self.peak_abs_voltage_v));
        w.store(peak_v, &mut self.peak_abs_voltage_v);

        let mut next = Step::<W> {
            state: self.state,
            figures: self.figures,
            peaks,
            last_outside,
            voltage_v: W::array(0.0),
            command_m: *command_m,
        };
        w.store(beta1, &mut next.state[0]);
        w.store(to[0], &mut next.state[1]);
        w.store(epsilon1, &mut next.state[2]);
        w.store(to[2], &mut next.state[3]);
        w.store(to[3], &mut next.state[4]);
        for (figure, array) in figures.iter().zip(&mut next.figures) {
            w.store(*figure, array);
        }
        w.store(voltage_v, &mut next.voltage_v);
        if pending & all & !moved != 0 {
            for lane in 0..W::LANES {
                if moved >> lane & 1 != 0 {
                    for upper in &mut uppers {
                        upper.as_mut()[lane] = f64::NEG_INFINITY;
                    }
                }
            }
            self.pending.push(Pending {
                upper: uppers,
                time_ns: self.time_ns,
                phase,
                state: self.state,
                joint: self.mode.joint,
                voltage_v: next.voltage_v,
                enclosed: false,
            });
        }
        if moved | wanted != 0 {
            self.look_closer(phase, moved, wanted, &mut next);
        }
        self.time_ns += self.phases[phase].length_ns;
        self.state = next.state;
        self.figures = next.figures;
        self.peaks = next.peaks;
        self.last_outside = next.last_outside;
        if self.pending.len() >= MOST_PENDING {
            self.thin_out(KEPT_PENDING);
        }
    }

    /// Drops the pending steps that are outdone, by closer bounds where need
    /// be; if more than `keep` are left, looks at them, the last first.
    #[cold]
    #[inline(never)]
    fn thin_out(&mut self, keep: usize) {
        let mut pending = core::mem::take(&mut self.pending);
        for step in pending.iter_mut().rev() {
            for lane in 0..W::LANES {
                let questions = self.questions(step, lane);
                if questions != 0 && !step.enclosed {
                    self.enclose(step, lane, questions);
                }
            }
            step.enclosed = true;
        }
        pending.retain(|step| (0..W::LANES).any(|lane| self.questions(step, lane) != 0));
        if pending.len() > keep {
            for step in pending.drain(..).rev() {
                for lane in 0..W::LANES {
                    let questions = self.questions(&step, lane);
                    if questions != 0 {
                        self.answer(&step, lane, questions);
                    }
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
            questions |= u8::from(step.upper[i].as_ref()[lane] > floor) << i;
        }
        questions
    }

    /// Lowers the upper bounds of one lane of a pending step, and raises the
    /// floors that others must exceed.
    fn enclose(&mut self, step: &mut Pending<W>, lane: usize, questions: u8) {
        let run = &self.lanes[lane];
        let mut plant = run
            .plant
            .at(&state_of::<W>(&step.state, lane), step.time_ns);
        plant.set_contact(step.joint.as_ref()[lane]);
        let hold = (
            step.voltage_v.as_ref()[lane],
            self.phases[step.phase].length_ns,
        );
        let motion = run.extremes.motion();
        for i in 0..FIGURES {
            if questions >> i & 1 == 0 {
                continue;
            }
            if let Some((lower, upper)) = plant.enclose(&mut self.tables, hold, motion, i) {
                let floor = &mut self.floors[i].as_mut()[lane];
                *floor = floor.max(lower);
                let bound = &mut step.upper[i].as_mut()[lane];
                *bound = bound.min(upper);
            }
        }
    }

    /// Looks at one lane of a pending step.
    fn answer(&mut self, step: &Pending<W>, lane: usize, questions: u8) {
        let run = &mut self.lanes[lane];
        for (peak, figure) in self.peaks.iter().zip(run.extremes.peaks_mut()) {
            *figure = figure.max(peak.as_ref()[lane]);
        }
        let mut plant = run
            .plant
            .at(&state_of::<W>(&step.state, lane), step.time_ns);
        plant.set_contact(step.joint.as_ref()[lane]);
        let (voltage_v, length_ns) = (
            step.voltage_v.as_ref()[lane],
            self.phases[step.phase].length_ns,
        );
        let tables = &mut self.tables;
        plant.look(
            tables,
            voltage_v,
            length_ns,
            Some(questions),
            &mut run.extremes,
        );
    }

    /// Advances the lanes of `moved` as single runs, and searches the step of
    /// those of `wanted` for extremes.
    #[cold]
    #[inline(never)]
    fn look_closer(&mut self, phase: usize, moved: u64, wanted: u64, next: &mut Step<W>) {
        let length_ns = self.phases[phase].length_ns;
        for lane in 0..W::LANES {
            let bit = 1 << lane;
            if (moved | wanted) & bit == 0 {
                continue;
            }
            let voltage_v = next.voltage_v.as_ref()[lane];
            let y = state_of::<W>(&self.state, lane);
            let run = &mut self.lanes[lane];
            run.plant.set(&y, self.time_ns);
            for (peak, figure) in self.peaks.iter().zip(run.extremes.peaks_mut()) {
                *figure = figure.max(peak.as_ref()[lane]);
            }
            if moved & bit == 0 {
                let tables = &mut self.tables;
                run.plant
                    .look(tables, voltage_v, length_ns, None, &mut run.extremes);
                continue;
            }
            next.last_outside.as_mut()[lane] = self.last_outside.as_ref()[lane];
            for (new, old) in next.peaks.iter_mut().zip(&self.peaks) {
                new.as_mut()[lane] = old.as_ref()[lane];
            }
            if run.result.is_err() {
                continue;
            }
            let mode = *run.plant.mode();
            run.result = run.plant.advance_exactly(
                &mut self.tables,
                &Drive::Held(voltage_v),
                length_ns,
                &mut run.extremes,
            );
            let y = run.plant.state();
            let values = [
                y.beta_rad,
                y.beta_dot_radps,
                y.epsilon_rad,
                y.epsilon_dot_radps,
                y.current_a,
            ];
            for (array, value) in next.state.iter_mut().zip(values) {
                array.as_mut()[lane] = value;
            }
            let acceleration_mps2 = run.plant.acceleration_mps2();
            let changed = *run.plant.mode() != mode || run.plant.is_fresh();
            let p = self.axis.pitch_m_per_rad();
            let command_m = next.command_m.as_ref()[lane];
            let figures = [
                acceleration_mps2,
                y.current_a,
                command_m - p * y.gamma_rad(),
                command_m - p * y.beta_rad,
            ];
            for (array, value) in next.figures.iter_mut().zip(figures) {
                array.as_mut()[lane] = value;
            }
            if changed || self.mode.base.as_ref()[lane] == f64::NEG_INFINITY {
                self.take_mode(lane);
            }
        }
    }

    /// Sets a lane's numbers to its mode.
    fn take_mode(&mut self, lane: usize) {
        let plant = &self.lanes[lane].plant;
        let (mode, axis) = (*plant.mode(), *plant.axis());
        let offset_rad = axis.offset_rad(&mode);
        let never = f64::NEG_INFINITY;
        let simple = !axis.releases() && mode.guide == GuideMode::AsWritten && !plant.is_fresh();
        let (base, side, open) = match mode.joint {
            _ if !simple => (never, 0.0, 0.0),
            JointMode::Rigid | JointMode::Gapless => (f64::INFINITY, 0.0, 0.0),
            JointMode::Open => (axis.backlash_half_rad(), 0.0, 1.0),
            JointMode::Loaded(flank) => (0.0, flank.sign(), 0.0),
            JointMode::Released(_) => (never, 0.0, 0.0),
        };
        let (stiffness, damping) = match (mode.joint, axis.joint) {
            (JointMode::Gapless | JointMode::Loaded(_), Some(joint)) => {
                (joint.stiffness_nm_per_rad, joint.damping_nms_per_rad)
            }
            _ => (0.0, 0.0),
        };
        let resistance_n = mode.guide.direction() * axis.resistance().constant_n;
        let numbers = &mut self.mode;
        for (array, value) in [
            (&mut numbers.offset_rad, offset_rad),
            (&mut numbers.base, base),
            (&mut numbers.side, side),
            (&mut numbers.open, open),
            (&mut numbers.stiffness, stiffness),
            (&mut numbers.damping, damping),
            (&mut numbers.resistance_n, resistance_n),
            (&mut numbers.joint, f64::from(mode.joint.contact().sign())),
        ] {
            array.as_mut()[lane] = value;
        }
        for phase in &mut self.phases {
            let place = self.tables.held(&axis, &mode, phase.length_ns);
            phase.set(lane, &self.tables.held[place], axis.pitch_m_per_rad());
        }
    }

    /// Sets a lane's figures at rest, x_ref being `command_m`.
    fn take_figures(&mut self, lane: usize, command_m: f64) {
        let acceleration_mps2 = self.lanes[lane].plant.acceleration_mps2();
        let figures = [acceleration_mps2, 0.0, command_m, command_m];
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
    pub fn extremes(&mut self, lane: usize) -> Result<Extremes, PlantError> {
        self.thin_out(0);
        let run = &self.lanes[lane];
        run.result?;
        let mut extremes = run.extremes;
        for (peak, figure) in self.peaks.iter().zip(extremes.peaks_mut()) {
            *figure = figure.max(peak.as_ref()[lane]);
        }
        let voltage_v = self.peak_abs_voltage_v.as_ref()[lane];
        extremes.peak_abs_voltage_v = extremes.peak_abs_voltage_v.max(voltage_v);
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

/// Place of the carriage's following error among the figures; the motor's
/// follows.
const CARRIAGE: usize = 2;

/// `Σ row_j·x_j` over the driving states.
#[inline(always)]
fn dot<W: Width>(w: W, row: &Row<W>, x: &[W::Vector; DRIVING]) -> W::Vector {
    (w.load(&row[0]) * x[0] + w.load(&row[1]) * x[1])
        + (w.load(&row[2]) * x[2] + w.load(&row[3]) * x[3])
}

impl<W: Width> ModeNumbers<W> {
    #[inline(always)]
    fn guard(&self, w: W, delta: W::Vector) -> W::Vector {
        (w.load(&self.base) + w.load(&self.side) * delta) - w.load(&self.open) * w.abs(delta)
    }
}

fn state_of<W: Width>(arrays: &[W::Array; HELD], lane: usize) -> State {
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
