//! Measuring the gap of the simulated joint with the firmware's own routine:
//! before the move, on the same axis, at rest.

use firmware::axis::{Axis, AxisState, Inputs};
use firmware::backlash_measurement::RATIO_MAX;
use firmware::refusal::What;
use firmware::{
    BacklashMeasurement, BacklashMeasurementError, Creep, Detection, Event, Gap, State, counts,
};
use plant::{ContactChange, Drive, Plant, Span, Watch};

use super::setup::{Setup, setting};
use crate::case::Case;
use crate::law::whole;
use crate::quantise::QuantiseError;
use crate::servo::{Feedback, HomingDetection};
use crate::time::seconds;

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

/// What the routine found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapMeasurement {
    /// Half gap \[motor counts\].
    pub half_counts: u32,
    /// The whole gap at each of the three crossings \[motor counts\].
    pub full_counts: [i64; 3],
    /// Half gap of the simulated joint \[motor counts\].
    pub true_half_counts: f64,
    /// How long it took \[s\].
    pub duration_s: f64,
}

/// Sees nothing: the routine has only what the axis has.
struct Nobody;

impl Watch for Nobody {
    fn span(&mut self, _: &Span<'_>) {}

    fn contact_change(&mut self, _: &ContactChange) {}
}

/// Creeps until the load follows, both ways, twice.
///
/// # Errors
/// [`QuantiseError::Gap`] if the load never follows, the measurements
/// disagree, or the axis stops on a fault; [`QuantiseError::DelayUnknown`] if
/// the delay is to be measured on a chip; else as for a run.
pub fn measure_gap(case: &Case) -> Result<GapMeasurement, QuantiseError> {
    let period_ns = case.controller.sample_time_ns;
    let period_ns = period_ns.ok_or(QuantiseError::NoSampleTime)?;
    let delay_ns = case.controller.computation_delay.fixed_ns();
    let delay_ns = delay_ns.ok_or(QuantiseError::DelayUnknown)?;
    // The motor creeps; the load is only looked at.
    let mut case = case.clone();
    case.servo.law.feedback = Feedback::Motor;
    let case = &case;
    let setup = Setup::of(case, period_ns)?;
    let mut axis = setup.axis_without_take_up(setup.words()?.law)?;
    // The routine has reasons of its own to push against a load.
    axis.monitors.saturation = None;
    let true_half_counts = setup.half_gap_counts(None);
    let homing = homing(case, &setup, period_ns, true_half_counts)?;
    let (found, duration_s) = creep(case, &axis, &homing, (period_ns, delay_ns))?;
    match found {
        Some(Ok(gap)) => Ok(GapMeasurement {
            half_counts: gap.half_counts,
            full_counts: gap.full_counts,
            true_half_counts,
            duration_s,
        }),
        Some(Err(error)) => Err(QuantiseError::Gap(format!("homing failed: {error}"))),
        None => Err(QuantiseError::Gap(
            "homing ended without a result".to_owned(),
        )),
    }
}

/// The routine with the settings of the case.
fn homing(
    case: &Case,
    setup: &Setup<'_>,
    period_ns: u64,
    true_half_counts: f64,
) -> Result<BacklashMeasurement, QuantiseError> {
    let dt_s = period_ns as f64 / 1e9;
    let backlash = &case.servo.backlash;
    let speed = (backlash.homing_speed_counts_per_s * dt_s * 65_536.0).round();
    let longest = (LONGEST_GAPS * 2.0 * true_half_counts + LONGEST_COUNTS).round();
    let creep = Creep {
        // Saturates; what is too fast is refused.
        speed: speed as u32,
        longest_counts: longest as u32,
        pause_samples: (PAUSE_S / dt_s).ceil() as u32,
        // A sample of creep and two counts of reading, at either end.
        tolerance_counts: (4.0 + 2.0 * speed / 65_536.0).ceil() as u32,
    };
    let load = case.servo.encoders.load;
    let detection = match (backlash.homing_detection, load) {
        (HomingDetection::LoadEncoder, Some(load)) => Detection::LoadEncoder {
            counts: 2,
            ratio: ratio(setup.motor_counts_per_load_count(load))?,
        },
        (HomingDetection::LoadEncoder, None) => {
            return Err(QuantiseError::Gap(
                "backlash.homing_detection = \"load-encoder\" needs load_encoder.counts_per_rad or \
                 load_encoder.counts_per_mm; \"effort\" does without"
                    .to_owned(),
            ));
        }
        (HomingDetection::Effort, _) => Detection::Effort {
            codes: backlash.homing_effort_codes,
            samples: EFFORT_SAMPLES,
        },
    };
    BacklashMeasurement::accept(creep, detection).map_err(|error| {
        let key = "backlash.homing_speed_counts_per_s";
        let (slowest, fastest) = (1.0 / (65_536.0 * dt_s), 256.0 / dt_s);
        let because = match error.what {
            What::CreepSpeed => {
                format!("at this sample time it must be from {slowest:.3} to {fastest} counts/s")
            }
            _ => error.to_string(),
        };
        setting(key, backlash.homing_speed_counts_per_s, &because)
    })
}

/// Runs axis and plant until the routine has ended; what it found, and when
/// \[s\].
fn creep(
    case: &Case,
    axis: &Axis,
    homing: &BacklashMeasurement,
    (period_ns, delay_ns): (u64, u64),
) -> Result<(Option<Result<Gap, BacklashMeasurementError>>, f64), QuantiseError> {
    let z = case.axis.transmission.gear_ratio;
    let load = case.servo.encoders.load;

    let solver = crate::run::solver(case).0;
    let mut plant = Plant::new(&case.axis, solver);
    let mut state = AxisState::start(axis);
    for event in [Event::Enable, Event::Start] {
        // From rest: the table has no refusal here.
        let _ = axis.request(&mut state, event);
    }
    let mut run = homing.start(0);
    let mut code = 0;
    for tick in 0..LONGEST_S * 1_000_000_000 / period_ns {
        let at = plant.state();
        let register = |angle_rad: f64, encoder: plant::Encoder| {
            counts::wrap(whole(encoder.count(angle_rad))).cast_unsigned()
        };
        let inputs = Inputs {
            tick,
            motor_register: register(at.beta_rad / z, case.encoder),
            load_register: load.map(|load| register(at.gamma_rad(), load)),
            ..Inputs::default()
        };
        let output = axis.tick(&mut state, &inputs, &mut run);
        if let Some(fault) = state.fault() {
            return Err(QuantiseError::Gap(format!("homing stopped: {fault}")));
        }
        if output.state != State::Moving {
            return Ok((run.result(), seconds(tick * period_ns)));
        }
        // As in a run: first under the code still in force, then the new one.
        let start_ns = tick * period_ns;
        let delayed_ns = start_ns + delay_ns;
        for (code, until_ns) in [(code, delayed_ns), (output.code, start_ns + period_ns)] {
            let input_v = case.dac.output_v(f64::from(code));
            let drive = Drive::Held(case.amplifier.output_v(input_v));
            plant
                .advance(&drive, until_ns, &mut Nobody)
                .map_err(|error| QuantiseError::Gap(format!("homing stopped: {error}")))?;
        }
        code = output.code;
    }
    Err(QuantiseError::Gap(format!(
        "homing did not end within {LONGEST_S} s; a higher backlash.homing_speed_counts_per_s is quicker"
    )))
}

/// `ρ` in 2^−16, where these resolve it to 1 %.
fn ratio(motor_counts_per_load_count: f64) -> Result<u32, QuantiseError> {
    let ratio = (motor_counts_per_load_count * 65_536.0).round();
    if (50.0..=f64::from(RATIO_MAX)).contains(&ratio) {
        // Whole and within the type: the conversion is exact.
        return Ok(ratio as u32);
    }
    Err(QuantiseError::Gap(format!(
        "a load encoder with {motor_counts_per_load_count:.3e} motor counts to a count cannot measure \
         the gap; it must have from 7.6e-4 to 4096 of them, or use \
         backlash.homing_detection = \"effort\""
    )))
}
