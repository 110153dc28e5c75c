//! Controllers and axes of one family in lockstep, as many as there are lanes.

use std::sync::Arc;

use plant::{Batch, ExtremesSettings, LaneSetup, PlantError, Width};

use super::family::{Commands, Family, SampleSteps};
use super::laws::{
    Firmware, Held, Instant, LaneController, LaneLaw, LaneSample, Sampled, Settings,
};
use crate::case::{Case, Law};
use crate::controllers::{LastTable, Pid, PidState};
use crate::error::RunError;
use crate::number::seconds;
use crate::quantise::QuantiseError;
use crate::rest::{AtRest, Line, SeenRows};
use crate::summary::{EndOfCommand, EndOfRun, RowFigures, Summary};
use crate::theory::{LoopFigures, Loops};

/// The figures of a run, or `None` where the run by itself has to say at which time its
/// work limit ends it.
pub(crate) type Outcome = Option<Result<Summary, RunError>>;

/// The runs of a family, some groups of lanes at a time. What depends on the
/// family alone is computed once.
#[derive(Debug)]
pub(crate) struct Lanes<W: Width> {
    pub(crate) width: W,
    /// The family whose runs these are.
    pub(crate) family: Family,
    commands: Arc<Commands>,
    batch: Batch<W>,
    setups: Vec<LaneSetup>,
    groups: Vec<Settings<W>>,
    seen: Vec<SeenRows<W>>,
    at_rest: Vec<AtRest<W>>,
    line: Line,
    end: EndOfCommand,
    firmware: Vec<Option<LaneController>>,
    last_table: LastTable,
    refused: Vec<Option<QuantiseError>>,
    /// Of each group, over its rows: `Σ(ẍ − ẍ_ref)²`, and the time under a held
    /// voltage at its limit \[ns\].
    sums: Vec<[W::Array; 2]>,
}

/// Progress of a group: the step of a sample that comes next, and everything that
/// the lanes need to go on.
#[derive(Debug, Clone, Copy)]
struct Progress<V> {
    tick: u64,
    step: usize,
    /// The voltage in force, and that of the code of this sample.
    in_force: Held<V>,
    next: Held<V>,
    squared: V,
    limited_ns: V,
}

impl<W: Width> Lanes<W> {
    /// # Errors
    /// [`PlantError::TooStiff`] where only a single run counts what it takes.
    /// [`PlantError::NotAffine`], but for families that does not happen.
    pub(crate) fn new(
        width: W,
        family: Family,
        known: &mut Option<Arc<Commands>>,
    ) -> Result<Self, PlantError> {
        let steps = family.steps();
        let (axis, surroundings) = (&family.axis, &family.surroundings);
        let lengths_ns = steps.each_ref().map(SampleSteps::lengths_ns).concat();
        let batch = Batch::new(width, axis, surroundings, &lengths_ns)?;
        Ok(Self {
            width,
            commands: Commands::of(&family, known),
            end: EndOfCommand::of(
                &family.motion,
                family.samples * family.period_ns + family.tail_ns,
            ),
            family,
            batch,
            setups: Vec::new(),
            groups: Vec::new(),
            seen: Vec::new(),
            at_rest: Vec::new(),
            line: Line::default(),
            firmware: Vec::new(),
            last_table: LastTable::default(),
            refused: Vec::new(),
            sums: Vec::new(),
        })
    }

