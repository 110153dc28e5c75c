//! The runs that can be computed side by side, and the work that they make.
//!
//! The motion command at the samples is computed once for all runs of a family.

use std::fmt;
use std::sync::Arc;

use plant::{Amplifier, AxisParameters, Joint, Motion, Solver, Surroundings};

use crate::case::{Case, Law};
use crate::number::seconds;
use crate::options::{Compensation, GapSource};
use crate::rest::{MOST, Window};

/// Everything that runs must share to go side by side: the axis but for b, which
/// is 0 here, its surroundings, the command, the timing and the law. Gains, options of the
/// controller, encoders, converter, an amplifier without a limit of the current, settling band
/// and budget are each run's own.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Family {
    pub(crate) axis: AxisParameters,
    pub(crate) surroundings: Surroundings,
    pub(crate) motion: Motion,
    pub(crate) law: Law,
    pub(crate) period_ns: u64,
    pub(crate) delay_ns: u64,
    /// Samples after the one at 0.
    pub(crate) samples: u64,
    /// From the last one to the end.
    pub(crate) tail_ns: u64,
    /// The samples at rest.
    pub(crate) window: Option<Window>,
}

/// Why a run is made by itself and not side by side with others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum OneByOne {
    /// Rung `continuous` has no samples.
    Continuous,
    /// The plant is solved by steps.
    Solver,
    /// The plant has a drive or a load that the lanes do not know.
    Surroundings,
    /// The gap is measured before the run.
    Gap,
    /// The delay is no fixed part of the sample.
    Delay,
    /// Side by side, the samples at rest take too much memory.
    Rest,
    /// A time constant is far below a sample: what that takes is counted step by step.
    Stiff,
    /// The run has come to its work limit.
    Work,
}

impl fmt::Display for OneByOne {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Continuous => "rung continuous",
            Self::Solver => "a solver other than exact",
            Self::Surroundings => "a current drive, or a load that comes or goes",
            Self::Gap => "a measured gap",
            Self::Delay => "a measured delay",
            Self::Rest => "many samples at rest",
            Self::Stiff => "a time constant far below a sample",
            Self::Work => "the work limit",
        })
    }
}

impl Family {
    /// The family of a case.
    ///
    /// # Errors
    /// Why the run has to be made by itself.
    pub(crate) fn of(case: &Case) -> Result<Self, OneByOne> {
        let law = case.controller.law;
        let sample_time_ns = case.controller.sample_time_ns.filter(|&ns| ns > 0);
        let period_ns = sample_time_ns.filter(|_| law != Law::Continuous);
        let period_ns = period_ns.ok_or(OneByOne::Continuous)?;
        let delay_ns = case.controller.computation_delay.fixed_ns();
        let delay_ns = delay_ns.filter(|&ns| ns <= period_ns);
        let delay_ns = delay_ns.ok_or(OneByOne::Delay)?;
        let duration_ns = case.run.duration_ns;
        let mut surroundings = case.surroundings();
        let (samples, window) = (duration_ns / period_ns, Window::of(case));
        let at_rest = window.map_or(0, |window| samples + 1 - window.first);
        for (fits, otherwise) in [
            (
                case.solver() == Solver::Exact && case.axis.is_affine(),
                OneByOne::Solver,
            ),
            (surroundings.go_side_by_side(), OneByOne::Surroundings),
            (!measures_the_gap(case), OneByOne::Gap),
            (at_rest <= MOST, OneByOne::Rest),
        ] {
            if !fits {
                return Err(otherwise);
            }
        }
        let mut axis = case.axis;
        if let Joint::Elastic(joint) = &mut axis.transmission.joint {
            joint.backlash_half_rad = 0.0;
        }
        if surroundings.amplifier.current_limit_a().is_none() {
            // Each run has its own.
            surroundings.amplifier = Amplifier::default();
        }
        Ok(Self {
            axis,
            surroundings,
            motion: case.motion.clone(),
            law,
            period_ns,
            delay_ns,
            samples,
            tail_ns: duration_ns % period_ns,
            window,
        })
    }

    /// Steps of a sample, and of what follows the last one.
    pub(crate) fn steps(&self) -> [SampleSteps; 2] {
        let sample = SampleSteps::of(self.period_ns, self.delay_ns, 0);
        let tail = SampleSteps::of(self.tail_ns, self.delay_ns, sample.number);
        [sample, tail]
    }
}

