//! Largest values over the continuous solution, without a trace.
//!
//! Every span of the solution is searched between its ends; the limits on
//! both sides of a contact change are ends of spans. Memory does not grow
//! with the run.

use crate::model::axis::{Axis, Mode};
use crate::model::motion::{Motion, MotionPoint};
use crate::model::state::{BETA, CURRENT, Vector};

/// Figures whose peaks between the samples are kept: ẍ, I, how far the
/// carriage and the motor are behind the command, and the electrical power.
pub(crate) const FIGURES: usize = 5;

/// Place of the carriage's following error; the motor's follows.
pub(crate) const CARRIAGE: usize = 2;

/// Place of the power.
pub(crate) const POWER: usize = 4;

/// True if a figure is what the command exceeds a quantity by.
pub(crate) fn is_following_error(figure: usize) -> bool {
    (CARRIAGE..POWER).contains(&figure)
}

/// The figures in a state, x_ref and the voltage being these.
pub(crate) fn figures_at(
    axis: &Axis,
    mode: &Mode,
    y: &Vector,
    (x_ref_m, voltage_v): (f64, f64),
) -> [f64; FIGURES] {
    let p = axis.pitch_m_per_rad;
    [
        axis.carriage_acceleration_mps2(mode, y),
        y[CURRENT],
        x_ref_m - p * axis.screw_angle_rad(y),
        x_ref_m - p * y[BETA],
        voltage_v * y[CURRENT],
    ]
}

/// Energies of a piece of the solution \[J\]: the heat of the joint's damper, that of the
/// armature, and what the motor takes.
pub(crate) type Energies = [f64; ENERGIES];

/// Number of them.
pub(crate) const ENERGIES: usize = 3;

/// Peaks and last exit from the settling band that a look at a piece has shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    /// The figures' peaks, this piece included.
    pub(crate) peaks: [f64; FIGURES],
    /// Last instant outside the settling band, if the carriage was there \[s\].
    pub(crate) last_outside_s: Option<f64>,
    /// Work of the look.
    pub(crate) work: u64,
}

/// Command and band that following and settling are measured against.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtremesSettings {
    /// The commanded motion.
    pub motion: Motion,
    /// Half width of the settling band around the travel \[m\].
    pub settling_band_m: f64,
}

/// Extremes of a run so far. Starts at rest at zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Extremes {
    pub(crate) settings: ExtremesSettings,
    pub(crate) command_at_end: Option<(f64, MotionPoint)>,
    /// sup of |ẍ| \[m/s²\], both one-sided limits at events included.
    pub peak_abs_acceleration_mps2: f64,
    /// sup of |x_ref − x| \[m\].
    pub peak_following_error_m: f64,
    /// sup of |x_ref − p·β| \[m\].
    pub peak_motor_following_error_m: f64,
    /// sup of |I| \[A\].
    pub peak_abs_current_a: f64,
    /// sup of |V·I| \[W\].
    pub peak_abs_power_w: f64,
    /// sup of |V_m| in force \[V\].
    pub peak_abs_voltage_v: f64,
    /// Time at the amplifier's voltage limit, as far as the plant decides it: under the
    /// continuous law, and behind the command of a current drive or a current limit \[s\].
    pub voltage_limited_s: f64,
    /// Time with the current held at its limit or beyond, or under the continuous law
    /// with a current drive's command at its own \[s\].
    pub current_limited_s: f64,
    /// Last instant at which the carriage was outside the settling band \[s\].
    pub last_outside_band_s: Option<f64>,
    /// Changes of contact.
    pub contact_changes: u64,
    /// Closings of the gap.
    pub impacts: u64,
    /// Largest |ε̇| at which the gap closed \[rad/s\]; 0 if it never did.
    pub hardest_impact_radps: f64,
    /// `∫ c·ε̇² dt` over the time in contact \[J\]: what the joint's damper has
    /// turned into heat.
    pub joint_loss_j: f64,
    /// `∫ R·I² dt` \[J\]: what the armature has turned into heat.
    pub armature_loss_j: f64,
    /// `∫ V·I dt` \[J\]: what the amplifier has given the motor, less what came back.
    pub electrical_energy_j: f64,
    /// Work so far: steps of an adaptive solver, steps along the solution where a
    /// time constant is far below the interval, and changes of mode. The same on
    /// every machine, and for runs side by side.
    pub work: u64,
    /// Work with which the run ends.
    pub work_limit: u64,
}

impl Extremes {
    /// Nothing seen yet.
    pub fn new(settings: ExtremesSettings) -> Self {
        Self {
            settings,
            command_at_end: None,
            peak_abs_acceleration_mps2: 0.0,
            peak_following_error_m: 0.0,
            peak_motor_following_error_m: 0.0,
            peak_abs_current_a: 0.0,
            peak_abs_power_w: 0.0,
            peak_abs_voltage_v: 0.0,
            voltage_limited_s: 0.0,
            current_limited_s: 0.0,
            last_outside_band_s: None,
            contact_changes: 0,
            impacts: 0,
            hardest_impact_radps: 0.0,
            joint_loss_j: 0.0,
            armature_loss_j: 0.0,
            electrical_energy_j: 0.0,
            work: 0,
            work_limit: u64::MAX,
        }
    }

    /// Peaks of the figures.
    pub(crate) fn peaks(&self) -> [f64; FIGURES] {
        [
            self.peak_abs_acceleration_mps2,
            self.peak_abs_current_a,
            self.peak_following_error_m,
            self.peak_motor_following_error_m,
            self.peak_abs_power_w,
        ]
    }

    /// The same, to be raised.
    pub(crate) fn peaks_mut(&mut self) -> [&mut f64; FIGURES] {
        [
            &mut self.peak_abs_acceleration_mps2,
            &mut self.peak_abs_current_a,
            &mut self.peak_following_error_m,
            &mut self.peak_motor_following_error_m,
            &mut self.peak_abs_power_w,
        ]
    }

    /// Takes over what was seen in a piece of the exact solution.
    pub(crate) fn take(&mut self, seen: &Seen) {
        for (peak, seen) in self.peaks_mut().into_iter().zip(seen.peaks) {
            *peak = seen;
        }
        // `None` is less than any time.
        if seen.last_outside_s > self.last_outside_band_s {
            self.last_outside_band_s = seen.last_outside_s;
        }
        self.work += seen.work;
    }

    /// The energies so far, to be added to.
    pub(crate) fn energies_mut(&mut self) -> [&mut f64; ENERGIES] {
        [
            &mut self.joint_loss_j,
            &mut self.armature_loss_j,
            &mut self.electrical_energy_j,
        ]
    }

    /// Adds those of a piece.
    #[inline(always)]
    pub(crate) fn add(&mut self, energies: Energies) {
        for (sum, energy_j) in self.energies_mut().into_iter().zip(energies) {
            *sum += energy_j;
        }
    }

    /// The command at the start of a span, which is the end of the last.
    pub(crate) fn command_at(&self, start_s: f64) -> MotionPoint {
        match self.command_at_end {
            Some((time_s, command)) if time_s == start_s => command,
            _ => self.settings.motion.at(start_s),
        }
    }
}
