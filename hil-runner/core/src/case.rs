//! One run, checked and in SI units: what a run file says.

use plant::{
    Amplifier, AxisParameters, ContinuousPid, Control, Dac, Encoder, Load, Motion, PidGains,
    Solver, Start, Surroundings,
};

use crate::figures;
use crate::options::AxisOptions;

/// By how much of its mass the carriage is heavier in a second run, which tells how
/// many digits of the first one's figures hold.
pub const MASS_CHANGE: f64 = 1e-12;

/// A run that is complete and within every allowed range.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name of the run; the stem of its file unless the file says otherwise.
    pub name: String,
    /// The template that its file was made from, if the file says so.
    pub template: Option<AxisTemplate>,
    /// Paths of the values that the file still has from it.
    pub template_values: Vec<String>,
    /// Motor, transmission and carriage.
    pub axis: AxisParameters,
    /// D/A converter. `bits` acts from rung `quantised` up.
    pub dac: Dac,
    /// Power amplifier.
    pub amplifier: Amplifier,
    /// Force on the carriage at all times, positive against positive x \[N\].
    pub load_force_n: f64,
    /// Forces that act for a time, on top.
    pub loads: Vec<Load>,
    /// Where the joint stands at the start.
    pub start: Start,
    /// Encoder on the motor shaft.
    pub encoder: Encoder,
    /// Control law and its timing.
    pub controller: ControllerSettings,
    /// Options of the controller beyond the paper's law, on rung `firmware`.
    pub options: AxisOptions,
    /// The chip, for what its time costs.
    pub target: TargetSettings,
    /// Motion command of the carriage.
    pub motion: Motion,
    /// Duration, solver and what is recorded.
    pub run: RunSettings,
    /// Limits on summary figures; `None` takes the default budget.
    pub budget: Option<Vec<Limit>>,
    /// Paths of the keys beyond the paper's law that the run file sets and the
    /// rung leaves out.
    pub keys_without_effect: Vec<String>,
}

/// A run file to make an axis of one's own from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisTemplate {
    /// A ball screw, driven directly.
    Ballscrew,
    /// A toothed belt behind a reducer.
    Belt,
    /// Rack and pinion behind a reducer.
    Rack,
    /// A ball screw behind a reducer.
    Gearbox,
}

/// The controller that runs: the rungs of the ladder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Law {
    /// The paper's own model: no sampling (eq. 27-37).
    Continuous,
    /// f64 PID at the sample time with a zero-order hold.
    Sampled,
    /// The same on encoder counts and DAC codes.
    Quantised,
    /// The `firmware` crate, fixed point.
    Firmware,
}

impl Law {
    /// All rungs from the bottom up.
    pub const ALL: [Self; 4] = [
        Self::Continuous,
        Self::Sampled,
        Self::Quantised,
        Self::Firmware,
    ];

    /// Their names, in the same order.
    pub const NAMES: [&str; 4] = ["continuous", "sampled", "quantised", "firmware"];

    /// The rung of a name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|law| law.name() == name)
    }

    /// The rung's name in run files, traces and summaries.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// Control law and its timing (`[controller]`), as every rung has them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerSettings {
    /// The rung.
    pub law: Law,
    /// Gains per encoder count.
    pub gains: PidGains,
    /// The cascade that they were given as, if they were; the law has `gains` alone.
    pub cascade: Option<CascadeGains>,
    /// Sample time Δt \[ns\], greater than 0; `None` only where the run file
    /// leaves it out, which only rung `continuous` allows.
    pub sample_time_ns: Option<u64>,
    /// From sample to new voltage.
    pub computation_delay: ComputationDelay,
}

/// Gains of a position loop around a PI velocity loop, volts at the motor, or with a
/// current drive amperes, per radian of the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CascadeGains {
    /// `k_v` of the position loop \[1/s\].
    pub kv_per_s: f64,
    /// `k` of the velocity loop \[V s/rad, or with a current drive A s/rad\].
    pub velocity_gain_vs_per_rad: f64,
    /// `T_n` of the velocity loop \[s\].
    pub velocity_reset_s: f64,
}

impl Default for CascadeGains {
    /// No gain, and no integral part.
    fn default() -> Self {
        Self {
            kv_per_s: 0.0,
            velocity_gain_vs_per_rad: 0.0,
            velocity_reset_s: f64::INFINITY,
        }
    }
}

impl CascadeGains {
    /// `K_p` \[V/rad\], `K_i` \[V/(rad s)\] and `K_d` \[V s/rad\] of the same law:
    /// `u = k·(1 + 1/(T_n·s))·(k_v·e + ė)`.
    pub fn gains(self) -> [f64; 3] {
        let (kv, k) = (self.kv_per_s, self.velocity_gain_vs_per_rad);
        let tn_s = self.velocity_reset_s;
        [k * (kv + 1.0 / tn_s), k * kv / tn_s, k]
    }
}

/// Time of a code from its sample to the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComputationDelay {
    /// Always so long \[ns\], at most the sample time.
    Fixed(u64),
    /// Each code as long as its own step took on the chip, at most the sample
    /// time. Known only with the controller on one.
    Measured,
}

impl ComputationDelay {
    /// The delay of every code \[ns\]; `None` where each has its own.
    pub fn fixed_ns(self) -> Option<u64> {
        match self {
            Self::Fixed(ns) => Some(ns),
            Self::Measured => None,
        }
    }
}

