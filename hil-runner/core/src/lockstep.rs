//! Controller and plant in lockstep, figures and verdicts at the end.

use plant::{Contact, ContactChange, Drive, Plant, PlantError, Solver, State, Watch};

use crate::case::{Case, ComputationDelay};
use crate::chip_cost::{ChipReport, ExecutionFigures};
use crate::error::RunError;
use crate::io::IoKind;
use crate::message::{AxisStatus, Command, Link, Measurement, Steps};
use crate::number::seconds;
use crate::quantise::{FixedPointGains, QuantiseError};
use crate::record::{GridPoint, PlotPoint, PlotRecorder, Recorder};
use crate::summary::{EndOfCommand, EndOfRun, RowSums, Summary};
use crate::theory::Loops;
use crate::trace::{Row, Sample};

/// Choices of a run that change no figure: its electronics, and how much is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RunOptions {
    /// The way of the firmware to encoder and converter.
    pub io: IoKind,
    /// Keep the points for the report's curves.
    pub plot: bool,
    /// Keep the measurements of the first 100,000 samples, for the timing pass.
    pub inputs: bool,
    /// Interval of a common grid on which the carriage is kept \[ns\].
    pub grid_ns: Option<u64>,
}

/// Result of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Key figures and verdicts.
    pub summary: Summary,
    /// Points for curves, if asked for.
    pub plot: Vec<PlotPoint>,
    /// Contact changes, if the case lists them or a plot was asked for.
    pub contact_changes: Vec<ContactChange>,
    /// Contact at the end.
    pub final_contact: Contact,
    /// The controller's gains in fixed point; `None` where it computes in real
    /// numbers.
    pub gains: Option<FixedPointGains>,
    /// The measurements that the controller got, if asked for.
    pub inputs: Vec<Measurement>,
    /// The carriage on the common grid, if asked for.
    pub grid: Vec<GridPoint>,
    /// Samples at which the firmware worked outside its declared ranges.
    pub out_of_range_samples: u64,
    /// Requests that the axis' state refused.
    pub refused_requests: u32,
}

/// Inputs that a run keeps at most: enough for percentiles of the step time,
/// and no more memory for a longer run.
const MOST_INPUTS: usize = 100_000;

/// Receiver of the rows of a run, one call a row.
pub type RowSink<'a> = dyn FnMut(&Row) -> std::io::Result<()> + Send + 'a;

/// Runs a case with whatever controller is at the end of `link`. Where the
/// delay is measured, the link tells it with each command.
///
/// # Errors
/// As [`crate::run::run`]; [`QuantiseError::NoSampleTime`] for a rung that does not
/// sample.
pub fn run_over(
    case: &Case,
    options: RunOptions,
    link: &mut impl Link,
    sink: &mut RowSink<'_>,
) -> Result<Outcome, RunError> {
    run_among(case, options, Some(link), &mut Loops::default(), sink)
}

/// The same among runs whose loops are known; without a link rung `continuous`, which has
/// no samples: a row every row interval.
///
/// # Errors
/// As [`run_over`].
pub(crate) fn run_among(
    case: &Case,
    options: RunOptions,
    link: Option<&mut impl Link>,
    loops: &mut Loops,
    sink: &mut RowSink<'_>,
) -> Result<Outcome, RunError> {
    let mut lockstep = Lockstep::new(case, options, sink);
    let Some(link) = link else {
        lockstep.continuous()?;
        return Ok(lockstep.outcome(None, loops));
    };
    let period_ns = case.controller.sample_time_ns;
    let period_ns = period_ns.ok_or(QuantiseError::NoSampleTime)?;
    lockstep.sampled(link, period_ns)?;
    let execution = std::mem::take(&mut lockstep.execution);
    lockstep.chip = link.cost(execution, period_ns)?;
    Ok(lockstep.outcome(link.gains(), loops))
}

/// A run in progress.
struct Lockstep<'a, 's> {
    case: &'a Case,
    solver: &'static str,
    plant: Plant,
    recorder: Recorder,
    rows: RowSums,
    inputs: Option<Vec<Measurement>>,
    /// Time under a held command at its limit, of the voltage and of the current.
    held_limit_ns: [u64; 2],
    /// Rows show what is just after their instant.
    looks_ahead: bool,
    out_of_range_samples: u64,
    /// The last report of the axis.
    axis: Option<AxisStatus>,
    /// Execution times of a chip's steps.
    execution: ExecutionFigures,
    chip: Option<ChipReport>,
    sink: &'a mut RowSink<'s>,
}

