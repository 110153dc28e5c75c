//! Random axes with random controllers: soft and stiff, loose and tight,
//! smooth and sticking, with loops that hold and loops that do not.
//!
//! Nothing here is drawn to be easy. Each range is as wide as the equations
//! stay meaningful; dependent quantities (gains, friction, damping, speeds)
//! are drawn relative to what the axis can do, since values drawn on their own
//! would almost always give a loop that does nothing or stands at its limit.

use core::f64::consts::PI;

use hil_core::case::{
    Case, ComputationDelay, ControllerSettings, Law, RunSettings, SolverChoice, TargetSettings,
};
use hil_core::controllers::{Controller, IoKind};
use hil_core::options::AxisOptions;
use plant::{
    Amplifier, AxisParameters, Carriage, Dac, ElasticJoint, Encoder, Joint, Motion, Motor,
    PidGains, Resistance, Start, Transmission,
};

use crate::draw::Draw;

/// Firmware words hold gains per sample below 2^11.
const LARGEST_GAIN_PER_SAMPLE: f64 = 2000.0;

/// Between which bounds the sample time is drawn \[s\].
pub const SAMPLE_TIMES_S: (f64, f64) = (1e-6, 20e-3);

/// Steps of the reference that a case may cost, about: stiff joints at long
/// samples get fewer samples.
const STEPS_PER_CASE: f64 = 1.5e5;

/// Steps of the reference per time constant of the axis, about.
const STEPS_PER_TIME_CONSTANT: f64 = 200.0;

/// Fewest and most samples of a case.
const SAMPLES: (f64, f64) = (12.0, 120.0);

/// A random case on one of `laws`: an axis, a controller and a motion, from
/// rest.
pub fn random_case(draw: &mut Draw, laws: &[Law], sample_times_s: (f64, f64)) -> Case {
    let axis = random_axis(draw);
    let voltage_limit_v = draw.decades(5.0, 300.0);
    let amplifier = Amplifier {
        gain: draw.decades(0.3, 30.0),
        voltage_limit_v,
        ..Amplifier::default()
    };
    let bits = draw.one_of(&[8, 10, 12, 14, 16, 20, 24]);
    // The converter's range is half to four times what the amplifier can use.
    let range_v = draw.decades(1.0, 8.0) * voltage_limit_v / amplifier.gain;
    let dac = Dac::with_range(bits, range_v);
    let encoder = Encoder {
        counts_per_rad: draw.decades(50.0, 1e5),
    };
    let sample_time_ns = nanoseconds(draw.decades(sample_times_s.0, sample_times_s.1));
    let samples = affordable_samples(&axis, sample_time_ns);
    let delay_ns = match draw.unit() {
        u if u < 0.3 => 0,
        u if u < 0.4 => sample_time_ns,
        _ => draw.whole(1, sample_time_ns),
    };
    let sample_time_s = sample_time_ns as f64 * 1e-9;
    let volts_per_count = amplifier.gain * dac.step_v;
    let duration_s = sample_time_s * samples as f64;
    let mut case = Case {
        name: "random".to_owned(),
        template: None,
        template_values: Vec::new(),
        axis,
        dac,
        amplifier,
        load_force_n: 0.0,
        loads: Vec::new(),
        start: Start::default(),
        encoder,
        controller: ControllerSettings {
            law: draw.one_of(laws),
            gains: random_gains(draw, &axis, encoder, volts_per_count, sample_time_s),
            cascade: None,
            sample_time_ns: Some(sample_time_ns),
            computation_delay: ComputationDelay::Fixed(delay_ns),
        },
        options: AxisOptions::default(),
        target: TargetSettings::default(),
        motion: random_motion(draw, &axis, voltage_limit_v, duration_s),
        run: RunSettings {
            duration_ns: sample_time_ns * samples,
            solver: SolverChoice::Auto,
            row_interval_ns: sample_time_ns,
            rk4_step_ns: 10_000,
            tolerance: 1e-11,
            settling_band_um: 100.0,
            rest_window_ns: None,
            events: true,
            work_limit: 20_000_000,
        },
        budget: None,
        keys_without_effect: Vec::new(),
    };
    if Controller::new(&case, IoKind::Direct).is_err() {
        // Gains that fit no word of the firmware.
        case.controller.law = Law::Quantised;
    }
    case
}

/// The fastest rate of an axis \[1/s\]: joint, its damping, or armature.
pub fn fastest_rate(axis: &AxisParameters) -> f64 {
    let (t, c, m) = (&axis.transmission, &axis.carriage, &axis.motor);
    let armature = m.resistance_ohm / m.inductance_h;
    let Joint::Elastic(joint) = t.joint else {
        return armature;
    };
    let p = t.screw_pitch_m_per_rad;
    let j1 = m.inertia_kg_m2 / (t.gear_ratio * t.gear_ratio);
    let j2 = t.screw_inertia_kg_m2 + c.mass_kg * p * p;
    let compliance = 1.0 / j1 + 1.0 / j2;
    let natural = (joint.stiffness_nm_per_rad * compliance).sqrt();
    let damping = joint.damping_nms_per_rad * compliance;
    armature.max(natural).max(damping)
}

fn affordable_samples(axis: &AxisParameters, sample_time_ns: u64) -> u64 {
    let time_constants = fastest_rate(axis) * sample_time_ns as f64 * 1e-9;
    let steps = 10.0 + STEPS_PER_TIME_CONSTANT * time_constants;
    (STEPS_PER_CASE / steps).clamp(SAMPLES.0, SAMPLES.1) as u64
}

