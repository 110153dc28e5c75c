//! Every key of the run file, stated once. This table alone decides which keys
//! there are: the checks, the case, the JSON schema, the key reference, the
//! commented file and the settings of a report are made from it.
//!
//! A value goes into the case in the order of the table, so that a key may count
//! on those above it: `lines` on nothing, `counts_per_mm` on the screw's pitch.

mod controller;
pub(super) mod gains;

use core::f64::consts::{PI, TAU};

use plant::{Control, Course, Dac, ElasticJoint, Joint, Load, MotionLimits, Solver, Start};

use self::controller::{
    BACKLASH, CONTROLLER, ENCODER, GAIN_CHANGE, INJECT, LIMITS, LOAD_ENCODER, SEQUENCE, pitch_m,
    radians,
};
use super::keys::Access::{Own, Part, Per, Times};
use super::keys::Range::{Any, Between, NotNegative, Positive};
use super::keys::{
    Acts, Key, Kind, List, Need, Section, Way, choice, flag, number, of_firmware, section, time,
    value, whole,
};
use super::values::Stored;
use super::values::Value::{self, Flag, Nanoseconds, Number, Whole};
use crate::case::{AxisTemplate, Case, SolverChoice};
use crate::figures::{CHIP_FIGURES, Figure, HOST_STEP_P99, SUMMARY_FIGURES};

/// The sections in the order in which a run file usually has them.
pub static SECTIONS: &[Section] = &[
    section("", NAME, "the run"),
    section("motor", MOTOR, "DC motor with permanent magnets (paper, Fig. 5)")
        .ways(&[&[&["inertia_kg_m2"], &["inertia_kg_cm2"]]]),
    section("transmission", TRANSMISSION, "gear, joint with backlash, and screw (paper, Fig. 2)")
        .ways(&[
            &[&["stiffness_nm_per_rad"], &["stiffness_n_per_um"]],
            &[&["damping_nms_per_rad"], &["damping_ns_per_m"]],
            &[&["backlash_half_deg"], &["backlash_um"]],
            &[&["screw_inertia_kg_m2"], &["screw_inertia_kg_cm2"]],
        ]),
    section("carriage", CARRIAGE, "carriage and guide; resistance F_r = a0 + a1·γ̇ + a2·γ̇² (eq. 13)")
        .ways(&[&[&["resistance_linear_ns_per_rad"], &["resistance_linear_ns_per_m"]]]),
    section("drive", DRIVE, "D/A converter and power amplifier (paper, Fig. 4)")
        .ways(&[
            &[&["dac_lsb_v"], &["dac_range_v"]],
            &[&["amplifier_gain"], &["amplifier_gain_a_per_v"]],
        ]),
    section("encoder", ENCODER, "encoder on the motor shaft (eq. 21)")
        .ways(&[&[&["counts_per_rad"], &["lines"]]]),
    section("load_encoder", LOAD_ENCODER, "encoder on the load side, at the screw or at the carriage")
        .ways(&[&[&["counts_per_rad"], &["counts_per_mm"]]]),
    section("controller", CONTROLLER, "position controller (eq. 23) and its timing")
        .ways(&[gains::WAYS]),
    section("limits", LIMITS, "what the controller's supervision allows; a limit that is left out is not monitored"),
    section("backlash", BACKLASH, "backlash compensation in the reference, and backlash measurement before the motion"),
    section("motion", MOTION, "motion command: seven intervals (paper, Fig. 6), limits that they follow from, or a profile")
        .ways(&[MOTION_WAYS]),
    section("sequence", SEQUENCE, "requests to the controller at given times"),
    section("gain_change", GAIN_CHANGE, "gains that hold from a given time on")
        .ways(&[gains::WAYS_TO_CHANGE]),
    section("inject", INJECT, "hardware that misbehaves at given times"),
    section("target", TARGET, "the chip, as far as the time of a step in QEMU depends on it: without clock_hz m4 has 168 MHz, m0 16 MHz, m3 72 MHz and rv32 108 MHz; a board tells its own clock and counts cycles"),
    section("run", RUN, "duration, solver (\"dopri5\" is DOP853) and what is recorded"),
    section("tune", TUNE, "what `tune` searches; other commands check it and do without"),
    section("budget", &BUDGET, "limits on the magnitude of summary figures; without this section the default budget holds, an empty one limits nothing; from instructions_per_step_max to stack_bytes the figures are those of a chip, and without a link to one they fail"),
];

