//! The gap of a run: how the reference crosses it, within the room that the motion
//! leaves, and its width, which the firmware's own routine finds before the move, on
//! the same axis, at rest.

use firmware::axis::{Axis, AxisState, Inputs};
use firmware::backlash_measurement::{BacklashMeasurementRun, RATIO_MAX};
use firmware::law::Law as AxisLaw;
use firmware::refusal::What;
use firmware::{
    BacklashCompensation, BacklashMeasurement, Creep, Detection, Room, State, Trigger, counts,
};

use super::setup::{Setup, started};
use crate::case::{Case, Law};
use crate::lockstep::{RunOptions, run_over};
use crate::message::{Command, Link, LinkError, Measurement};
use crate::number::seconds;
use crate::options::{Compensation, Feedback, FlankDetection, GapSource};
use crate::quantise::QuantiseError;

/// The axis of a run: where the case asks for a compensation by a measured gap, the
/// gap is measured here.
///
/// # Errors
/// [`QuantiseError`] if a setting has no fixed-point form, or the gap cannot be
/// measured or crossed.
pub fn compensated(setup: &Setup<'_>, law: AxisLaw) -> Result<Axis, QuantiseError> {
    let mut axis = setup.axis(law)?;
    axis.backlash_compensation = compensation(setup)?;
    Ok(axis)
}

/// The crossing of the gap, within what the motion leaves of the limits.
fn compensation(setup: &Setup<'_>) -> Result<Option<BacklashCompensation>, QuantiseError> {
    let (case, setpoint) = (setup.case, &setup.setpoint);
    let backlash = &case.options.backlash;
    let trigger = match backlash.compensation {
        Compensation::None => return Ok(None),
        Compensation::Velocity => Trigger::Velocity,
        Compensation::Acceleration => Trigger::Acceleration,
    };
    let half_gap_counts = match backlash.gap {
        // Saturates; a gap that large is refused by the plan.
        GapSource::Given => setup.half_gap_counts(backlash.half_gap_rad).round() as u32,
        GapSource::Measured => measure_gap(case)?.half_counts,
    };
    let limits = &case.options.limits;
    let motion = &case.motion;
    let peak_mps = setpoint.peak_mps();
    let peak_mps2 = motion.peak_acceleration_until_mps2(motion.end_s());
    let dt_s = setup.period_ns as f64 / 1e9;
    let of_velocity = ("limits.velocity_mps", limits.velocity_mps.unwrap_or(0.0));
    let acceleration_mps2 = limits.acceleration_mps2.unwrap_or(0.0);
    let of_acceleration = ("limits.acceleration_mps2", acceleration_mps2);
    let room = |(key, limit): (_, f64), unit: &str, peak: f64, per_sample: f64| {
        let left = (limit - peak) * setpoint.counts_per_m() * per_sample;
        let room = (left * 4_294_967_296.0).floor();
        if room < 1.0 {
            let because = format!(
                "the motion's own peak is {peak:.6} {unit}; the backlash compensation needs room above it"
            );
            return Err(QuantiseError::setting(key, limit, because));
        }
        // Saturates: more room than any axis needs.
        Ok(room as u64)
    };
    let room = Room {
        velocity: room(of_velocity, "m/s", peak_mps, dt_s)?,
        acceleration: room(of_acceleration, "m/s²", peak_mps2, dt_s * dt_s)?,
    };
    let half_rad = f64::from(half_gap_counts) * case.axis.transmission.gear_ratio
        / case.encoder.counts_per_rad;
    let refused = QuantiseError::of("backlash.half_gap_deg", half_rad.to_degrees());
    let crossing = BacklashCompensation::plan(half_gap_counts, room, trigger).map_err(refused)?;
    let longest = setpoint.last_tick();
    if u64::from(crossing.samples()) > longest {
        let samples = crossing.samples();
        // The limit that is to blame is the one without which it would fit.
        let faster = Room {
            velocity: u64::MAX,
            ..room
        };
        let fits = |crossing: BacklashCompensation| u64::from(crossing.samples()) <= longest;
        let by_velocity =
            BacklashCompensation::plan(half_gap_counts, faster, trigger).is_ok_and(fits);
        let (key, limit) = match by_velocity {
            true => of_velocity,
            false => of_acceleration,
        };
        let because = format!(
            "it leaves the backlash compensation so little room that it needs {samples} samples, longer than the \
                 motion with its {longest}"
        );
        return Err(QuantiseError::setting(key, limit, because));
    }
    Ok(Some(crossing))
}