/// The chip, as far as the time of a step depends on it (`[target]`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetSettings {
    /// Clock of the core \[Hz\], where only instructions are counted; `None`
    /// takes that of a common part.
    pub clock_hz: Option<u64>,
    /// Cycles that an instruction is allowed, where only instructions are
    /// counted; greater than 0.
    pub cycles_per_instruction: f64,
}

impl Default for TargetSettings {
    fn default() -> Self {
        Self {
            clock_hz: None,
            cycles_per_instruction: 4.0,
        }
    }
}

/// Choice of the method that solves the plant (`run.solver`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverChoice {
    /// `exact` where the plant allows it, else `dopri5`.
    #[default]
    Auto,
    /// Exact between two voltage updates; no quadratic resistance.
    Exact,
    /// Adaptive Runge-Kutta with located events: the Dormand-Prince pair of
    /// order 8(5,3), under the name of the family's pair of order 5.
    Dopri5,
    /// Fixed-step Runge-Kutta without event location: the paper's way.
    Rk4,
}

impl Case {
    /// `K_enc·K_dac·K_a`: what the amplifier gives for a radian of the motor with a gain
    /// of one code per count \[V/rad\].
    pub(crate) fn output_per_rad(&self) -> f64 {
        self.encoder.counts_per_rad * self.dac.step_v * self.amplifier.gain
    }

    /// `V_max` \[V\]; `None` of an ideal current loop, which it does not limit.
    pub fn voltage_limit_v(&self) -> Option<f64> {
        let is_ideal = matches!(
            self.amplifier.control,
            Control::Current {
                bandwidth_radps: None,
                ..
            }
        );
        (!is_ideal).then_some(self.amplifier.voltage_limit_v)
    }

    /// True if the joint has a gap, so that it can be open.
    pub fn has_gap(&self) -> bool {
        self.axis.transmission.joint.backlash_half_rad() > 0.0
    }

    /// What surrounds the axis.
    pub fn surroundings(&self) -> Surroundings {
        Surroundings {
            amplifier: self.amplifier,
            load_force_n: self.load_force_n,
            loads: self.loads.clone(),
            start: self.start,
        }
    }

    /// `β(0)`, where the motor encoder's zero is \[rad\].
    pub fn start_rad(&self) -> f64 {
        self.start.beta_rad(&self.axis.transmission)
    }

    /// Force of the loads on the carriage when the run ends \[N\].
    pub fn resting_force_n(&self) -> f64 {
        self.surroundings().force_at_n(self.run.duration_ns)
    }

    /// True if the motor's voltage is held from code to code: under a sampled law, unless
    /// the current is limited or controlled within the amplifier.
    pub fn holds_the_voltage(&self) -> bool {
        let makes_a_voltage = Control::Voltage {
            current_limit_a: None,
        };
        self.controller.law != Law::Continuous && self.amplifier.control == makes_a_voltage
    }

    /// The case of the second run: see [`MASS_CHANGE`].
    #[must_use]
    pub fn nudged(&self) -> Self {
        let mut case = self.clone();
        case.axis.carriage.mass_kg *= 1.0 + MASS_CHANGE;
        case
    }

    /// The law of rung `continuous` (eq. 27-37).
    pub fn continuous_pid(&self) -> ContinuousPid {
        ContinuousPid::new(
            self.controller.gains,
            self.encoder,
            self.dac,
            self.amplifier,
            &self.axis.transmission,
            self.motion.clone(),
        )
    }

    /// The solver of this case: the one that `run.solver` names, or for `auto` the
    /// exact solution where the plant is affine between events.
    pub fn solver(&self) -> Solver {
        let (tolerance, step_ns) = (self.run.tolerance, self.run.rk4_step_ns);
        match self.run.solver {
            SolverChoice::Auto if self.axis.is_affine() => Solver::Exact,
            SolverChoice::Exact => Solver::Exact,
            SolverChoice::Auto | SolverChoice::Dopri5 => Solver::Dopri5 { tolerance },
            SolverChoice::Rk4 => Solver::Rk4 { step_ns },
        }
    }
}

/// Duration, solver and what is recorded (`[run]`).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RunSettings {
    /// Simulated time \[ns\], greater than 0.
    pub duration_ns: u64,
    /// Method for the plant.
    pub solver: SolverChoice,
    /// Row interval of rung `continuous` \[ns\].
    pub row_interval_ns: u64,
    /// Step of solver `rk4` \[ns\].
    pub rk4_step_ns: u64,
    /// Error tolerance of solver `dopri5`.
    pub tolerance: f64,
    /// Half width of the settling band at the carriage \[µm\].
    pub settling_band_um: f64,
    /// Length of the window at the end of the run that the figures of rest are
    /// taken from \[ns\]; `None` for the second half of the rest.
    pub rest_window_ns: Option<u64>,
    /// List every contact change in the summary.
    pub events: bool,
    /// Work beyond the one step of a sample with which the run ends
    /// ([`plant::Extremes::work`]).
    pub work_limit: u64,
}

/// One entry of `[budget]`: the magnitude of a summary figure must not exceed it; of a
/// figure of which more is better it is the least value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Key of the summary figure, such as `final_error_um`.
    pub figure: &'static str,
    /// Largest allowed magnitude or least value, in the figure's own unit, at least 0.
    pub limit: f64,
}

impl Limit {
    /// A limit on the figure of that key.
    pub fn new(figure: &'static str, limit: f64) -> Self {
        Self { figure, limit }
    }

    /// True if it is a least value.
    pub fn is_least(&self) -> bool {
        figures::find(self.figure).is_some_and(|figure| figure.at_least)
    }
}