/// The lists.
pub static LISTS: &[List] = &[
    List {
        row: section(
            "load",
            LOAD,
            "force on the carriage for a time; several add up",
        ),
        instead_of: "",
        begin: |case| case.loads.push(Load::default()),
    },
    // The rows make one command, as the keys of [motion] do.
    List {
        row: section(
            "move",
            MOVE,
            "moves one after the other, in the place of [motion]",
        )
        .ways(&[MOVE_WAYS]),
        instead_of: "motion",
        begin: |_| {},
    },
];

/// The sections, then the rows of the lists.
pub(super) fn all() -> impl Iterator<Item = &'static Section> {
    SECTIONS.iter().chain(LISTS.iter().map(|list| &list.row))
}

/// The list that stands in the place of a section.
pub(super) fn list_instead_of(section: &Section) -> Option<&'static List> {
    let mut lists = LISTS.iter();
    lists.find(|list| list.instead_of == section.name && !section.name.is_empty())
}

/// The list of that name.
pub(super) fn find_list(name: &str) -> Option<&'static List> {
    LISTS.iter().find(|list| list.row.name == name)
}

/// The section of that name.
pub(super) fn find(name: &str) -> Option<&'static Section> {
    SECTIONS.iter().find(|section| section.name == name)
}

const NAME: &[Key] = &[
    value("name", Kind::Text, "")
        .meaning("name of the run")
        .needed(Need::FileStem)
        .note(&["default: the file's name without .toml"]),
    choice::<AxisTemplate>("template")
        .meaning("template that the file was made from (`init --template`)")
        .optional_at("\"ballscrew\"", |c| Some(&mut c.template))
        .note(&["of init --template: its values are named after a run"]),
];

const MOTOR: &[Key] = &[
    number("inertia_kg_m2", Positive, "kg m²")
        .named("rotor inertia J_m", "Rotor inertia J_m")
        .alone_at(|c| Some(&mut c.axis.motor.inertia_kg_m2)),
    number("inertia_kg_cm2", Positive, "kg cm²")
        .named("rotor inertia J_m", "Rotor inertia, in kg cm²")
        .needing(Need::Always, "2.0")
        .access(Per(|_| 1e4, |c| Some(&mut c.axis.motor.inertia_kg_m2)))
        .alone()
        .note(&["instead of inertia_kg_m2"]),
    number("torque_constant_nm_per_a", Positive, "N m/A")
        .named("torque and back-e.m.f. constant k_m", "Torque constant k_m")
        .alone_at(|c| Some(&mut c.axis.motor.torque_constant_nm_per_a)),
    number("resistance_ohm", Positive, "Ω")
        .named("armature resistance R", "Armature resistance R")
        .alone_at(|c| Some(&mut c.axis.motor.resistance_ohm)),
    number("inductance_h", Positive, "H")
        .meaning("armature inductance L")
        .alone_at(|c| Some(&mut c.axis.motor.inductance_h))
        .shown_in("Armature inductance L", 1e3, "mH"),
];

/// The joint, unless it is rigid.
fn elastic(case: &mut Case) -> Option<&mut ElasticJoint> {
    match &mut case.axis.transmission.joint {
        Joint::Elastic(joint) => Some(joint),
        Joint::Rigid => None,
    }
}

/// Sets half the gap \[rad\] of a joint that has one.
fn set_half_gap(case: &mut Case, half_rad: f64) {
    if let Some(joint) = elastic(case) {
        joint.backlash_half_rad = half_rad;
    }
}