/// Samples that the effort must last to count as the load's.
const EFFORT_SAMPLES: u32 = 5;

/// Rest between two legs \[s\].
const PAUSE_S: f64 = 0.2;

/// The load must follow within this many true gaps and this many counts.
const LONGEST_GAPS: f64 = 4.0;

/// See [`LONGEST_GAPS`].
const LONGEST_COUNTS: f64 = 2_000.0;

/// Longest simulated time of the routine \[s\].
const LONGEST_S: u64 = 120;

/// The gap as the routine found it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapMeasurement {
    /// Half gap \[motor counts\].
    pub half_counts: u32,
    /// The whole gap at each of the three crossings \[motor counts\].
    pub full_counts: [i64; 3],
    /// Half gap of the simulated joint \[motor counts\].
    pub true_half_counts: f64,
    /// Simulated time that it took \[s\].
    pub duration_s: f64,
}

/// Creeps until the load follows, both ways, twice.
///
/// # Errors
/// [`QuantiseError::Bench`] if the load never follows, the measurements
/// disagree, or the axis stops on a fault; [`QuantiseError::DelayUnknown`] if
/// the delay is to be measured on a chip; else as for a run.
pub fn measure_gap(case: &Case) -> Result<GapMeasurement, QuantiseError> {
    let period_ns = case.controller.sample_time_ns;
    let period_ns = period_ns.ok_or(QuantiseError::NoSampleTime)?;
    if case.controller.computation_delay.fixed_ns().is_none() {
        return Err(QuantiseError::DelayUnknown);
    }
    // The motor creeps; the load is only looked at.
    let mut case = case.clone();
    case.options.law.feedback = Feedback::Motor;
    // The routine is the firmware's, whatever rung is asked for: it has an encoder.
    case.controller.law = Law::Firmware;
    // The last sample is the last before that time.
    case.run.duration_ns = (LONGEST_S * 1_000_000_000).saturating_sub(period_ns);
    case.run.events = false;
    case.run.rest_window_ns = None;
    let setup = Setup::of(&case, period_ns)?;
    let mut axis = setup.axis(setup.law()?.law)?;
    // The routine has reasons of its own to push against a load.
    axis.monitors.saturation = None;
    let true_half_counts = setup.half_gap_counts(None);
    let mut creeping = Creeping {
        state: started(&axis),
        run: routine(&setup, true_half_counts)?.start(0),
        ended: None,
    };

    let failed =
        |because: String| QuantiseError::Bench(format!("the backlash measurement {because}"));
    let stopped = |because: &dyn std::fmt::Display| failed(format!("stopped: {because}"));
    let options = RunOptions::default();
    run_over(&case, options, &mut creeping, &mut |_| Ok(())).map_err(|error| stopped(&error))?;
    if let Some(fault) = creeping.state.fault() {
        return Err(stopped(fault));
    }
    let Some(ended) = creeping.ended else {
        return Err(failed(format!(
            "did not end within {LONGEST_S} s; a higher \
             backlash.backlash_measurement_speed_counts_per_s is quicker"
        )));
    };
    match creeping.run.result() {
        Some(Ok(found)) => Ok(GapMeasurement {
            half_counts: found.half_counts,
            full_counts: found.full_counts,
            true_half_counts,
            duration_s: seconds(ended * period_ns),
        }),
        Some(Err(error)) => Err(failed(format!("failed: {error}"))),
        None => Err(failed("ended without a result".to_owned())),
    }
}

