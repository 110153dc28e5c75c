//! The runs of one group: their beginning, what they have in common, what they
//! have reached, and the last steps, which have not been looked at.

use super::phase::{Kind, Kinds, ModeNumbers, Phase};
use super::questions::{PastStep, Piece, Questions};
use crate::exact::{DRIVING, HELD, Tables};
use crate::hybrid::{Automaton, Interval, PlantError};
use crate::model::axis::{Axis, Drive, Mode};
use crate::model::resistance::GuideMode;
use crate::model::state::{EPSILON, State};
use crate::model::surroundings::Start;
use crate::numerics::seconds;
use crate::numerics::width::Width;
use crate::observe::extremes::{ENERGIES, Extremes, ExtremesSettings, FIGURES};

/// The plant's parameters that are a run's own, and what it is measured against.
#[derive(Debug, Clone, PartialEq)]
pub struct LaneSetup {
    /// `b`, half the backlash \[rad\]; without meaning on a rigid axis.
    pub backlash_half_rad: f64,
    /// The command and the settling band.
    pub extremes: ExtremesSettings,
}

/// Numbers that all runs share.
#[derive(Debug, Clone)]
pub(super) struct Shared {
    pub(super) axis: Axis,
    /// True if dry friction can hold the screw.
    pub(super) has_stiction: bool,
    /// `V_max` \[V\] and `I_max` \[A\] where the current is limited.
    pub(super) limits: Option<[f64; 2]>,
    /// Where the joints stand at the start.
    pub(super) start: Start,
    pub(super) tables: Tables,
    pub(super) phases: Vec<Phase>,
    /// The largest of the phases' chords, whatever the joint does.
    pub(super) most_chords: [[f64; DRIVING]; FIGURES],
}

impl Shared {
    /// Sets the largest chords, after a phase has learnt some.
    pub(super) fn find_most_chords(&mut self) {
        for (i, most) in self.most_chords.iter_mut().enumerate() {
            for (j, most) in most.iter_mut().enumerate() {
                let chords = self.phases.iter().flat_map(|phase| &phase.chords[i]);
                *most = chords.fold(0.0, |most: f64, chord| most.max(chord[j]));
            }
        }
    }
}

/// The single run that a lane is.
#[derive(Debug, Clone)]
pub(super) struct Lane {
    pub(super) plant: Automaton,
    pub(super) extremes: Extremes,
    pub(super) result: Result<(), PlantError>,
    /// The last step that has ended within the settling band and may have been outside.
    pub(super) entry: Option<PastStep>,
}

impl Lane {
    fn new(plant: Automaton, extremes: Extremes) -> Self {
        Self {
            plant,
            extremes,
            result: Ok(()),
            entry: None,
        }
    }

    /// Looks at a step again, or a piece of one, for the figures whose bits are set and for when
    /// the carriage is last further than this from the travel, in a whole step.
    pub(super) fn look_at(
        &mut self,
        shared: &mut Shared,
        (step, piece): (&PastStep, Option<&Piece>),
        sought: (u8, f64),
    ) {
        let mut plant = self.plant.at(&step.state, step.time_ns);
        plant.mode = step.mode;
        let (tables, extremes) = (&mut shared.tables, &mut self.extremes);
        let held = (step.voltage_v, shared.phases[step.phase].length_ns);
        let piece = piece.map(|piece| ((piece.start_s, piece.length_s), &piece.end));
        plant.look_at(tables, held, piece, sought, extremes);
    }

    /// Looks for the last instant outside the settling band within a step.
    pub(super) fn look_at_entry(&mut self, shared: &mut Shared, entry: &PastStep) {
        let band_m = self.extremes.settings.settling_band_m;
        self.look_at(shared, (entry, None), (0, band_m));
    }

    /// Raises the run's peaks to those of the batch.
    pub(super) fn raise<A: AsRef<[f64]>>(&mut self, peaks: &[A; FIGURES], lane: usize) {
        for (peak, figure) in peaks.iter().zip(self.extremes.peaks_mut()) {
            *figure = figure.max(peak.as_ref()[lane]);
        }
    }
}

