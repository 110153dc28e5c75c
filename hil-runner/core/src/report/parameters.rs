//! The settings of a case as a report shows them beside the results.

use plant::{Joint, Solver};

use super::Parameter;
use super::parameters_options;
use crate::case::{Case, ComputationDelay, Law};
use crate::number;
use crate::quantise::FixedPointGains;
use crate::time::seconds;

pub(crate) fn text(label: &str, value: &str, unit: &str) -> Parameter {
    Parameter {
        label: label.to_owned(),
        value: value.to_owned(),
        unit: unit.to_owned(),
    }
}

pub(crate) fn value(label: &str, value: f64, unit: &str) -> Parameter {
    text(label, &number::table(value), unit)
}

/// Everything that a run file can say, less what the rung does not use.
pub(crate) fn of(case: &Case) -> Vec<Parameter> {
    [
        controller(case),
        parameters_options::of(case),
        motion(case),
        drive(case),
        joint(case),
        mechanics(case),
        run(case),
    ]
    .concat()
}

fn controller(case: &Case) -> Vec<Parameter> {
    let gains = &case.controller.gains;
    let mut rows = vec![
        value("Gain Kp", gains.kp, "codes/count"),
        value("Gain Ki", gains.ki_per_s, "codes/(count·s)"),
        value("Gain Kd", gains.kd_s, "codes·s/count"),
    ];
    if let (Some(period_ns), true) = (
        case.controller.sample_time_ns,
        case.controller.law != Law::Continuous,
    ) {
        rows.push(value("Sample time Δt", 1e3 * seconds(period_ns), "ms"));
        rows.push(match case.controller.computation_delay {
            ComputationDelay::Fixed(ns) => value("Computation delay", 1e3 * seconds(ns), "ms"),
            ComputationDelay::Measured => text("Computation delay", "measured on the chip", ""),
        });
    }
    rows
}

fn motion(case: &Case) -> Vec<Parameter> {
    let intervals = case.motion.intervals_s().map(number::table).join(", ");
    vec![
        value("Travel h", 1e3 * case.motion.travel_m(), "mm"),
        text("Intervals t1 … t7", &intervals, "s"),
        value("Motion time", case.motion.end_s(), "s"),
    ]
}

fn drive(case: &Case) -> Vec<Parameter> {
    let motor = &case.axis.motor;
    let mut rows = vec![value(
        "Encoder K_enc",
        case.encoder.counts_per_rad,
        "counts/rad",
    )];
    if case.controller.law >= Law::Quantised {
        rows.push(value("DAC bits n", f64::from(case.dac.bits), ""));
    }
    rows.extend([
        value("DAC step K_dac", 1e3 * case.dac.step_v, "mV"),
        value("Amplifier gain K_a", case.amplifier.gain, ""),
        value("Amplifier limit V_max", case.amplifier.voltage_limit_v, "V"),
        value("Rotor inertia J_m", motor.inertia_kg_m2, "kg·m²"),
        value(
            "Torque constant k_m",
            motor.torque_constant_nm_per_a,
            "N·m/A",
        ),
        value("Armature resistance R", motor.resistance_ohm, "Ω"),
        value("Armature inductance L", 1e3 * motor.inductance_h, "mH"),
    ]);
    rows
}

fn joint(case: &Case) -> Vec<Parameter> {
    let Joint::Elastic(joint) = case.axis.transmission.joint else {
        return vec![text("Joint", "rigid", "")];
    };
    let mut rows = vec![
        value("Half backlash b", joint.backlash_half_rad.to_degrees(), "°"),
        value("Joint stiffness k", joint.stiffness_nm_per_rad, "N·m/rad"),
        value("Joint damping c", joint.damping_nms_per_rad, "N·m·s/rad"),
    ];
    if joint.no_pull {
        rows.push(text("Flanks", "cannot pull", ""));
    }
    rows
}

fn mechanics(case: &Case) -> Vec<Parameter> {
    let (transmission, carriage) = (&case.axis.transmission, &case.axis.carriage);
    let pitch_mm = 1e3 * transmission.screw_pitch_m_per_rad * 2.0 * std::f64::consts::PI;
    let resistance = &carriage.resistance;
    let mut rows = vec![
        value("Gear ratio z", transmission.gear_ratio, ""),
        value(
            "Screw inertia J_v",
            transmission.screw_inertia_kg_m2,
            "kg·m²",
        ),
        value("Screw pitch p", pitch_mm, "mm/rev"),
        value("Carriage mass M", carriage.mass_kg, "kg"),
        value("Resistance a0", resistance.constant_n, "N"),
        value("Resistance a1", resistance.linear_ns_per_rad, "N·s/rad"),
        value(
            "Resistance a2",
            resistance.quadratic_ns2_per_rad2,
            "N·s²/rad²",
        ),
    ];
    if resistance.opposes_motion {
        rows.push(text("Resistance", "opposes motion", ""));
    }
    rows
}

fn run(case: &Case) -> Vec<Parameter> {
    let mut rows = vec![value("Duration", seconds(case.run.duration_ns), "s")];
    match case.solver() {
        Solver::Exact => {}
        Solver::Dopri5 { tolerance } => rows.push(value("Solver tolerance", tolerance, "")),
        Solver::Rk4 { step_ns } => {
            let step_us = 1e6 * seconds(step_ns);
            rows.push(value("Solver step", step_us, "µs"));
        }
    }
    rows.push(value("Settling band ±", case.run.settling_band_um, "µm"));
    rows
}

/// The gains in the firmware's words, with what rounding costs.
pub(crate) fn of_words(words: &FixedPointGains) -> Vec<Parameter> {
    let gains = words.rows.iter().map(|gain| {
        let word = format!("{} ({:+.1e})", gain.word, gain.relative_error());
        text(
            &format!("Word of {} (rounding)", gain.name()),
            &word,
            gain.unit(),
        )
    });
    let limit = words.error_limit.to_string();
    gains
        .chain([text("Declared range of |e|", &limit, "counts")])
        .collect()
}