    /// Runs cases of the family, no more than [`super::Runs::AT_A_TIME`], and hands over
    /// their figures in order.
    #[inline(always)]
    pub(crate) fn run<'a>(
        &mut self,
        cases: impl ExactSizeIterator<Item = &'a Case> + Clone,
        loops: &mut Loops,
        mut each: impl FnMut(Outcome),
    ) {
        self.start(cases.clone());
        match self.family.law {
            Law::Continuous | Law::Sampled => {
                let mut laws = self.laws::<false>();
                self.lockstep(&mut laws);
            }
            Law::Quantised => {
                let mut laws = self.laws::<true>();
                self.lockstep(&mut laws);
            }
            Law::Firmware => {
                let mut firmware = std::mem::take(&mut self.firmware);
                let mut laws: Vec<_> = firmware.chunks_mut(W::LANES).map(Firmware).collect();
                self.lockstep(&mut laws);
                self.firmware = firmware;
            }
        }
        self.batch.look_back();
        self.look_at_rest();
        let loops = loops.of_cases(&cases.clone().collect::<Vec<_>>());
        for (run, (case, loops)) in cases.zip(loops).enumerate() {
            each(self.summary(run, case, loops));
        }
    }

    /// The law of each group, at its start.
    #[inline(always)]
    fn laws<const WHOLE: bool>(&self) -> Vec<Sampled<W::Vector, WHOLE>> {
        let w = self.width;
        let sample_time_s = w.splat(seconds(self.family.period_ns));
        let law = |settings: &Settings<W>| {
            let gains = settings.gains.each_ref().map(|array| w.load(array));
            let pid = Pid::new(gains, sample_time_s);
            Sampled(pid, PidState::new(w.splat(0.0)))
        };
        self.groups.iter().map(law).collect()
    }

    /// Puts every lane at rest and sets what is each run's own.
    #[inline(never)]
    fn start<'a>(&mut self, cases: impl ExactSizeIterator<Item = &'a Case>) {
        self.setups.clear();
        self.firmware.clear();
        self.refused.clear();
        self.groups.clear();
        self.seen.resize_with(cases.len().div_ceil(W::LANES), || {
            SeenRows::new(self.family.window)
        });
        self.seen.iter_mut().for_each(SeenRows::restart);
        for (run, case) in cases.enumerate() {
            if run % W::LANES == 0 {
                self.groups.push(Settings::new());
            }
            if let Some(settings) = self.groups.last_mut() {
                settings.set(run % W::LANES, case);
            }
            self.setups.push(LaneSetup {
                backlash_half_rad: case.axis.transmission.joint.backlash_half_rad(),
                extremes: ExtremesSettings {
                    motion: case.motion.clone(),
                    settling_band_m: 1e-6 * case.run.settling_band_um,
                },
            });
            if self.family.law == Law::Firmware {
                let made = LaneController::new(case, self.family.period_ns, &mut self.last_table);
                self.refused.push(made.as_ref().err().cloned());
                self.firmware.push(made.ok());
            }
        }
        self.batch.start(&self.setups);
    }

    /// As the lockstep of a single run, all lanes at once. A group in which a
    /// contact changes waits for others in which one does.
    #[inline(always)]
    fn lockstep(&mut self, laws: &mut [impl LaneLaw<W>]) {
        let w = self.width;
        let steps = self.family.steps();
        let zero = w.splat(0.0);
        let at_rest = Held {
            voltage_v: zero,
            limited: 0,
        };
        let start = Progress {
            tick: 0,
            step: 0,
            in_force: at_rest,
            next: at_rest,
            squared: zero,
            limited_ns: zero,
        };
        let mut reached = vec![start; self.groups.len()];
        loop {
            let (mut running, mut advanced) = (false, false);
            for (group, (progress, law)) in reached.iter_mut().zip(laws.iter_mut()).enumerate() {
                let held_up = self.batch.is_held_up(group);
                running |= held_up || progress.tick <= self.family.samples;
                if !held_up && progress.tick <= self.family.samples {
                    advanced = true;
                    self.advance(group, &steps, progress, law);
                }
            }
            if !running {
                break;
            }
            self.batch.catch_up(!advanced);
        }
        self.sums.clear();
        for progress in &reached {
            let mut sums = [W::array(0.0); 2];
            let vectors = [progress.squared, progress.limited_ns];
            for (array, vector) in sums.iter_mut().zip(vectors) {
                w.store(vector, array);
            }
            self.sums.push(sums);
        }
    }

    /// Advances a group until it is held up or its runs are over.
    #[inline(always)]
    fn advance(
        &mut self,
        group: usize,
        [of_sample, tail]: &[SampleSteps; 2],
        progress: &mut Progress<W::Vector>,
        law: &mut impl LaneLaw<W>,
    ) {
        let (w, family, settings) = (self.width, &self.family, &self.groups[group]);
        let p = w.splat(family.axis.transmission.screw_pitch_m_per_rad);
        let seen = &mut self.seen[group];
        let mut now = *progress;
        let mut axes = self.batch.group(group);
        while now.tick <= family.samples {
            let command = self.commands.at(now.tick);
            if now.step == 0 {
                // 1. Sample, 2. compute.
                let gamma = axes.beta_rad() - axes.epsilon_rad();
                let instant = Instant {
                    tick: now.tick,
                    // The encoder's zero is where the axis starts.
                    beta: axes.beta_from_start_rad(),
                    gamma,
                    alpha_ref: w.splat(command.alpha_rad),
                };
                let LaneSample { code, count, held } = law.sample(w, settings, instant);
                now.next = held;
                // 3. Record.
                let error = axes.acceleration_mps2() - w.splat(command.acceleration_mps2);
                now.squared = now.squared + error * error;
                seen.add(w, now.tick, [code, count], p * gamma);
            }
            let last = now.tick == family.samples;
            let steps = if last { tail } else { of_sample };
            if last && steps.number == 0 {
                now.tick += 1;
                break;
            }
            // 4. Move: first under the code still in force, then under the new.
            if now.step >= steps.first_new {
                now.in_force = now.next;
            }
            if now.in_force.limited != 0 {
                let limited = w.lanes(now.in_force.limited);
                let later_ns = now.limited_ns + w.splat(steps.real_ns[now.step]);
                now.limited_ns = w.select(limited, later_ns, now.limited_ns);
            }
            let end_m = w.splat(command.step_ends_m[now.step]);
            let Held { voltage_v, limited } = now.in_force;
            let held_up = axes.advance(steps.first + now.step, voltage_v, end_m, limited);
            now.step += 1;
            if now.step == steps.number {
                now.in_force = now.next;
                now.step = 0;
                now.tick += 1;
            }
            if held_up {
                break;
            }
        }
        *progress = now;
    }

    #[inline(always)]
    fn look_at_rest(&mut self) {
        if self.line == Line::default() {
            self.line = self.seen.first().map_or_else(Line::default, SeenRows::line);
        }
        let (w, line, x_ref_m) = (self.width, &self.line, self.end.x_ref_m);
        let seen = self.seen.iter();
        self.at_rest.clear();
        self.at_rest
            .extend(seen.map(|seen| seen.at_rest(w, line, x_ref_m)));
    }

    /// The figures of one run.
    #[inline(never)]
    fn summary(&mut self, run: usize, case: &Case, loops: LoopFigures) -> Outcome {
        let lane = run % W::LANES;
        let sums = self.sums[run / W::LANES].each_ref();
        let [squared, limited_ns] = sums.map(|array| array.as_ref()[lane]);
        if let Some(refused) = self.refused.get_mut(run).and_then(Option::take) {
            return Some(Err(RunError::Quantise(refused)));
        }
        let extremes = match self.batch.extremes_of(run) {
            Ok(extremes) if extremes.work > case.run.work_limit => return None,
            Ok(extremes) => extremes,
            Err(error) => return Some(Err(error.into())),
        };
        let seen = self.seen[run / W::LANES].of(lane, &self.line, &self.at_rest[run / W::LANES]);
        let codes = seen.codes;
        let rows = RowFigures {
            rows: self.family.samples + 1,
            squared_acc_error: squared,
            max_abs_dac_code: Some(codes.lowest.abs().max(codes.highest.abs())),
            seen,
        };
        let controller = self.firmware.get(run).and_then(Option::as_ref);
        let end = EndOfRun {
            case,
            command: self.end,
            solver: "exact",
            state: self.batch.state(run),
            extremes: &extremes,
            rows: &rows,
            // A sum of step lengths: whole and not negative.
            held_limit_ns: [limited_ns as u64, 0],
            events: None,
            axis: controller.and_then(LaneController::status),
            chip: None,
            loops,
        };
        Some(Ok(end.summary()))
    }
}