/// As many runs as there are lanes, at the same time.
#[derive(Debug, Clone)]
pub(super) struct Group<W: Width> {
    pub(super) width: W,
    pub(super) lanes: Vec<Lane>,
    /// Number of them that are runs; the others repeat the last.
    pub(super) runs: usize,
    /// Number of lanes that have left the step and wait to be followed.
    pub(super) held_up: usize,
    /// The lanes in each kind of mode.
    pub(super) kinds: Kinds,
    /// The last steps.
    pub(super) track: Track<W>,
    pub(super) mode: ModeNumbers<W>,
    pub(super) backlash_half_rad: W::Array,
    /// `β(0)`, from which β is counted \[rad\].
    pub(super) start_rad: W::Array,
    /// Sup of the figures' magnitudes over the ends of the steps before the
    /// present block, and over what has been found between ends.
    pub(super) peaks: [W::Array; FIGURES],
    /// Where they may be larger.
    pub(super) questions: Questions,
    pub(super) peak_abs_voltage_v: W::Array,
    /// Energies so far \[J\].
    pub(super) energies: [W::Array; ENERGIES],
    /// End of the last step that ended outside the settling band before one that did not
    /// \[s\]; −1 without one.
    pub(super) last_outside: W::Array,
    /// The lanes outside at the end of the last step.
    pub(super) outside: u64,
    pub(super) travel_m: W::Array,
    pub(super) band_m: W::Array,
    /// `T²·sup|a_ref|` with the longest of the steps' lengths T \[m\].
    pub(super) bend_m: W::Array,
}