/// The axis that creeps, with its memory.
struct Creeping {
    state: AxisState,
    run: BacklashMeasurementRun,
    /// The sample at which the routine had ended, or the axis had stopped.
    ended: Option<u64>,
}

impl Link for Creeping {
    fn exchange(&mut self, measurement: Measurement) -> Result<Command, LinkError> {
        let tick = measurement.tick;
        let register = |counts| counts::wrap(counts).cast_unsigned();
        let inputs = Inputs {
            tick,
            motor_register: register(measurement.position_counts.whole()),
            load_register: measurement.load_counts.map(register),
            ..Inputs::default()
        };
        let output = self.state.tick(&inputs, &mut self.run);
        self.ended = (output.state != State::Moving).then_some(tick);
        Ok(Command::whole(tick, output.error_counts, output.code))
    }

    fn is_done(&self) -> bool {
        self.ended.is_some()
    }
}

/// The routine with the settings of the case.
fn routine(setup: &Setup<'_>, true_half_counts: f64) -> Result<BacklashMeasurement, QuantiseError> {
    let (case, period_ns) = (setup.case, setup.period_ns);
    let dt_s = period_ns as f64 / 1e9;
    let backlash = &case.options.backlash;
    let counts_per_s = backlash.backlash_measurement_speed_counts_per_s;
    let speed = (counts_per_s * dt_s * 65_536.0).round();
    let longest = (LONGEST_GAPS * 2.0 * true_half_counts + LONGEST_COUNTS).round();
    let creep = Creep {
        // Saturates; what is too fast is refused.
        speed: speed as u32,
        longest_counts: longest as u32,
        pause_samples: (PAUSE_S / dt_s).ceil() as u32,
        // A sample of creep and two counts of reading, at either end.
        tolerance_counts: (4.0 + 2.0 * speed / 65_536.0).ceil() as u32,
    };
    let load = case.options.encoders.load;
    let detection = match (backlash.backlash_measurement_detection, load) {
        (FlankDetection::LoadEncoder, Some(load)) => Detection::LoadEncoder {
            counts: 2,
            ratio: ratio(setup.motor_counts_per_load_count(load))?,
        },
        (FlankDetection::LoadEncoder, None) => {
            let because = "backlash.backlash_measurement_detection = \"load-encoder\" needs load_encoder.counts_per_rad or \
                           load_encoder.counts_per_mm; \"effort\" does without";
            return Err(QuantiseError::Bench(because.to_owned()));
        }
        (FlankDetection::Effort, _) => Detection::Effort {
            codes: backlash.backlash_measurement_effort_codes,
            samples: EFFORT_SAMPLES,
        },
    };
    BacklashMeasurement::accept(creep, detection).map_err(|error| {
        let key = "backlash.backlash_measurement_speed_counts_per_s";
        let (slowest, fastest) = (1.0 / (65_536.0 * dt_s), 256.0 / dt_s);
        let because = match error.what {
            What::CreepSpeed => {
                format!("at this sample time it must be from {slowest:.3} to {fastest} counts/s")
            }
            _ => error.to_string(),
        };
        QuantiseError::setting(key, counts_per_s, because)
    })
}

/// `ρ` in 2^−16, where these resolve it to 1 %.
fn ratio(motor_counts_per_load_count: f64) -> Result<u32, QuantiseError> {
    let ratio = (motor_counts_per_load_count * 65_536.0).round();
    if (50.0..=f64::from(RATIO_MAX)).contains(&ratio) {
        // Whole and within the type: the conversion is exact.
        return Ok(ratio as u32);
    }
    Err(QuantiseError::Bench(format!(
        "a load encoder with {motor_counts_per_load_count:.3e} motor counts to a count cannot measure \
         the gap; it must have from 7.6e-4 to 4096 of them, or use \
         backlash.backlash_measurement_detection = \"effort\""
    )))
}
