//! The motion command at the samples, computed once for all runs of a family.

use plant::Motion;

use super::family::Family;
use crate::time::seconds;

/// Steps of a sample at most.
pub(crate) const MOST_STEPS: usize = 2;

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

/// The command from sample to sample.
#[derive(Debug, Clone)]
pub(crate) struct Commands {
    motion: Motion,
    period_ns: u64,
    steps_ns: [u64; MOST_STEPS],
    metres_per_rad: f64,
    kept: Vec<Command>,
}

impl Commands {
    pub(crate) fn new(family: &Family) -> Self {
        let transmission = &family.axis.transmission;
        let mut steps_ns = [0; MOST_STEPS];
        for (to, from) in steps_ns.iter_mut().zip(family.steps_ns()) {
            *to = from;
        }
        let mut commands = Self {
            motion: family.motion,
            period_ns: family.period_ns,
            steps_ns,
            metres_per_rad: transmission.screw_pitch_m_per_rad * transmission.gear_ratio,
            kept: Vec::new(),
        };
        let kept = family.samples.saturating_add(1).min(MOST_KEPT);
        commands.kept = (0..kept).map(|tick| commands.compute(tick)).collect();
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
        let mut time_ns = tick * self.period_ns;
        let now = self.motion.at(seconds(time_ns));
        let step_ends_m = self.steps_ns.map(|length_ns| {
            // The end of a step as the plant's spans have it.
            let end_s = seconds(time_ns) + seconds(length_ns);
            time_ns += length_ns;
            self.motion.at(end_s).displacement_m
        });
        Command {
            alpha_rad: now.displacement_m / self.metres_per_rad,
            acceleration_mps2: now.acceleration_mps2,
            step_ends_m,
        }
    }
}