impl<W: Width> Group<W> {
    pub(super) fn new(width: W) -> Self {
        let zero = W::array(0.0);
        Self {
            width,
            kinds: Kinds::NONE,
            lanes: Vec::with_capacity(W::LANES),
            runs: 0,
            held_up: 0,
            track: Track::new(),
            mode: ModeNumbers::new(),
            backlash_half_rad: zero,
            start_rad: zero,
            peaks: [zero; FIGURES],
            questions: Questions::default(),
            peak_abs_voltage_v: zero,
            energies: [zero; ENERGIES],
            last_outside: zero,
            outside: 0,
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
        (self.runs, self.held_up) = (setups.len(), 0);
        self.peaks = [zero; FIGURES];
        self.questions.clear(shared.phases.len());
        self.peak_abs_voltage_v = zero;
        self.energies = [zero; ENERGIES];
        (self.last_outside, self.outside) = (W::array(-1.0), 0);
        for lane in 0..W::LANES {
            let setup = setups.get(lane).unwrap_or(last);
            let motion = &setup.extremes.motion;
            self.travel_m.as_mut()[lane] = motion.travel_m();
            self.band_m.as_mut()[lane] = setup.extremes.settling_band_m;
            self.bend_m.as_mut()[lane] = motion.peak_acceleration_mps2 * (longest_s * longest_s);
            let flank = shared.start.flank(match shared.axis.joint {
                Some(_) => setup.backlash_half_rad,
                None => 0.0,
            });
            let axis = shared.axis.with_backlash(setup.backlash_half_rad, flank);
            self.backlash_half_rad.as_mut()[lane] = axis.backlash_half_rad();
            self.start_rad.as_mut()[lane] = axis.start_rad;
            let (mut plant, mut extremes) = (
                Automaton::new(axis, flank),
                Extremes::new(setup.extremes.clone()),
            );
            if shared.has_stiction {
                // A load that friction does not hold moves the axis from the first instant on,
                // whatever the voltage is. Modes without end are an error of the first step.
                let (at_once, none) = (Interval::new(0.0, 0.0), Drive::Held(0.0));
                let _ = plant.settle(&none, &at_once, &mut extremes);
            }
            self.track.now_mut().state[EPSILON].as_mut()[lane] = plant.y[EPSILON];
            match self.lanes.get_mut(lane) {
                Some(run) => *run = Lane::new(plant, extremes),
                None => self.lanes.push(Lane::new(plant, extremes)),
            }
            self.take_mode(shared, lane);
            self.take_figures(lane);
        }
    }

    /// Sets a lane's numbers to its mode.
    pub(super) fn take_mode(&mut self, shared: &mut Shared, lane: usize) {
        let plant = &self.lanes[lane].plant;
        let (mode, axis) = (plant.mode, plant.axis);
        self.mode.set(lane, plant);
        let kind = Kind::of(&mode);
        self.kinds.set(lane, kind);
        let slot = self.track.now_mut();
        slot.flank.as_mut()[lane] = self.mode.joint.as_ref()[lane];
        slot.kinds = self.kinds;
        let mut learnt = false;
        for phase in &mut shared.phases {
            if phase.of(kind).is_none() {
                let table = shared.tables.held(&axis, &mode, phase.length_ns);
                phase.learn(kind, table, &axis);
                learnt = true;
            }
        }
        if learnt {
            shared.find_most_chords();
        }
    }

    /// Sets a lane's figures and peaks at the start of the motion.
    fn take_figures(&mut self, lane: usize) {
        let figures = self.lanes[lane].plant.figures(0.0);
        self.track.now_mut().acceleration_mps2.as_mut()[lane] = figures[0];
        let starts = self.track.starts.iter_mut().zip(&mut self.peaks);
        for ((start, peak), figure) in starts.zip(figures) {
            start.as_mut()[lane] = figure.abs();
            peak.as_mut()[lane] = figure.abs();
        }
    }

    /// Mode of a lane at a slot.
    pub(super) fn mode_at(&self, slot: &Slot<W>, lane: usize) -> Mode {
        let mut mode = self.lanes[lane]
            .plant
            .mode
            .with_contact(slot.flank.as_ref()[lane]);
        if mode.guide != GuideMode::AsWritten {
            mode.guide = slot.kinds.of(lane).guide();
        }
        mode
    }

    /// State of a lane.
    pub(super) fn state(&self, lane: usize) -> State {
        state_of::<W>(&self.track.now().state, lane)
    }

    /// Puts a lane to where its run is, in another mode if it has changed.
    pub(super) fn put(
        &mut self,
        shared: &mut Shared,
        (lane, changed): (usize, bool),
        y: &State,
        command_m: f64,
    ) {
        for (array, value) in self.track.now_mut().state.iter_mut().zip(values_of(y)) {
            array.as_mut()[lane] = value;
        }
        let figures = self.lanes[lane].plant.figures(command_m);
        self.track.now_mut().acceleration_mps2.as_mut()[lane] = figures[0];
        for (start, figure) in self.track.starts.iter_mut().zip(figures) {
            let start = &mut start.as_mut()[lane];
            *start = start.max(figure.abs());
        }
        if changed {
            self.take_mode(shared, lane);
        }
    }

    /// Magnitude of a figure that a lane is known to reach.
    pub(super) fn known_of(&self, lane: usize, figure: usize) -> f64 {
        let (peaks, ends) = (&self.peaks[figure], &self.track.ends[figure]);
        peaks.as_ref()[lane].max(ends.as_ref()[lane])
    }

    /// Raises a lane's peaks to those of its single run.
    pub(super) fn take_peaks(&mut self, lane: usize) {
        let known = self.lanes[lane].extremes.peaks();
        for (peak, known) in self.peaks.iter_mut().zip(known) {
            let peak = &mut peak.as_mut()[lane];
            *peak = peak.max(known);
        }
    }

    /// Looks at the last steps that have ended within the settling band, where nothing later
    /// was outside.
    pub(super) fn look_at_entries(&mut self, shared: &mut Shared) {
        for (run, last_s) in self.lanes.iter_mut().zip(self.last_outside.as_ref()) {
            let Some(entry) = run.entry.take() else {
                continue;
            };
            let end_s = seconds(entry.time_ns + shared.phases[entry.phase].length_ns);
            let later_s = run.extremes.last_outside_band_s.unwrap_or(-1.0);
            if end_s > later_s.max(*last_s) {
                run.look_at_entry(shared, &entry);
            }
        }
    }

    /// Extremes of a lane so far, where nothing waits.
    pub(super) fn extremes_of(&self, lane: usize) -> Result<Extremes, PlantError> {
        let run = &self.lanes[lane];
        run.result?;
        let mut extremes = run.extremes.clone();
        for (peak, figure) in self.peaks.iter().zip(extremes.peaks_mut()) {
            *figure = figure.max(peak.as_ref()[lane]);
        }
        let voltage_v = self.peak_abs_voltage_v.as_ref()[lane];
        extremes.peak_abs_voltage_v = extremes.peak_abs_voltage_v.max(voltage_v);
        for (sum, energy) in extremes.energies_mut().into_iter().zip(&self.energies) {
            *sum = energy.as_ref()[lane];
        }
        let end_s = self.last_outside.as_ref()[lane];
        if end_s >= 0.0 {
            let last_s = extremes.last_outside_band_s.map_or(end_s, |t| t.max(end_s));
            extremes.last_outside_band_s = Some(last_s);
        }
        Ok(extremes)
    }
}

/// β, β̇, ε, ε̇ and I.
pub(super) fn values_of(y: &State) -> [f64; HELD] {
    [
        y.beta_rad,
        y.beta_dot_radps,
        y.epsilon_rad,
        y.epsilon_dot_radps,
        y.current_a,
    ]
}

/// The state of a lane from these in lanes.
pub(super) fn state_of<W: Width>(arrays: &[W::Array; HELD], lane: usize) -> State {
    let value = |place: usize| arrays[place].as_ref()[lane];
    State {
        beta_rad: value(0),
        beta_dot_radps: value(1),
        epsilon_rad: value(2),
        epsilon_dot_radps: value(3),
        current_a: value(4),
        beta_integral_rads: 0.0,
        current_integral_as: 0.0,
    }
}

/// Places for the steps that have not been looked at, and for now.
pub(super) const PLACES: usize = 32;

/// Steps of a block: two of them, the step that is taken, and now.
const BLOCK: usize = PLACES / 2 - 1;

/// Start of a step.
#[derive(Debug, Clone)]
pub(super) struct Slot<W: Width> {
    /// β, β̇, ε, ε̇, I.
    pub(super) state: [W::Array; HELD],
    /// The flank in contact: −1, 0 or 1; 1 without a gap.
    pub(super) flank: W::Array,
    /// The lanes in each kind of mode.
    pub(super) kinds: Kinds,
    /// ẍ \[m/s²\].
    pub(super) acceleration_mps2: W::Array,
    /// x_ref \[m\].
    pub(super) command_m: W::Array,
    pub(super) time_ns: u64,
    /// Voltage that it is made with.
    pub(super) voltage_v: W::Array,
    pub(super) phase: usize,
    /// The lanes that leave it.
    pub(super) moved: u64,
}

/// Steps that have not been looked at, and what is largest within them.
#[derive(Debug, Clone)]
pub(super) struct Track<W: Width> {
    pub(super) slots: Box<[Slot<W>; PLACES]>,
    /// Steps taken; those from `first` on have not been looked at, those from
    /// `second` on are of the present block.
    pub(super) now: usize,
    pub(super) first: usize,
    pub(super) second: usize,
    /// Of the present block: sup of the figures' magnitudes over the ends of its
    /// steps, over what its first one and those after a change of contact begin
    /// with, and of the rates of the driving states.
    pub(super) ends: [W::Array; FIGURES],
    pub(super) starts: [W::Array; FIGURES],
    pub(super) rates: W::QuadArray,
    /// And of the voltages.
    pub(super) voltage_v: W::Array,
    /// Of the block before: the larger of the first two, and the others.
    pub(super) sizes_before: [W::Array; FIGURES],
    pub(super) rates_before: W::QuadArray,
    pub(super) voltage_before_v: W::Array,
}

impl<W: Width> Track<W> {
    pub(super) fn new() -> Self {
        let zero = W::array(0.0);
        let slot = Slot {
            state: [zero; HELD],
            flank: zero,
            kinds: Kinds::NONE,
            acceleration_mps2: zero,
            command_m: zero,
            time_ns: 0,
            voltage_v: zero,
            phase: 0,
            moved: 0,
        };
        Self {
            slots: Box::new(core::array::from_fn(|_| slot.clone())),
            now: 0,
            first: 0,
            second: 0,
            ends: [zero; FIGURES],
            starts: [zero; FIGURES],
            rates: W::quad_array(0.0),
            voltage_v: zero,
            voltage_before_v: zero,
            sizes_before: [zero; FIGURES],
            rates_before: W::quad_array(0.0),
        }
    }

