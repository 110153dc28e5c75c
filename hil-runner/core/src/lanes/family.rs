//! The runs that can be computed side by side, and the work that they make.

use std::collections::HashMap;

use plant::{AxisParameters, Joint, Motion, Solver};

use crate::case::{Case, Law};

/// Everything that runs must share to go side by side: the axis but for b,
/// the command, the timing and the law. Gains, encoder, converter, amplifier,
/// settling band and budget are each run's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Family {
    pub(crate) axis: AxisParameters,
    pub(crate) motion: Motion,
    pub(crate) law: Law,
    pub(crate) period_ns: u64,
    pub(crate) delay_ns: u64,
    /// Samples after the one at 0.
    pub(crate) samples: u64,
}

/// Numbers that tell families apart.
const KEY: usize = 27;

/// A family as plain bits, to be looked up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Key([u64; KEY]);

impl Family {
    /// The family of a case; none where the run has to be made by itself:
    /// another solver, the continuous law, an axis with more than the paper's
    /// law, a delay that is measured, or a duration that ends within a sample.
    pub(crate) fn of(case: &Case) -> Option<Self> {
        let period_ns = case.controller.sample_time_ns.filter(|&ns| ns > 0)?;
        let delay_ns = case.controller.computation_delay.fixed_ns()?;
        let law = case.controller.law;
        let duration_ns = case.run.duration_ns;
        let fits = law != Law::Continuous
            && (law != Law::Firmware || case.options.is_off())
            && case.solver() == Solver::Exact
            && case.axis.is_affine()
            && delay_ns <= period_ns
            && duration_ns.is_multiple_of(period_ns);
        fits.then_some(Self {
            axis: case.axis,
            motion: case.motion,
            law,
            period_ns,
            delay_ns,
            samples: duration_ns / period_ns,
        })
    }

    /// Equal for two families exactly if their runs can go side by side.
    pub(crate) fn key(&self) -> Key {
        let (motor, transmission) = (&self.axis.motor, &self.axis.transmission);
        let (carriage, resistance) = (&self.axis.carriage, &self.axis.carriage.resistance);
        let (stiffness, damping, no_pull) = match transmission.joint {
            Joint::Rigid => (0.0, 0.0, 2),
            Joint::Elastic(joint) => (
                joint.stiffness_nm_per_rad,
                joint.damping_nms_per_rad,
                u64::from(joint.no_pull),
            ),
        };
        let [t1, t2, t3, t4, t5, t6, t7] = self.motion.intervals_s();
        let numbers = [
            motor.inertia_kg_m2,
            motor.torque_constant_nm_per_a,
            motor.resistance_ohm,
            motor.inductance_h,
            transmission.gear_ratio,
            transmission.screw_inertia_kg_m2,
            transmission.screw_pitch_m_per_rad,
            stiffness,
            damping,
            carriage.mass_kg,
            resistance.constant_n,
            resistance.linear_ns_per_rad,
            resistance.quadratic_ns2_per_rad2,
            self.motion.travel_m(),
            t1,
            t2,
            t3,
            t4,
            t5,
            t6,
            t7,
        ]
        .map(f64::to_bits);
        let whole = [
            no_pull,
            u64::from(resistance.opposes_motion),
            self.period_ns,
            self.delay_ns,
            self.samples,
            match self.law {
                Law::Continuous => 0,
                Law::Sampled => 1,
                Law::Quantised => 2,
                Law::Firmware => 3,
            },
        ];
        let mut key = [0; KEY];
        for (to, from) in key.iter_mut().zip(numbers.into_iter().chain(whole)) {
            *to = from;
        }
        Key(key)
    }

    /// Steps of a sample \[ns\]: up to the delay, and after it. A delay of 0 or
    /// of a whole sample leaves one.
    pub(crate) fn steps_ns(&self) -> impl Iterator<Item = u64> + use<> {
        let (delay_ns, rest_ns) = (self.delay_ns, self.period_ns - self.delay_ns);
        [delay_ns, rest_ns].into_iter().filter(|&ns| ns > 0)
    }

    /// Number of the first step of a sample under the new code; a step that
    /// there is not where the code waits for the next sample.
    pub(crate) fn first_new_step(&self) -> usize {
        usize::from(self.delay_ns > 0)
    }
}

/// Runs at a time: so many that the lanes whose contact changes make full
/// vectors, so few that all stay in the cache.
pub(super) const AT_A_TIME: usize = 64;

/// Lanes of the widest vectors.
const LANES: usize = 8;

/// Cases of one family, or cases without one: a piece of work for one thread.
#[derive(Debug)]
pub struct Parcel {
    pub(super) family: Option<Family>,
    pub(super) places: Vec<usize>,
}

/// The cases cut into work for a number of threads: as much as is computed at a
/// time, unless that left a thread without any.
pub fn parcels(cases: &[Case], threads: usize) -> Vec<Parcel> {
    let cut = |group: &Group| match group.family {
        None => 1,
        Some(_) => {
            let share = group.places.len().div_ceil(threads);
            share.next_multiple_of(LANES).min(AT_A_TIME)
        }
    };
    let parcel = |family| {
        move |places: &[usize]| Parcel {
            family,
            places: places.to_vec(),
        }
    };
    groups(cases)
        .iter()
        .flat_map(|group| {
            group
                .places
                .chunks(cut(group))
                .map(parcel(group.family))
                .collect::<Vec<_>>()
        })
        .collect()
}

/// Places of the cases of one family, in order.
pub(super) struct Group {
    pub(super) family: Option<Family>,
    pub(super) places: Vec<usize>,
}

/// The families in the order in which they appear.
pub(super) fn groups(cases: &[Case]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut known = HashMap::new();
    for (place, case) in cases.iter().enumerate() {
        let family = Family::of(case);
        let key = family.as_ref().map(Family::key);
        let number = *known.entry(key).or_insert(groups.len());
        match groups.get_mut(number) {
            Some(group) => group.places.push(place),
            None => groups.push(Group {
                family,
                places: vec![place],
            }),
        }
    }
    groups
}
