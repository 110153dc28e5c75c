//! Puts the checked values together: from the units of the file to SI.

pub(super) mod options;

use core::f64::consts::{PI, TAU};

use plant::{
    Amplifier, AxisParameters, Carriage, Dac, ElasticJoint, Encoder, Joint, Motion, MotionError,
    Motor, PidGains, Resistance, Transmission,
};

use super::keys::path;
use super::tree::Table;
use super::values::Values;
use crate::case::{
    Case, ComputationDelay, ControllerSettings, Law, Limit, RunSettings, SolverChoice,
    TargetSettings,
};

/// The case; [`None`] if a value that it needs is missing or was refused.
pub(super) fn assemble(v: &Values, tree: &Table) -> Option<Case> {
    Some(Case {
        name: v.text("", "name")?.to_owned(),
        axis: AxisParameters {
            motor: motor(v)?,
            transmission: transmission(v)?,
            carriage: Carriage {
                mass_kg: v.number("carriage", "mass_kg")?,
                resistance: resistance(v)?,
            },
        },
        dac: dac(v)?,
        amplifier: Amplifier {
            gain: v.number("drive", "amplifier_gain")?,
            voltage_limit_v: v.number("drive", "voltage_limit_v")?,
        },
        encoder: encoder(v)?,
        controller: controller(v)?,
        options: options::options(v)?,
        target: TargetSettings {
            clock_hz: v.whole("target", "clock_hz"),
            cycles_per_instruction: v.number("target", "cycles_per_instruction")?,
        },
        motion: motion(v)?.ok()?,
        run: run(v)?,
        budget: budget(v, tree)?,
        keys_without_effect: keys_without_effect(v, law(v)?),
    })
}

fn keys_without_effect(v: &Values, law: Law) -> Vec<String> {
    v.set()
        .filter(|(_, key, _)| key.is_of_firmware() && law != Law::Firmware)
        .map(|(section, key, _)| path(section, key.name))
        .collect()
}

fn motor(v: &Values) -> Option<Motor> {
    Some(Motor {
        inertia_kg_m2: v.number("motor", "inertia_kg_m2")?,
        torque_constant_nm_per_a: v.number("motor", "torque_constant_nm_per_a")?,
        resistance_ohm: v.number("motor", "resistance_ohm")?,
        inductance_h: v.number("motor", "inductance_h")?,
    })
}

/// Gear, joint and screw.
pub(super) fn transmission(v: &Values) -> Option<Transmission> {
    let number = |key: &str| v.number("transmission", key);
    let joint = match v.choice("transmission", "joint")? {
        "rigid" => Joint::Rigid,
        _ => Joint::Elastic(ElasticJoint {
            stiffness_nm_per_rad: number("stiffness_nm_per_rad")?,
            damping_nms_per_rad: number("damping_nms_per_rad")?,
            // deg → rad
            backlash_half_rad: number("backlash_half_deg")? * PI / 180.0,
            no_pull: v.flag("transmission", "no_pull")?,
        }),
    };
    Some(Transmission {
        gear_ratio: number("gear_ratio")?,
        joint,
        screw_inertia_kg_m2: number("screw_inertia_kg_m2")?,
        // mm/rev → m/rad
        screw_pitch_m_per_rad: 1e-3 * number("screw_pitch_mm_per_rev")? / TAU,
    })
}

fn resistance(v: &Values) -> Option<Resistance> {
    Some(Resistance {
        constant_n: v.number("carriage", "resistance_constant_n")?,
        linear_ns_per_rad: v.number("carriage", "resistance_linear_ns_per_rad")?,
        quadratic_ns2_per_rad2: v.number("carriage", "resistance_quadratic_ns2_per_rad2")?,
        opposes_motion: v.flag("carriage", "resistance_opposes_motion")?,
    })
}

fn dac(v: &Values) -> Option<Dac> {
    let bits = v.whole("drive", "dac_bits")?;
    Some(match v.number("drive", "dac_lsb_v") {
        Some(step_v) => Dac { bits, step_v },
        None => Dac::with_range(bits, v.number("drive", "dac_range_v")?),
    })
}

/// The encoder.
pub(super) fn encoder(v: &Values) -> Option<Encoder> {
    Some(match v.number("encoder", "counts_per_rad") {
        Some(counts_per_rad) => Encoder { counts_per_rad },
        None => Encoder::with_lines(f64::from(v.whole::<u32>("encoder", "lines")?)),
    })
}

fn controller(v: &Values) -> Option<ControllerSettings> {
    Some(ControllerSettings {
        law: law(v)?,
        gains: PidGains {
            kp: v.number("controller", "kp")?,
            ki_per_s: v.number("controller", "ki_per_s")?,
            kd_s: v.number("controller", "kd_s")?,
        },
        sample_time_ns: v.nanoseconds("controller", "sample_time_s"),
        computation_delay: computation_delay(v)?,
    })
}

/// The delay: seconds, or the word for what the chip takes.
pub(super) fn computation_delay(v: &Values) -> Option<ComputationDelay> {
    let key = "computation_delay_s";
    if v.choice("controller", key).is_some() {
        return Some(ComputationDelay::Measured);
    }
    v.nanoseconds("controller", key)
        .map(ComputationDelay::Fixed)
}

/// The rung.
pub(super) fn law(v: &Values) -> Option<Law> {
    let name = v.choice("controller", "law")?;
    Law::ALL.into_iter().find(|law| law.name() == name)
}

/// The motion command, or why the intervals make none. They are judged even
/// while the travel is missing.
pub(super) fn motion(v: &Values) -> Option<Result<Motion, MotionError>> {
    let mut intervals_s = v.intervals("motion", "intervals_s")?;
    let sum_s: f64 = intervals_s.iter().sum();
    if let Some(total_s) = v.number("motion", "total_time_s")
        && sum_s > 0.0
    {
        intervals_s = intervals_s.map(|interval_s| interval_s * (total_s / sum_s));
    }
    let travel_mm = v.number("motion", "travel_mm");
    // mm → m
    match Motion::new(travel_mm.unwrap_or(1.0) * 1e-3, intervals_s) {
        Ok(_) if travel_mm.is_none() => None,
        motion => Some(motion),
    }
}

/// The method for the plant.
pub(super) fn solver(v: &Values) -> Option<SolverChoice> {
    match v.choice("run", "solver")? {
        "auto" => Some(SolverChoice::Auto),
        "exact" => Some(SolverChoice::Exact),
        "dopri5" => Some(SolverChoice::Dopri5),
        "rk4" => Some(SolverChoice::Rk4),
        _ => None,
    }
}

fn run(v: &Values) -> Option<RunSettings> {
    Some(RunSettings {
        duration_ns: v.nanoseconds("run", "duration_s")?,
        solver: solver(v)?,
        row_interval_ns: v.nanoseconds("run", "row_interval_s")?,
        rk4_step_ns: v.nanoseconds("run", "rk4_step_s")?,
        tolerance: v.number("run", "tolerance")?,
        settling_band_um: v.number("run", "settling_band_um")?,
        events: v.flag("run", "events")?,
    })
}

/// The limits in the order of the file; the outer [`None`] if one was refused.
fn budget(v: &Values, tree: &Table) -> Option<Option<Vec<Limit>>> {
    let Some(table) = tree.section("budget") else {
        return Some(None);
    };
    let limit = |figure: &String| {
        Some(Limit {
            figure: figure.clone(),
            limit: v.number("budget", figure)?,
        })
    };
    let limits: Option<Vec<Limit>> = table.entries.iter().map(|(key, _)| limit(key)).collect();
    limits.map(Some)
}