const TRANSMISSION: &[Key] = &[
    number("gear_ratio", Positive, "")
        .meaning("gear ratio z, gear output speed over motor speed,")
        .at(|c| Some(&mut c.axis.transmission.gear_ratio))
        .shown("Gear ratio z"),
    value("joint", Kind::Choice(&["elastic", "rigid"]), "")
        .named("joint between gear and screw", "Joint")
        .or(Value::Choice("elastic"))
        .at(|c| Some(&mut c.axis.transmission.joint))
        .words(&[("rigid", "rigid")])
        .note(&["or \"rigid\": then k, c and b are not needed"]),
    number("stiffness_nm_per_rad", Positive, "N m/rad")
        .named("contact stiffness k of the joint", "Joint stiffness k")
        .needed(Need::ElasticJoint)
        .alone_at(|c| Some(&mut elastic(c)?.stiffness_nm_per_rad)),
    number("damping_nms_per_rad", NotNegative, "N m s/rad")
        .named("contact damping c of the joint", "Joint damping c")
        .needed(Need::ElasticJoint)
        .alone_at(|c| Some(&mut elastic(c)?.damping_nms_per_rad)),
    number("backlash_half_deg", NotNegative, "deg")
        .meaning("half backlash b of the joint")
        .needed(Need::ElasticJoint)
        .access(Own(
            |c, half_deg| set_half_gap(c, radians(half_deg)),
            |c| Some(elastic(&mut c.clone())?.backlash_half_rad.to_degrees()),
        ))
        .alone()
        .shown_in("Half backlash b", 1.0, "°"),
    number("screw_inertia_kg_m2", Positive, "kg m²")
        .named("screw inertia J_v", "Screw inertia J_v")
        .alone_at(|c| Some(&mut c.axis.transmission.screw_inertia_kg_m2)),
    number("screw_inertia_kg_cm2", Positive, "kg cm²")
        .named("screw inertia J_v", "Screw inertia, in kg cm²")
        .needing(Need::Always, "8.5")
        .access(Per(
            |_| 1e4,
            |c| Some(&mut c.axis.transmission.screw_inertia_kg_m2),
        ))
        .alone()
        .note(&["instead of screw_inertia_kg_m2"]),
    number("screw_pitch_mm_per_rev", Positive, "mm/rev")
        .named("screw pitch p", "Screw pitch p")
        .access(Own(
            |c, pitch_mm| c.axis.transmission.screw_pitch_m_per_rad = pitch_m_per_rad(pitch_mm),
            |c| Some(1e3 * pitch_m(c) * 2.0 * PI),
        )),
    // Δx = p·Δγ and a torque of p·F: k and c at the screw are p² times those at the carriage.
    number("stiffness_n_per_um", Positive, "N/µm")
        .meaning("contact stiffness k/p² at the carriage")
        .shown("Stiffness at the carriage")
        .needing(Need::ElasticJoint, "550.0")
        .access(Times(
            |c| 1e6 * pitch_squared(c),
            |c| Some(&mut elastic(c)?.stiffness_nm_per_rad),
        ))
        .alone()
        .note(&["instead of stiffness_nm_per_rad: at the carriage"]),
    number("damping_ns_per_m", NotNegative, "N s/m")
        .meaning("contact damping c/p² at the carriage")
        .shown("Damping at the carriage")
        .needing(Need::ElasticJoint, "3e5")
        .access(Times(pitch_squared, |c| {
            Some(&mut elastic(c)?.damping_nms_per_rad)
        }))
        .alone()
        .note(&["instead of damping_nms_per_rad: at the carriage"]),
    number("backlash_um", NotNegative, "µm")
        .meaning("whole backlash 2·b·p at the carriage")
        .shown("Backlash at the carriage")
        .needing(Need::ElasticJoint, "80.0")
        .access(Own(
            |c, whole_um| {
                let half_rad = whole_um / 2e6 / pitch_m(c);
                set_half_gap(c, half_rad);
            },
            |c| Some(2e6 * elastic(&mut c.clone())?.backlash_half_rad * pitch_m(c)),
        ))
        .alone()
        .note(&["instead of backlash_half_deg: the whole gap, at the carriage"]),
    choice::<Start>("start")
        .named("place of the joint in its gap at the start", "Start")
        .at(|c| Some(&mut c.start))
        .words(&[
            ("positive_flank", "on the positive flank"),
            ("negative_flank", "on the negative flank"),
        ])
        .note(&["or \"positive_flank\", \"negative_flank\": ε = +b, −b"]),
    flag("no_pull")
        .meaning("switch that keeps the joint's flanks from pulling")
        .at(|c| Some(&mut elastic(c)?.no_pull))
        .shown("Flanks")
        .words(&[("true", "cannot pull")])
        .note(&["true: a separating flank cannot pull back"]),
];