    /// At rest at zero.
    pub(super) fn start(&mut self) {
        let zero = W::array(0.0);
        (self.now, self.first, self.second) = (0, 0, 0);
        let slot = &mut self.slots[0];
        slot.state = [zero; HELD];
        (slot.flank, slot.command_m, slot.time_ns) = (zero, zero, 0);
        (self.ends, self.starts) = ([zero; FIGURES], [zero; FIGURES]);
        self.rates = W::quad_array(0.0);
        self.voltage_v = zero;
    }

    /// Start of the next step.
    #[inline(always)]
    pub(super) fn now(&self) -> &Slot<W> {
        &self.slots[self.now % PLACES]
    }

    #[inline(always)]
    pub(super) fn now_mut(&mut self) -> &mut Slot<W> {
        &mut self.slots[self.now % PLACES]
    }

    /// Takes a step, which the lanes of `moved` leave; returns where it ends.
    #[inline(always)]
    pub(super) fn step(
        &mut self,
        w: W,
        (phase, length_ns): (usize, u64),
        voltage_v: W::Vector,
        moved: u64,
    ) -> &mut Slot<W> {
        let slot = self.now_mut();
        w.store(voltage_v, &mut slot.voltage_v);
        (slot.phase, slot.moved) = (phase, moved);
        let (flank, kinds, time_ns) = (slot.flank, slot.kinds, slot.time_ns + length_ns);
        self.now += 1;
        let slot = self.now_mut();
        (slot.flank, slot.kinds, slot.time_ns) = (flank, kinds, time_ns);
        slot
    }

    /// True if the present block is full.
    #[inline(always)]
    pub(super) fn block_is_full(&self) -> bool {
        self.now - self.second == BLOCK
    }
}
