//! Controllers and axes of one family in lockstep, as many as there are lanes.

use plant::{Batch, ExtremesSettings, Joint, LaneSetup, PlantError, Width};

use super::commands::{Commands, MOST_STEPS};
use super::family::{Family, Key};
use super::laws::{Firmware, LaneLaw, Quantised, Sampled};
use super::seen::LaneSeen;
use super::settings::{Held, Settings};
use crate::case::{Case, Law};
use crate::error::RunError;
use crate::law::{FirmwareOnCounts, Pid};
use crate::quantise::QuantiseError;
use crate::summary::{EndOfRun, RowFigures, Summary};
use crate::time::seconds;

/// The runs of a family, as many at a time as there are lanes. What depends on
/// the family alone is computed once.
#[derive(Debug)]
pub(crate) struct Lanes<W: Width> {
    width: W,
    family: Family,
    key: Key,
    commands: Commands,
    batch: Batch<W>,
    setups: Vec<LaneSetup>,
    settings: Settings<W>,
    seen: LaneSeen<W>,
    firmware: Vec<Option<FirmwareOnCounts>>,
    refused: Vec<Option<QuantiseError>>,
}

/// What the rows of all lanes add up to.
#[derive(Debug, Clone, Copy)]
struct Sums<W: Width> {
    squared_acc_error: W::Array,
    max_abs_dac_code: W::Array,
    /// Time under a held voltage at its limit \[ns\], whole.
    held_limit_ns: W::Array,
}

impl<W: Width> Lanes<W> {
    /// # Errors
    /// [`PlantError::NotAffine`], but for families that does not happen.
    pub(crate) fn new(width: W, family: Family, key: Key) -> Result<Self, PlantError> {
        let steps_ns: Vec<u64> = family.steps_ns().collect();
        Ok(Self {
            width,
            family,
            key,
            commands: Commands::new(&family),
            batch: Batch::new(width, &family.axis, &steps_ns)?,
            setups: Vec::new(),
            settings: Settings::new(),
            seen: LaneSeen::new(),
            firmware: Vec::new(),
            refused: Vec::new(),
        })
    }

    /// The family whose runs these are.
    pub(crate) fn key(&self) -> &Key {
        &self.key
    }