/// `p²` \[m²/rad²\].
fn pitch_squared(case: &Case) -> f64 {
    pitch_m(case) * pitch_m(case)
}

/// mm/rev → m/rad
pub(super) fn pitch_m_per_rad(pitch_mm_per_rev: f64) -> f64 {
    1e-3 * pitch_mm_per_rev / TAU
}

const CARRIAGE: &[Key] = &[
    number("mass_kg", Positive, "kg")
        .named("carriage mass M", "Carriage mass M")
        .alone_at(|c| Some(&mut c.axis.carriage.mass_kg)),
    number("resistance_constant_n", Any, "N")
        .named("constant resistance a0", "Resistance a0")
        .or(Number(0.0))
        .at(|c| Some(&mut c.axis.carriage.resistance.constant_n))
        .note(&["a0"]),
    number("resistance_linear_ns_per_rad", Any, "N s/rad")
        .named("linear resistance a1, per screw speed,", "Resistance a1")
        .or(Number(0.0))
        .at(|c| Some(&mut c.axis.carriage.resistance.linear_ns_per_rad))
        .note(&["a1"]),
    number("resistance_linear_ns_per_m", Any, "N s/m")
        .meaning("linear resistance a1/p, per carriage speed,")
        .shown("Resistance a1/p")
        .optional("100.0")
        .access(Times(pitch_m, |c| {
            Some(&mut c.axis.carriage.resistance.linear_ns_per_rad)
        }))
        .note(&["instead of resistance_linear_ns_per_rad"]),
    number("resistance_quadratic_ns2_per_rad2", Any, "N s²/rad²")
        .meaning("quadratic resistance a2, per screw speed squared,")
        .or(Number(0.0))
        .at(|c| Some(&mut c.axis.carriage.resistance.quadratic_ns2_per_rad2))
        .shown("Resistance a2")
        .note(&["a2"]),
    flag("resistance_opposes_motion")
        .meaning("switch that turns a0 and a2 against the motion")
        .at(|c| Some(&mut c.axis.carriage.resistance.opposes_motion))
        .shown("Resistance")
        .words(&[("true", "opposes motion")])
        .note(&["true: real friction, the screw can stick"]),
    number("load_force_n", Any, "N")
        .meaning("force of a load at all times, positive against positive x,")
        .shown("Load")
        .or_at(Number(0.0), |c| Some(&mut c.load_force_n))
        .note(&["weight of a hanging axis; no part of the friction"]),
];

/// The gain, unless the drive is of another kind.
fn gain(case: &mut Case, of_current: bool) -> Option<&mut dyn Stored> {
    let amplifier = &mut case.amplifier;
    (amplifier.is_current_drive() == of_current).then_some(&mut amplifier.gain)
}

/// The load whose row is read.
fn last_load(case: &mut Case) -> Option<&mut Load> {
    case.loads.last_mut()
}

const LOAD: &[Key] = &[
    time("from_s", NotNegative)
        .meaning("first instant of the load")
        .or_at(Nanoseconds(0), |c| Some(&mut last_load(c)?.from_ns)),
    time("to_s", Positive)
        .meaning("instant from which on it acts no more")
        .optional_at("0.5", |c| Some(&mut last_load(c)?.to_ns))
        .note(&["default: for ever"]),
    number("force_n", Any, "N")
        .meaning("force, positive against positive x,")
        .needing(Need::Always, "200.0")
        .at(|c| Some(&mut last_load(c)?.force_n)),
];