impl<'a, 's> Lockstep<'a, 's> {
    fn new(case: &'a Case, options: RunOptions, sink: &'a mut RowSink<'s>) -> Self {
        let (solver, surroundings) = (case.solver(), case.surroundings());
        Self {
            case,
            solver: match solver {
                Solver::Exact => "exact",
                Solver::Dopri5 { .. } => "dopri5",
                Solver::Rk4 { .. } => "rk4",
            },
            plant: Plant::within(&case.axis, &surroundings, solver),
            recorder: Recorder::new(case, options.plot, options.grid_ns),
            rows: RowSums::new(case),
            inputs: options.inputs.then(Vec::new),
            held_limit_ns: [0; 2],
            looks_ahead: !surroundings.is_papers(),
            out_of_range_samples: 0,
            axis: None,
            execution: ExecutionFigures::default(),
            chip: None,
            sink,
        }
    }

    /// Rung `continuous`: no samples, a row every row interval.
    fn continuous(&mut self) -> Result<(), RunError> {
        let case = self.case;
        let pid = case.continuous_pid();
        let drive = Drive::Feedback(&pid);
        let (interval_ns, duration_ns) = (case.run.row_interval_ns, case.run.duration_ns);
        let mut time_ns = 0;
        while time_ns <= duration_ns {
            let voltage_v = self.plant.voltage_v(&drive);
            self.row(time_ns, None, None, (voltage_v, drive))?;
            time_ns += interval_ns;
            self.advance(&drive, time_ns.min(duration_ns))?;
        }
        Ok(())
    }

    /// Advances the plant, as long as the run's work allows.
    fn advance(&mut self, drive: &Drive<'_>, until_ns: u64) -> Result<(), RunError> {
        let advanced = self.plant.advance(drive, until_ns, &mut self.recorder);
        let time_s = match advanced {
            Err(PlantError::OutOfWork { time_s }) => time_s,
            Err(error) => return Err(error.into()),
            // A step whose extremes took too much.
            Ok(()) if !self.recorder.work(0) => seconds(self.plant.time_ns()),
            Ok(()) => return Ok(()),
        };
        Err(RunError::OutOfWork {
            time_s,
            duration_s: seconds(self.case.run.duration_ns),
            work: self.recorder.extremes.work,
            limit: self.case.run.work_limit,
        })
    }

    /// Sampled rungs. At t_k the controller gets the encoder's position; its
    /// code acts from t_k + delay to t_(k+1) + delay, each delay that of its
    /// own sample and at most Δt.
    fn sampled(&mut self, link: &mut impl Link, period_ns: u64) -> Result<(), RunError> {
        let case = self.case;
        let duration_ns = case.run.duration_ns;
        let mut in_force = Held::default();
        for tick in 0.. {
            let time_ns = tick * period_ns;
            if time_ns > duration_ns {
                break;
            }
            // 1. Sample.
            let measurement = Measurement::new(case, tick, &self.plant.state());
            // 2. Compute.
            let command = link.exchange(measurement)?;
            if link.is_done() {
                break;
            }
            if let Some(inputs) = &mut self.inputs
                && inputs.len() < MOST_INPUTS
            {
                inputs.push(measurement);
            }
            self.out_of_range_samples += u64::from(command.out_of_range);
            self.axis = command.axis.or(self.axis);
            if let Some(execution) = command.execution {
                let state = command.axis.map(|axis| axis.state);
                self.execution.add(execution, state, period_ns);
            }
            let next = self.held(command);
            let delay_ns = match (case.controller.computation_delay, command.execution) {
                (ComputationDelay::Fixed(ns), _) => ns,
                // Later than this is a deadline miss; the plant takes the next code then.
                (ComputationDelay::Measured, Some(execution)) => execution.time_ns.min(period_ns),
                // A tick that was missed computes nothing: the code stays.
                (ComputationDelay::Measured, None) if next == in_force => 0,
                (ComputationDelay::Measured, None) => {
                    return Err(RunError::Quantise(QuantiseError::DelayUnknown));
                }
            };
            // 3. Record.
            let sample = Sample {
                error_counts: command.error_counts.real(),
                dac_code: next.dac_code,
                axis_state: command.axis.map(|axis| axis.state),
            };
            let count = measurement.position_counts.real();
            let acting = if delay_ns == 0 { next } else { in_force };
            let drive = Drive::Held(acting.command);
            self.row(time_ns, Some(sample), Some(count), (next.command, drive))?;
            // 4. Move: first under the code still in force, then under the new.
            self.hold(in_force, (time_ns + delay_ns).min(duration_ns))?;
            in_force = next;
            self.hold(in_force, (time_ns + period_ns).min(duration_ns))?;
        }
        Ok(())
    }