    /// Runs cases of the family, no more than there are lanes, and hands over
    /// their figures in order.
    #[inline(always)]
    pub(crate) fn run<'a>(
        &mut self,
        cases: impl ExactSizeIterator<Item = &'a Case> + Clone,
        mut each: impl FnMut(Result<Summary, RunError>),
    ) {
        self.start(cases.clone());
        let w = self.width;
        let gains = self.settings.gains.each_ref().map(|array| w.load(array));
        let period_s = w.splat(seconds(self.family.period_ns));
        let pid = Pid::from_parts(gains, period_s, w.splat(0.0));
        let sums = match self.family.law {
            Law::Continuous | Law::Sampled => self.lockstep(&mut Sampled(pid)),
            Law::Quantised => self.lockstep(&mut Quantised(pid)),
            Law::Firmware => {
                let mut firmware = std::mem::take(&mut self.firmware);
                let sums = self.lockstep(&mut Firmware(&mut firmware));
                self.firmware = firmware;
                sums
            }
        };
        for (lane, case) in cases.enumerate() {
            each(self.summary(lane, case, &sums));
        }
    }

    /// Puts every lane at rest and sets what is each run's own.
    #[inline(never)]
    fn start<'a>(&mut self, cases: impl Iterator<Item = &'a Case> + Clone) {
        self.setups.clear();
        self.firmware.clear();
        self.refused.clear();
        self.settings = Settings::new();
        // Motion, timing and law are the family's, and with them the window.
        self.seen.start(cases.clone().next());
        for (lane, case) in cases.enumerate() {
            self.settings.set(lane, case);
            self.setups.push(LaneSetup {
                backlash_half_rad: match case.axis.transmission.joint {
                    Joint::Elastic(joint) => joint.backlash_half_rad,
                    Joint::Rigid => 0.0,
                },
                extremes: ExtremesSettings {
                    motion: case.motion,
                    settling_band_m: 1e-6 * case.run.settling_band_um,
                },
            });
            if self.family.law == Law::Firmware {
                let (controller, refused) = match FirmwareOnCounts::new(case, self.family.period_ns)
                {
                    Ok(controller) => (Some(controller), None),
                    Err(error) => (None, Some(error)),
                };
                self.firmware.push(controller);
                self.refused.push(refused);
            }
        }
        self.batch.start(&self.setups);
    }

    /// As the lockstep of a single run, all lanes at once.
    #[inline(always)]
    fn lockstep(&mut self, law: &mut impl LaneLaw<W>) -> Sums<W> {
        let (w, family, settings) = (self.width, &self.family, &self.settings);
        let z = w.splat(family.axis.transmission.gear_ratio);
        let p = w.splat(family.axis.transmission.screw_pitch_m_per_rad);
        let mut steps_ns = [0.0; MOST_STEPS];
        let mut steps = 0;
        for length_ns in family.steps_ns() {
            steps_ns[steps] = whole(length_ns);
            steps += 1;
        }
        let first_new_step = family.first_new_step();
        let zero = w.splat(0.0);
        let (mut squared, mut largest, mut limited_ns) = (zero, zero, zero);
        let mut in_force = Held {
            voltage_v: zero,
            limited: zero,
        };
        for tick in 0..=family.samples {
            let command = self.commands.at(tick);
            // 1. Sample.
            let alpha = self.batch.beta_rad() / z;
            // 2. Compute.
            let (code, count) = law.code(w, settings, alpha, w.splat(command.alpha_rad));
            let next = settings.held(w, code);
            // 3. Record.
            let error = self.batch.acceleration_mps2() - w.splat(command.acceleration_mps2);
            squared = squared + error * error;
            largest = w.larger(w.abs(code), largest);
            let carriage = p * (self.batch.beta_rad() - self.batch.epsilon_rad());
            self.seen.add(w, tick, [code, count], carriage);
            if tick == family.samples {
                break;
            }
            // 4. Move: first under the code still in force, then under the new.
            for (step, &length_ns) in steps_ns.iter().enumerate().take(steps) {
                if step >= first_new_step {
                    in_force = next;
                }
                limited_ns = limited_ns + in_force.limited * w.splat(length_ns);
                let end_m = W::array(command.step_ends_m[step]);
                self.batch.advance(step, in_force.voltage_v, &end_m);
            }
            in_force = next;
        }
        let mut sums = Sums {
            squared_acc_error: W::array(0.0),
            max_abs_dac_code: W::array(0.0),
            held_limit_ns: W::array(0.0),
        };
        w.store(squared, &mut sums.squared_acc_error);
        w.store(largest, &mut sums.max_abs_dac_code);
        w.store(limited_ns, &mut sums.held_limit_ns);
        sums
    }

    /// The figures of one lane.
    #[inline(never)]
    fn summary(&mut self, lane: usize, case: &Case, sums: &Sums<W>) -> Result<Summary, RunError> {
        if let Some(refused) = self.refused.get_mut(lane).and_then(Option::take) {
            return Err(RunError::Quantise(refused));
        }
        let rows = RowFigures::from_sums(
            self.family.samples + 1,
            sums.squared_acc_error.as_ref()[lane],
            sums.max_abs_dac_code.as_ref()[lane],
            self.seen.of(lane),
        );
        Ok(EndOfRun {
            case,
            solver: "exact",
            state: self.batch.state(lane),
            extremes: &self.batch.extremes(lane)?,
            rows: &rows,
            held_limit_ns: nanoseconds(sums.held_limit_ns.as_ref()[lane]),
            events: None,
            servo: None,
            chip: None,
        }
        .summary())
    }
}

/// A number of nanoseconds as a float; exact below 2^53, which is 104 days.
#[expect(clippy::cast_precision_loss, reason = "nanoseconds stay below 2^53")]
fn whole(ns: u64) -> f64 {
    ns as f64
}

/// A whole number of nanoseconds back as an integer.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a sum of step lengths: whole and not negative"
)]
fn nanoseconds(ns: f64) -> u64 {
    ns as u64
}