/// True of a run before which the firmware's routine runs on an axis of its own.
fn measures_the_gap(case: &Case) -> bool {
    let backlash = &case.options.backlash;
    case.controller.law == Law::Firmware
        && backlash.gap == GapSource::Measured
        && backlash.compensation != Compensation::None
}

/// Steps of a sample at most.
pub(crate) const MOST_STEPS: usize = 2;

/// The steps of a sample: up to the delay, and after it. A delay of 0, or of all that there
/// is, leaves one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SampleSteps {
    /// Number of the first among those of the plant.
    pub(crate) first: usize,
    pub(crate) lengths_ns: [u64; MOST_STEPS],
    /// The same as real numbers.
    pub(crate) real_ns: [f64; MOST_STEPS],
    pub(crate) number: usize,
    /// The first one under the new code; a step that there is not where the code
    /// waits for the next sample.
    pub(crate) first_new: usize,
}

impl SampleSteps {
    fn of(length_ns: u64, delay_ns: u64, first: usize) -> Self {
        let delayed_ns = delay_ns.min(length_ns);
        let (lengths_ns, number) = match (delayed_ns, length_ns - delayed_ns) {
            (0, 0) => ([0, 0], 0),
            (0, length_ns) | (length_ns, 0) => ([length_ns, 0], 1),
            both => (both.into(), 2),
        };
        Self {
            first,
            lengths_ns,
            real_ns: lengths_ns.map(|length_ns| length_ns as f64),
            number,
            first_new: usize::from(delay_ns > 0),
        }
    }

    /// Their lengths \[ns\].
    pub(crate) fn lengths_ns(&self) -> &[u64] {
        &self.lengths_ns[..self.number]
    }
}

/// Runs at a time: so many that the lanes whose contact changes make full
/// vectors, so few that all stay in the cache.
pub(super) const AT_A_TIME: usize = 128;

/// Lanes of the widest vectors.
const LANES: usize = 8;

/// Cases of one family, or cases that are made by themselves: a piece of work for one
/// thread.
#[derive(Debug)]
pub struct Parcel {
    pub(super) family: Result<Family, OneByOne>,
    pub(super) places: Vec<usize>,
}

/// The cases cut into work for a number of threads: as much as is computed at a
/// time, unless that left a thread without any.
pub fn parcels(cases: &[Case], threads: usize) -> Vec<Parcel> {
    let mut parcels = Vec::new();
    for Parcel { family, places } in groups(cases) {
        let share = match &family {
            Err(_) => 1,
            Ok(_) => {
                let share = places.len().div_ceil(threads);
                share.next_multiple_of(LANES).min(AT_A_TIME)
            }
        };
        parcels.extend(places.chunks(share).map(|places| Parcel {
            family: family.clone(),
            places: places.to_vec(),
        }));
    }
    parcels
}

/// Families that a case is compared with at most: an axis of its own for every case
/// must not cost more than the runs.
const MOST_COMPARED: usize = 1024;

/// The families in the order in which they appear, each with its cases in order; one
/// comes again where more than [`MOST_COMPARED`] others lie between its cases.
pub(super) fn groups(cases: &[Case]) -> Vec<Parcel> {
    let mut groups: Vec<Parcel> = Vec::new();
    for (place, case) in cases.iter().enumerate() {
        let family = Family::of(case);
        let mut last = groups.iter_mut().rev().take(MOST_COMPARED);
        match last.find(|group| group.family == family) {
            Some(group) => group.places.push(place),
            None => groups.push(Parcel {
                family,
                places: vec![place],
            }),
        }
    }
    for group in groups.iter_mut().filter(|group| group.family.is_ok()) {
        put_alike_together(cases, &mut group.places);
    }
    groups
}

/// Runs of a cell of K_d and K_p, within which they are in the order of b.
const PER_CELL: usize = 400;