/// An axis; its joint and friction over all that the paper's equations allow.
pub fn random_axis(draw: &mut Draw) -> AxisParameters {
    let motor = Motor {
        inertia_kg_m2: draw.decades(5e-5, 1e-3),
        torque_constant_nm_per_a: draw.decades(0.05, 1.0),
        resistance_ohm: draw.decades(0.3, 5.0),
        inductance_h: draw.decades(5e-4, 2e-2),
    };
    let gear_ratio = draw.decades(0.5, 3.0);
    let screw_inertia_kg_m2 = draw.decades(1e-4, 5e-3);
    let screw_pitch_m_per_rad = draw.decades(2e-4, 3e-3);
    let mass_kg = draw.decades(1.0, 300.0);
    let j1 = motor.inertia_kg_m2 / (gear_ratio * gear_ratio);
    let j2 = screw_inertia_kg_m2 + mass_kg * screw_pitch_m_per_rad * screw_pitch_m_per_rad;
    let joint = if draw.chance(0.1) {
        Joint::Rigid
    } else {
        Joint::Elastic(random_joint(draw, j1 * j2 / (j1 + j2)))
    };
    // What 24 V give at standstill, at the screw.
    let torque_nm = motor.torque_constant_nm_per_a * 24.0 / motor.resistance_ohm / gear_ratio;
    AxisParameters {
        motor,
        transmission: Transmission {
            gear_ratio,
            joint,
            screw_inertia_kg_m2,
            screw_pitch_m_per_rad,
        },
        carriage: Carriage {
            mass_kg,
            resistance: random_resistance(draw, torque_nm / screw_pitch_m_per_rad),
        },
    }
}

fn random_joint(draw: &mut Draw, reduced_inertia: f64) -> ElasticJoint {
    let stiffness_nm_per_rad = draw.decades(10.0, 1e6);
    let critical = 2.0 * (stiffness_nm_per_rad * reduced_inertia).sqrt();
    ElasticJoint {
        stiffness_nm_per_rad,
        damping_nms_per_rad: match draw.unit() {
            u if u < 0.25 => 0.0,
            _ => critical * draw.decades(1e-3, 2.0),
        },
        backlash_half_rad: match draw.unit() {
            u if u < 0.1 => 0.0,
            // Four in ten cases between 1e-4 rad and 10°, as real joints are.
            u if u < 0.5 => draw.decades(1e-4, PI / 18.0),
            _ => draw.decades(1e-15, PI / 18.0),
        },
        no_pull: draw.chance(0.35),
    }
}

/// `stall_n` is what the motor can do at the carriage.
fn random_resistance(draw: &mut Draw, stall_n: f64) -> Resistance {
    let opposes_motion = draw.chance(0.6);
    let constant_n = match draw.unit() {
        u if u < 0.25 => 0.0,
        _ if opposes_motion => stall_n * draw.decades(1e-3, 1.0),
        _ => draw.sign() * stall_n * draw.decades(1e-3, 0.3),
    };
    let linear_ns_per_rad = match draw.unit() {
        u if u < 0.5 => 0.0,
        // As much as the motor can do at 10 rad/s, or far less.
        _ => stall_n * draw.decades(1e-4, 0.1),
    };
    Resistance {
        constant_n,
        linear_ns_per_rad,
        quadratic_ns2_per_rad2: 0.0,
        opposes_motion,
    }
}

/// Gains by what the loop does with them: its crossover, and the derivative
/// and integral times. About one loop in three does not settle.
fn random_gains(
    draw: &mut Draw,
    axis: &AxisParameters,
    encoder: Encoder,
    volts_per_count: f64,
    sample_time_s: f64,
) -> PidGains {
    let crossover_per_s = draw.decades(3.0, 600.0).min(2.0 / sample_time_s);
    let volts_s_per_rad = axis.motor.torque_constant_nm_per_a;
    let kp = crossover_per_s * volts_s_per_rad / (volts_per_count * encoder.counts_per_rad);
    let kp = kp.min(LARGEST_GAIN_PER_SAMPLE);
    let ki_per_s = match draw.unit() {
        u if u < 0.3 => 0.0,
        _ => (kp * draw.decades(0.1, 50.0)).min(LARGEST_GAIN_PER_SAMPLE / sample_time_s),
    };
    let kd_s = match draw.unit() {
        u if u < 0.3 => 0.0,
        _ => (kp * draw.decades(1e-4, 0.03)).min(LARGEST_GAIN_PER_SAMPLE * sample_time_s),
    };
    PidGains { kp, ki_per_s, kd_s }
}

/// A motion within the run or a little longer, up to a speed that the motor
/// reaches or just not.
#[allow(clippy::panic, reason = "the ranges exclude whatever could be refused")]
fn random_motion(
    draw: &mut Draw,
    axis: &AxisParameters,
    voltage_limit_v: f64,
    duration_s: f64,
) -> Motion {
    let mut intervals_s = [0.0; 7];
    for interval_s in &mut intervals_s {
        if draw.chance(0.7) {
            *interval_s = draw.between(0.05, 1.0);
        }
    }
    // Something must accelerate, and something brake.
    intervals_s[draw.one_of(&[0, 1, 2])] = 0.5;
    intervals_s[draw.one_of(&[4, 5, 6])] = 0.5;
    let sum: f64 = intervals_s.iter().sum();
    let total_s = duration_s * draw.between(0.3, 1.2);
    let transmission = &axis.transmission;
    let top_mps = voltage_limit_v / axis.motor.torque_constant_nm_per_a
        * transmission.gear_ratio
        * transmission.screw_pitch_m_per_rad;
    let travel_m = draw.sign() * top_mps * total_s * draw.decades(0.01, 0.6);
    Motion::new(travel_m, intervals_s.map(|t| t / sum * total_s)).unwrap_or_else(|error| {
        panic!("{error}");
    })
}

fn nanoseconds(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}
