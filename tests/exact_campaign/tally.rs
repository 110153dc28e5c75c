//! Counts over the samples of a campaign.

use core::fmt;

use bench_tests::solvers::{FINER_TOLERANCE, REFERENCE_TOLERANCE};
use hil_core::case::ComputationDelay;
use plant::{AxisParameters, Contact, Joint};

use crate::compare::{Excuse, compare};
use crate::trial::{Excitation, Sample, Trial};

/// Faults that are kept word for word.
const FAULTS: usize = 12;

/// Things that a campaign must have met to mean anything.
pub(crate) const KINDS: [&str; 20] = [
    "elastic sample",
    "rigid sample",
    "b = 0 sample",
    "undamped joint sample",
    "b below 1e-12 rad sample",
    "sampled",
    "quantised",
    "firmware",
    "delayed code",
    "at the voltage limit",
    "open 0 → 1",
    "coast 0 → −1",
    "drive 1 → 0",
    "coast −1 → 0",
    "let go under no_pull",
    "took load again under no_pull",
    "change and return within a sample",
    "stuck screw",
    "stuck screw got loose",
    "sliding screw stuck or turned",
];

/// Counts of a campaign; the sum over cases does not depend on their order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tally {
    pub(crate) cases: u64,
    pub(crate) samples: u64,
    pub(crate) touched: u64,
    pub(crate) near_count: u64,
    /// Left out because of a surface, a count, the last bit.
    pub(crate) excused: [u64; 3],
    /// Compared with the finer reference.
    pub(crate) finer: u64,
    pub(crate) failed: u64,
    pub(crate) gave_up: u64,
    pub(crate) changes: u64,
    pub(crate) kinds: [u64; KINDS.len()],
    pub(crate) worst_state: f64,
    pub(crate) worst_time: f64,
    /// Largest difference that the last bit excuses, in last bits.
    pub(crate) worst_last_bits: f64,
    /// Case and words of the first faults.
    pub(crate) faults: Vec<(u64, String)>,
}

impl Tally {
    /// Runs the case of a seed and compares every sample.
    pub(crate) fn of_case(seed: u64, spoil: fn(&mut AxisParameters), tolerance: f64) -> Self {
        let mut tally = Self {
            cases: 1,
            ..Self::default()
        };
        let trial = match Trial::run(seed, spoil) {
            Ok(trial) => trial,
            Err(error) => {
                tally.gave_up = 1;
                tally.fault(seed, format!("the exact solver gave up: {error}"));
                return tally;
            }
        };
        for (number, sample) in trial.samples.iter().enumerate() {
            let verdict = compare(&trial, sample, tolerance);
            tally.samples += 1;
            tally.finer += u64::from(verdict.finer);
            tally.touched += u64::from(verdict.touched);
            match verdict.excuse {
                None => {}
                Some(Excuse::Touched) => tally.excused[0] += 1,
                Some(Excuse::NearCount) => tally.excused[1] += 1,
                Some(Excuse::Amplified) => {
                    tally.excused[2] += 1;
                    tally.worst_last_bits = tally.worst_last_bits.max(verdict.last_bits);
                }
            }
            tally.near_count += u64::from(verdict.near_count);
            tally.changes += sample.changes.len() as u64;
            tally.kinds_of(&trial, sample);
            if verdict.excuse.is_none() {
                tally.worst_state = tally.worst_state.max(verdict.state_share);
                tally.worst_time = tally.worst_time.max(verdict.time_share);
            }
            if let Some(fault) = verdict.fault {
                tally.failed += 1;
                tally.fault(seed, format!("sample {number}: {fault}"));
            }
        }
        tally
    }

    fn fault(&mut self, seed: u64, words: String) {
        self.faults.push((seed, words));
        self.faults.sort();
        self.faults.truncate(FAULTS);
    }

    /// Adds the counts of other cases.
    pub(crate) fn add(&mut self, other: Self) {
        self.cases += other.cases;
        self.samples += other.samples;
        self.finer += other.finer;
        self.touched += other.touched;
        for (mine, others) in self.excused.iter_mut().zip(other.excused) {
            *mine += others;
        }
        self.near_count += other.near_count;
        self.failed += other.failed;
        self.gave_up += other.gave_up;
        self.changes += other.changes;
        for (mine, others) in self.kinds.iter_mut().zip(other.kinds) {
            *mine += others;
        }
        self.worst_state = self.worst_state.max(other.worst_state);
        self.worst_time = self.worst_time.max(other.worst_time);
        self.worst_last_bits = self.worst_last_bits.max(other.worst_last_bits);
        for (seed, words) in other.faults {
            self.fault(seed, words);
        }
    }