const DRIVE: &[Key] = &[
    value("kind", Kind::Choice(&["voltage", "current"]), "")
        .named("quantity that the amplifier's input commands", "Drive")
        .or_at(Value::Choice("voltage"), |c| Some(&mut c.amplifier.control))
        .words(&[("current", "current-controlled")])
        .note(&[
            "or \"current\": a servo amplifier with a current loop; then amplifier_gain_a_per_v",
        ]),
    whole("dac_bits", 2, 24, "bits")
        .meaning("width n of the D/A converter")
        .acting(Acts::FromQuantisedOrWith("dac_range_v"))
        .or_at(Whole(16), |c| Some(&mut c.dac.bits))
        .shown_in("DAC bits n", 1.0, "")
        .note(&["n"]),
    number("dac_lsb_v", Positive, "V")
        .meaning("D/A step K_dac, volts per code,")
        .needing(Need::Always, "0.00488")
        .at(|c| Some(&mut c.dac.step_v))
        .shown_in("DAC step K_dac", 1e3, "mV")
        .note(&["K_dac, volts per code"]),
    number("dac_range_v", Positive, "V")
        .meaning("full span ΔV of the D/A converter")
        .needing(Need::Always, "20.0")
        .access(Own(
            |c, range_v| c.dac = Dac::with_range(c.dac.bits, range_v),
            |c| Some(c.dac.step_v * f64::from(1_u32 << c.dac.bits)),
        ))
        .note(&["instead of dac_lsb_v: full span ΔV, step ΔV/2^n"]),
    number("amplifier_gain", Positive, "")
        .named("amplifier gain K_a", "Amplifier gain K_a")
        .at(|c| gain(c, false))
        .alone()
        .note(&["volts at the motor per volt of the converter"]),
    number("amplifier_gain_a_per_v", Positive, "A/V")
        .named("gain K_a of a current drive", "Amplifier gain K_a")
        .needing(Need::Always, "0.8")
        .at(|c| gain(c, true))
        .note(&["of a current drive: rated current at 10 V, by 10 V"]),
    number("voltage_limit_v", Positive, "V")
        .named("amplifier's output limit V_max", "Amplifier limit V_max")
        .needed(Need::VoltageAtLimit)
        .alone_at(|c| Some(&mut c.amplifier.voltage_limit_v)),
    number("current_limit_a", Positive, "A")
        .named("amplifier's current limit I_max", "Current limit I_max")
        .needing(Need::CurrentDrive, "20.0")
        .at(|c| {
            Some(match &mut c.amplifier.control {
                Control::Voltage { current_limit_a } => current_limit_a,
                Control::Current {
                    current_limit_a, ..
                } => current_limit_a,
            })
        })
        .note(&["default of a voltage drive: no limit"]),
    number("current_bandwidth_hz", Positive, "Hz")
        .meaning("bandwidth ω_c/2π of a current drive's loop")
        .optional("1000.0")
        .access(Times(
            |_| TAU,
            |c| match &mut c.amplifier.control {
                Control::Current {
                    bandwidth_radps, ..
                } => Some(bandwidth_radps),
                Control::Voltage { .. } => None,
            },
        ))
        .shown("Current loop's bandwidth")
        .note(&["of a current drive; default: the current is the command's at once"]),
];

const MOVE_WAYS: &[Way] = &[BY_INTERVALS, BY_LIMITS];
const MOTION_WAYS: &[Way] = &[BY_INTERVALS, BY_LIMITS, &["profile"]];
const BY_INTERVALS: Way = &["travel_mm", "intervals_s", "total_time_s"];
const BY_LIMITS: Way = &[
    "travel_mm",
    "max_acceleration_mps2",
    "max_velocity_mps",
    "max_jerk_mps3",
];

/// A limit that a command is made from.
fn motion_limit(case: &Case, of: fn(&MotionLimits) -> f64) -> Option<f64> {
    match case.motion.course() {
        Course::Limits(limits, _) => Some(of(limits)).filter(|limit| limit.is_finite()),
        _ => None,
    }
}