/// Orders runs of one family so that neighbours change contact at like times: their lanes
/// then leave the common step together.
fn put_alike_together(cases: &[Case], places: &mut [usize]) {
    let keys = |place: usize| {
        let (gains, transmission) = (
            &cases[place].controller.gains,
            &cases[place].axis.transmission,
        );
        [gains.kd_s, gains.kp, transmission.joint.backlash_half_rad()]
    };
    let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for &place in places.iter() {
        for ([lowest, highest], key) in ranges.iter_mut().zip(keys(place)) {
            (*lowest, *highest) = (lowest.min(key), highest.max(key));
        }
    }
    let cells = (places.len() as f64 / PER_CELL as f64).sqrt().ceil();
    places.sort_by_cached_key(|&place| {
        let mut share = keys(place);
        for (share, [lowest, highest]) in share.iter_mut().zip(ranges) {
            let width = highest - lowest;
            *share = if width > 0.0 {
                (*share - lowest) / width
            } else {
                0.0
            };
        }
        let [kd, kp, b] = share;
        let cell = |share: f64| (share * cells).floor().min(cells - 1.0) as u64;
        // A share is from 0 to 1.
        (cell(kd), cell(kp), (b * 4_294_967_295.0) as u64, place)
    });
}

/// Samples that are kept: 2 MB, 65 s at 1 ms. Of later ones the command is
/// computed when it is needed, so that no run takes more memory than this.
const MOST_KEPT: u64 = 65_536;

/// The command at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Command {
    /// `α_ref(t_k)` \[rad\].
    pub(crate) alpha_rad: f64,
    /// `ẍ_ref(t_k)`, right-continuous \[m/s²\].
    pub(crate) acceleration_mps2: f64,
    /// `x_ref` at the end of each step of the sample \[m\].
    pub(crate) step_ends_m: [f64; MOST_STEPS],
}

/// What the command at the samples follows from.
#[derive(Debug, Clone, PartialEq)]
struct Timing {
    motion: Motion,
    period_ns: u64,
    /// Of a sample, and of what follows the last one.
    steps_ns: [[u64; MOST_STEPS]; 2],
    metres_per_rad: f64,
    samples: u64,
}

impl Timing {
    fn of(family: &Family) -> Self {
        let transmission = &family.axis.transmission;
        Self {
            motion: family.motion.clone(),
            period_ns: family.period_ns,
            steps_ns: family.steps().map(|steps| steps.lengths_ns),
            metres_per_rad: transmission.screw_pitch_m_per_rad * transmission.gear_ratio,
            samples: family.samples,
        }
    }
}

/// The command from sample to sample.
#[derive(Debug, Clone)]
pub(crate) struct Commands {
    of: Timing,
    kept: Vec<Command>,
}

impl Commands {
    /// Those of a family: the known ones where they serve, which then are those that are
    /// known. Axes that differ in a mass have the same.
    pub(crate) fn of(family: &Family, known: &mut Option<Arc<Self>>) -> Arc<Self> {
        let of = Timing::of(family);
        let fitting = known.take().filter(|commands| commands.of == of);
        let commands = fitting.unwrap_or_else(|| Arc::new(Self::new(of)));
        Arc::clone(known.insert(commands))
    }

    fn new(of: Timing) -> Self {
        let number = of.samples.saturating_add(1).min(MOST_KEPT);
        let mut commands = Self {
            of,
            kept: Vec::new(),
        };
        commands.kept = (0..number).map(|tick| commands.compute(tick)).collect();
        commands
    }

    /// The command of sample `tick`.
    #[inline(always)]
    pub(crate) fn at(&self, tick: u64) -> Command {
        match usize::try_from(tick).ok().and_then(|k| self.kept.get(k)) {
            Some(command) => *command,
            None => self.compute(tick),
        }
    }

    #[inline(never)]
    fn compute(&self, tick: u64) -> Command {
        let of = &self.of;
        let mut time_ns = tick * of.period_ns;
        let now = of.motion.at(seconds(time_ns));
        let steps_ns = of.steps_ns[usize::from(tick == of.samples)];
        let step_ends_m = steps_ns.map(|length_ns| {
            // The end of a step as the plant's spans have it.
            let end_s = seconds(time_ns) + seconds(length_ns);
            time_ns += length_ns;
            of.motion.at(end_s).displacement_m
        });
        Command {
            alpha_rad: now.displacement_m / of.metres_per_rad,
            acceleration_mps2: now.acceleration_mps2,
            step_ends_m,
        }
    }
}