    /// Share of the samples that are left out.
    pub(crate) fn excluded_share(&self) -> f64 {
        self.excused.iter().sum::<u64>() as f64 / self.samples as f64
    }

    fn kinds_of(&mut self, trial: &Trial, sample: &Sample) {
        let (case, axis) = (&trial.case, &trial.case.axis);
        let (before, after) = (sample.before.state(), sample.after.state());
        let joint = match axis.transmission.joint {
            Joint::Rigid => None,
            Joint::Elastic(joint) => Some(joint),
        };
        let b = joint.map(|joint| joint.backlash_half_rad);
        let friction = axis.carriage.resistance;
        let sticks = friction.opposes_motion && friction.constant_n != 0.0;
        let (was_stuck, is_stuck) = (
            sticks && before.gamma_dot_radps() == 0.0,
            sticks && after.gamma_dot_radps() == 0.0,
        );
        let law = case.controller.law.name();
        let limit_v = case.amplifier.voltage_limit_v;
        let saturated = trial.excitation == Excitation::Law && sample.new.0.abs() >= limit_v;
        let steps = |from, to, impact: bool| {
            let alike = |c: &&plant::ContactChange| (c.from, c.to, c.impact) == (from, to, impact);
            sample.changes.iter().filter(alike).count() as u64
        };
        let (open, drive, coast) = (Contact::Open, Contact::Drive, Contact::Coast);
        let releases = joint.is_some_and(|joint| joint.no_pull && joint.damping_nms_per_rad > 0.0);
        let parted = [steps(drive, open, false), steps(coast, open, false)];
        let returned =
            sample.changes.len() >= 2 && sample.before.contact() == sample.after.contact();
        let counts = [
            u64::from(joint.is_some()),
            u64::from(joint.is_none()),
            u64::from(b == Some(0.0)),
            u64::from(joint.is_some_and(|joint| joint.damping_nms_per_rad == 0.0)),
            u64::from(b.is_some_and(|b| b > 0.0 && b < 1e-12)),
            u64::from(law == "sampled"),
            u64::from(law == "quantised"),
            u64::from(law == "firmware"),
            u64::from(case.controller.computation_delay != ComputationDelay::Fixed(0)),
            u64::from(saturated),
            steps(open, drive, true),
            steps(open, coast, true),
            parted[0] * u64::from(!releases),
            parted[1] * u64::from(!releases),
            (parted[0] + parted[1]) * u64::from(releases),
            steps(open, drive, false) + steps(open, coast, false),
            u64::from(returned),
            u64::from(was_stuck && is_stuck),
            u64::from(was_stuck && !is_stuck),
            u64::from(
                sticks
                    && !was_stuck
                    && (is_stuck || before.gamma_dot_radps() * after.gamma_dot_radps() < 0.0),
            ),
        ];
        for (mine, more) in self.kinds.iter_mut().zip(counts) {
            *mine += more;
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} cases, {} samples, {} contact changes",
            self.cases, self.samples, self.changes
        )?;
        writeln!(
            f,
            "reference: dopri5 at {REFERENCE_TOLERANCE:e}, restarted at every sample; for {} at {FINER_TOLERANCE:e}",
            self.finer
        )?;
        writeln!(
            f,
            "touched a surface: {}, next to a count: {}; of these disagree and are left out: {}, {}",
            self.touched, self.near_count, self.excused[0], self.excused[1]
        )?;
        writeln!(
            f,
            "left out where the last bit of the start decides: {}, with at most {:.0} times its effect; altogether {:.4} %",
            self.excused[2],
            self.worst_last_bits,
            100.0 * self.excluded_share()
        )?;
        writeln!(
            f,
            "failed: {} samples, {} cases given up",
            self.failed, self.gave_up
        )?;
        writeln!(
            f,
            "largest share of the tolerance used: state {:.3}, time {:.3}",
            self.worst_state, self.worst_time
        )?;
        for (name, count) in KINDS.iter().zip(self.kinds) {
            writeln!(f, "{count:>9} {name}")?;
        }
        for (seed, words) in &self.faults {
            writeln!(f, "case {seed}: {words}")?;
        }
        Ok(())
    }
}