/// Keys of a move: they make one command, which goes into a case as a whole.
const COMMAND: [Key; 6] = [
    number("travel_mm", Any, "mm")
        .named("travel h of the carriage", "Travel h")
        .access(Part(|c| Some(1e3 * c.motion.travel_m()))),
    value("intervals_s", Kind::Intervals, "s")
        .named("list of the motion's intervals", "Intervals t1 … t7")
        .text(|c| Some(c.motion.intervals_s()?.map(crate::number::table).join(", "))),
    number("total_time_s", Positive, "s")
        .meaning("total time T_0 to which the intervals are stretched")
        .optional("1.0")
        .access(Part(|c| Some(c.motion.end_s())))
        .shown("Motion time")
        .note(&["stretches all seven to this sum; default: as they are"]),
    number("max_acceleration_mps2", Positive, "m/s²")
        .meaning("largest acceleration of the command")
        .shown("Motion's acceleration limit")
        .needing(Need::Always, "4.0")
        .access(Part(|c| motion_limit(c, |of| of.acceleration_mps2)))
        .note(&["instead of intervals_s: the fastest move within the limits"]),
    number("max_velocity_mps", Positive, "m/s")
        .named("largest speed of the command", "Motion's velocity limit")
        .optional("0.6")
        .access(Part(|c| motion_limit(c, |of| of.velocity_mps)))
        .note(&["makes the command; [limits] velocity_mps is the axis's own"]),
    number("max_jerk_mps3", Positive, "m/s³")
        .named("largest jerk of the command", "Motion's jerk limit")
        .optional("80.0")
        .access(Part(|c| motion_limit(c, |of| of.jerk_mps3)))
        .note(&["default: no limit, the acceleration jumps"]),
];

/// A move's keys and one more.
const fn command_and(last: Key) -> [Key; 7] {
    let [a, b, c, d, e, f] = COMMAND;
    [a, b, c, d, e, f, last]
}

const MOTION: &[Key] = &command_and(
    value("profile", Kind::Text, "")
        .meaning("CSV file with the points of the command, relative to the run file,")
        .shown("Profile")
        .needing(Need::Always, "\"profile.csv\"")
        .text(|c| match c.motion.course() {
            Course::Profile(profile) => Some(format!("{} points", profile.points)),
            _ => None,
        })
        .note(&["instead of all these: columns t_s,x_mm, a cubic spline between"]),
);

const MOVE: &[Key] = &command_and(
    number("dwell_s", NotNegative, "s")
        .meaning("rest after the move")
        .or(Number(0.0)),
);

const TARGET: &[Key] = &of_firmware([
    // Far above any microcontroller.
    whole("clock_hz", 1, 10_000_000_000, "Hz")
        .meaning("clock of the core")
        .optional("168e6")
        .access(Own(
            |c, clock_hz| c.target.clock_hz = Some(clock_hz as u64),
            |c| c.target.clock_hz.map(|clock_hz| clock_hz as f64),
        ))
        .note(&["default: that of a common part"]),
    // Below 1 for cores that begin two instructions in a cycle, above 100 for
    // code that runs from a serial flash.
    number("cycles_per_instruction", Between(0.01, 1_000.0), "")
        .meaning("number of cycles that an instruction is allowed")
        .or_at(Number(4.0), |c| Some(&mut c.target.cycles_per_instruction))
        .note(&["QEMU counts instructions only"]),
]);

const RUN: &[Key] = &[
    time("duration_s", Positive)
        .named("duration of the run", "Duration")
        .at(|c| Some(&mut c.run.duration_ns)),
    choice::<SolverChoice>("solver")
        .meaning("method that solves the plant")
        .at(|c| Some(&mut c.run.solver)),
    time("row_interval_s", Positive)
        .meaning("interval between rows where the law is \"continuous\"")
        .acting(Acts::OnContinuous)
        .or_at(Nanoseconds(1_000_000), |c| Some(&mut c.run.row_interval_ns))
        .note(&["rows of law \"continuous\"; the others: one a sample"]),
    time("rk4_step_s", Positive)
        .meaning("step of solver \"rk4\"")
        .or_at(Nanoseconds(10_000), |c| Some(&mut c.run.rk4_step_ns))
        .shown_in("Solver step", 1e6, "µs")
        .when(|c| matches!(c.solver(), Solver::Rk4 { .. }))
        .note(&["solver \"rk4\""]),
    // Below about 1e-14 the solver would chase rounding, not the solution,
    // and need steps without end; above 0.1 a "tolerance" tolerates anything.
    number("tolerance", Between(1e-14, 0.1), "")
        .named("error tolerance of solver \"dopri5\"", "Solver tolerance")
        .or_at(Number(1e-11), |c| Some(&mut c.run.tolerance))
        .when(|c| matches!(c.solver(), Solver::Dopri5 { .. }))
        .note(&["solver \"dopri5\""]),
    number("settling_band_um", Positive, "µm")
        .named("half width of the settling band", "Settling band ±")
        .or_at(Number(100.0), |c| Some(&mut c.run.settling_band_um)),
    time("rest_window_s", Positive)
        .meaning("length of the window of rest, up to the end of the run; without it the second half of the rest, at most 4096 samples,")
        .optional_at("0.2", |c| Some(&mut c.run.rest_window_ns))
        .shown("Window of rest")
        .note(&["default: the second half of the rest, at most 4096 samples"]),
    flag("events")
        .meaning("switch that lists every contact change")
        .or_at(Flag(true), |c| Some(&mut c.run.events))
        .note(&["list every contact change in the summary"]),
    // A step takes 0.3 to 2 µs, so that a run ends within a minute; the paper's
    // runs count 10 to 29, with `dopri5` 9,000 to 12,000.
    whole("work_limit", 1, 1_000_000_000_000_000, "")
        .meaning("number of steps and searches within the samples after which the run ends")
        .or(Whole(20_000_000))
        .access(Own(
            |c, limit| c.run.work_limit = limit as u64,
            |c| Some(c.run.work_limit as f64),
        ))
        .note(&["steps and searches within the samples at most"]),
];