    /// The command that a code gives.
    fn held(&self, command: Command) -> Held {
        let (dac, amplifier) = (&self.case.dac, &self.case.amplifier);
        let dac_code = command.dac_code.real();
        let input_v = dac.output_v(dac_code);
        let code_limited = match command.dac_code {
            Steps::Real(_) => false,
            Steps::Whole(code) => {
                code <= i64::from(dac.code_min()) || code >= i64::from(dac.code_max())
            }
        };
        let at_limit = amplifier.is_limited(input_v);
        // With a limit of the current the plant knows what the motor has.
        let of_voltage = amplifier.current_limit_a().is_none();
        Held {
            command: amplifier.command(input_v),
            dac_code,
            limited: [
                code_limited || of_voltage && at_limit,
                amplifier.is_current_drive() && at_limit,
            ],
        }
    }

    /// Advances the plant under a held command.
    fn hold(&mut self, held: Held, until_ns: u64) -> Result<(), RunError> {
        let length_ns = until_ns.saturating_sub(self.plant.time_ns());
        for (sum_ns, limited) in self.held_limit_ns.iter_mut().zip(held.limited) {
            *sum_ns += if limited { length_ns } else { 0 };
        }
        if let Some(plot) = &mut self.recorder.plot {
            plot.dac_code = Some(held.dac_code);
        }
        let known_s = self.recorder.extremes.voltage_limited_s;
        let advanced = self.advance(&Drive::Held(held.command), until_ns);
        if held.limited[0] {
            // That time has been counted as a whole.
            self.recorder.extremes.voltage_limited_s = known_s;
        }
        advanced
    }

    /// Records the row of `time_ns`, the plant standing there, with the count that
    /// its sample was computed from. `voltage_v` is that of the code, `drive` the one from
    /// now on.
    fn row(
        &mut self,
        time_ns: u64,
        sample: Option<Sample>,
        count: Option<f64>,
        (voltage_v, drive): (f64, Drive<'_>),
    ) -> Result<(), RunError> {
        let t_s = seconds(time_ns);
        let pitch = self.case.axis.transmission.screw_pitch_m_per_rad;
        let command = self.case.motion.at(t_s);
        let state: State = self.plant.state();
        let mut row = Row {
            t_s,
            x_ref_m: command.displacement_m,
            acc_ref_mps2: command.acceleration_mps2,
            sample,
            motor_voltage_v: voltage_v,
            current_a: state.current_a,
            beta_rad: state.beta_rad,
            beta_dot_radps: state.beta_dot_radps,
            gamma_rad: state.gamma_rad(),
            gamma_dot_radps: state.gamma_dot_radps(),
            acc_mps2: self.plant.acceleration_mps2(),
            contact: self.plant.contact().sign(),
            x_m: pitch * state.gamma_rad(),
            v_mps: pitch * state.gamma_dot_radps(),
            v_ref_mps: command.velocity_mps,
        };
        if self.looks_ahead {
            let after = self.plant.just_after(&drive);
            row.acc_mps2 = after.acceleration_mps2;
            row.contact = after.contact.sign();
            if self.case.amplifier.current_limit_a().is_some() {
                (row.motor_voltage_v, row.current_a) = (after.voltage_v, after.current_a);
            }
        }
        self.rows.add(&row, count);
        (self.sink)(&row).map_err(RunError::Row)
    }

    fn outcome(mut self, gains: Option<FixedPointGains>, loops: &mut Loops) -> Outcome {
        if let Some(grid) = &mut self.recorder.grid {
            grid.finish(self.case.run.duration_ns, &self.plant);
        }
        let events = self.recorder.events.unwrap_or_default();
        let command = EndOfCommand::of(&self.case.motion, self.case.run.duration_ns);
        let summary = EndOfRun {
            case: self.case,
            command,
            solver: self.solver,
            state: self.plant.state(),
            extremes: &self.recorder.extremes,
            rows: &self.rows.figures(&command),
            held_limit_ns: self.held_limit_ns,
            events: Some(&events),
            axis: self.axis,
            chip: self.chip,
            loops: loops.figures(self.case),
        }
        .summary();
        let plot = self.recorder.plot.map(PlotRecorder::finish);
        Outcome {
            summary,
            plot: plot.unwrap_or_default(),
            contact_changes: events,
            final_contact: self.plant.contact(),
            gains,
            inputs: self.inputs.unwrap_or_default(),
            grid: self.recorder.grid.map_or_else(Vec::new, |grid| grid.points),
            out_of_range_samples: self.out_of_range_samples,
            refused_requests: self.axis.map_or(0, |axis| axis.refused_requests),
        }
    }
}

/// A code and the command it gives, volts or amperes; 0 before the first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Held {
    command: f64,
    dac_code: f64,
    /// The code or the voltage stands at its limit, and the commanded current.
    limited: [bool; 2],
}
