//! Law and axis in lockstep for programs that know nothing of `hil-runner`:
//! count, law, voltage held to the next sample. The setpoints are computed
//! once, before any clock starts.

use hil_core::case::{Case, Law};
use plant::{ContinuousPid, Drive, Plant, PlantError};

/// The part of a case that the sampled laws need.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    case: Case,
    /// Counts and codes are whole (law `quantised`), or real (`sampled`).
    whole: bool,
    period_ns: u64,
    period_s: f64,
    setpoints: Vec<f64>,
}

/// An axis that a lockstep can move.
pub trait Axis {
    /// Error of the solver.
    type Error;
    /// `β` now \[rad\].
    fn beta_rad(&self) -> f64;
    /// Moves on under a constant voltage.
    ///
    /// # Errors
    /// Whatever the solver reports.
    fn hold(&mut self, voltage_v: f64, until_ns: u64) -> Result<(), Self::Error>;
}

impl Plan {
    /// The plan of a case; `None` if it has no sample time.
    pub fn new(case: &Case) -> Option<Self> {
        let period_ns = case.controller.sample_time_ns?;
        let whole = case.controller.law != Law::Sampled;
        let transmission = &case.axis.transmission;
        let metres_per_rad = transmission.screw_pitch_m_per_rad * transmission.gear_ratio;
        let setpoints = (0..=case.run.duration_ns / period_ns).map(|tick| {
            let at_s = seconds(tick * period_ns);
            let alpha_rad = case.motion.at(at_s).displacement_m / metres_per_rad;
            match whole {
                true => case.encoder.setpoint_count(alpha_rad),
                false => case.encoder.position_counts(alpha_rad),
            }
        });
        Some(Self {
            whole,
            period_ns,
            period_s: seconds(period_ns),
            setpoints: setpoints.collect(),
            case: case.clone(),
        })
    }

    /// The case behind the plan.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// The sample time \[ns\].
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// The setpoint of every sample, the last one's voltage unused.
    pub fn setpoints(&self) -> &[f64] {
        &self.setpoints
    }

    /// One run from rest; `observe` gets sample, code and axis.
    ///
    /// # Errors
    /// Whatever the axis reports.
    // Takes the caller's instructions, with `floor` among them or not.
    #[inline(always)]
    pub fn run<A: Axis>(
        &self,
        axis: &mut A,
        mut observe: impl FnMut(u64, f64, &A),
    ) -> Result<(), A::Error> {
        let (case, gains) = (&self.case, &self.case.controller.gains);
        let (lowest, highest) = (
            f64::from(case.dac.code_min()),
            f64::from(case.dac.code_max()),
        );
        let (mut sum, mut previous) = (0.0, None);
        let mut time_ns = 0;
        for (tick, &setpoint) in (0..).zip(&self.setpoints) {
            let alpha_rad = axis.beta_rad() / case.axis.transmission.gear_ratio;
            let position = match self.whole {
                true => case.encoder.count(alpha_rad),
                false => case.encoder.position_counts(alpha_rad),
            };
            let e = setpoint - position;
            let e_prev = previous.replace(e).unwrap_or(e);
            sum += e * self.period_s;
            let y = ((gains.kp * e) + (gains.ki_per_s * sum))
                + ((gains.kd_s * (e - e_prev)) / self.period_s);
            let code = match self.whole {
                true => (y + 0.5).floor().clamp(lowest, highest),
                false => y,
            };
            observe(tick, code, axis);
            time_ns += self.period_ns;
            if time_ns > case.run.duration_ns {
                break;
            }
            axis.hold(case.amplifier.command(case.dac.output_v(code)), time_ns)?;
        }
        Ok(())
    }
}

/// The continuous law of a case, from row to row.
#[derive(Debug, Clone)]
pub struct ContinuousPlan {
    pid: ContinuousPid,
    rows: u64,
    row_ns: u64,
}

impl ContinuousPlan {
    /// The plan of a case; the rows are those of its output.
    pub fn new(case: &Case) -> Self {
        let row_ns = case.run.row_interval_ns;
        Self {
            pid: case.continuous_pid(),
            rows: case.run.duration_ns / row_ns,
            row_ns,
        }
    }

    /// One run from rest.
    ///
    /// # Errors
    /// Whatever the plant reports.
    pub fn run(&self, plant: &mut Plant) -> Result<(), PlantError> {
        let drive = Drive::Feedback(&self.pid);
        (1..=self.rows).try_for_each(|row| plant.advance(&drive, row * self.row_ns, &mut ()))
    }
}

/// The `plant` crate itself, without anything that watches it.
impl Axis for Plant {
    type Error = PlantError;

    fn beta_rad(&self) -> f64 {
        self.state().beta_rad
    }

    fn hold(&mut self, voltage_v: f64, until_ns: u64) -> Result<(), PlantError> {
        self.advance(&Drive::Held(voltage_v), until_ns, &mut ())
    }
}

/// Nanoseconds as seconds.
pub fn seconds(ns: u64) -> f64 {
    count(ns) / 1e9
}

/// A count as a float; exact below 2^53.
#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
pub fn count(n: u64) -> f64 {
    n as f64
}