/// Read by [`super::tune`].
const TUNE: &[Key] = &[
    value("keys", Kind::Strings, "")
        .meaning("keys that are tuned")
        .optional("[\"controller.kp\", \"controller.ki_per_s\", \"controller.kd_s\"]"),
    value("range", Kind::Table, "")
        .meaning("lowest and highest value of a tuned key, such as \"controller.kp\" = [1, 30]; without it from theory, which is shown,")
        .optional("{ \"controller.kp\" = [1, 30] }"),
    value("minimise", Kind::Table, "")
        .meaning("figures to make small, each with its weight: the sum of weight · ln(figure / its limit in the budget), of a margin its negative; without it peak_following_error_mm and peak_abs_acc_mps2, 1 each,")
        .optional("{ peak_following_error_mm = 1, peak_abs_acc_mps2 = 1 }"),
    value("require", Kind::Strings, "")
        .meaning("bounds on figures, a number or the word before, what the file's own setting gives on the same axis; without them modulus_margin_contact >= 0.5, modulus_margin_gap >= 0.3 where the joint has a gap, voltage_saturated_s <= 0, rest_ripple_um <= 10 and with `over` no aim worse than before,")
        .optional("[\"modulus_margin_contact >= 0.5\", \"rest_ripple_um <= 10\"]"),
    value("over", Kind::Table, "")
        .meaning("keys of the axis with the values that the setting has to serve: \"0.5..2 x\" and \"0.5, 1, 2 x\" are factors of the file's own, a list has values, a table a distribution; the worst counts,")
        .optional("{ \"transmission.backlash_half_deg\" = \"0.5..2 x\" }"),
    whole("draws", 0, 1000, "")
        .meaning("number of axes that are drawn from the distributions; without it 16 where there are any,")
        .optional("16"),
    whole("seed", 0, 4_294_967_295, "")
        .meaning("seed of the search and of what is drawn")
        .or(Whole(1)),
    whole("runs", 1, 1_000_000_000, "")
        .meaning("number of simulated runs, about; without it 10000, over several axes 3000 for each,")
        .optional("10000"),
];

/// One key for every figure of the summary, then those of a chip, and last the
/// one of the clock.
static BUDGET: [Key; SUMMARY_FIGURES.len() + CHIP_FIGURES.len() + 1] = {
    let mut keys = [limit(&HOST_STEP_P99); SUMMARY_FIGURES.len() + CHIP_FIGURES.len() + 1];
    let mut index = 0;
    while index < keys.len() - 1 {
        keys[index] = if index < SUMMARY_FIGURES.len() {
            limit(&SUMMARY_FIGURES[index])
        } else {
            limit(&CHIP_FIGURES[index - SUMMARY_FIGURES.len()])
        };
        index += 1;
    }
    keys
};

const fn limit(figure: &Figure) -> Key {
    number(figure.key, NotNegative, figure.unit)
        .meaning(figure.label)
        .needed(Need::Limit)
}
