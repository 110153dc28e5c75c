//! Every key of the run file. This table alone decides which keys there are:
//! the checks, the JSON schema and the key reference are made from it.

mod controller;
mod supervision;
mod target;

use self::controller::{BACKLASH, CONTROLLER, ENCODER, GAIN_CHANGE, LOAD_ENCODER};
use self::supervision::{INJECT, LIMITS, SEQUENCE};
use self::target::TARGET;
use super::keys::Range::{Any, Between, NotNegative, Positive};
use super::keys::{Acts, DefaultValue, Key, Kind, Need, Section, flag, number, time, value};
use crate::figures::{CHIP_FIGURES, Figure, HOST_STEP_P99, SUMMARY_FIGURES};

/// The sections in the order in which a run file usually has them.
pub static SECTIONS: &[Section] = &[
    Section {
        name: "",
        meaning: "the run",
        keys: &[value("name", Kind::Text, "", "name of the run").needed(Need::FileStem)],
    },
    Section {
        name: "motor",
        meaning: "DC motor with permanent magnets (paper, Fig. 5)",
        keys: MOTOR,
    },
    Section {
        name: "transmission",
        meaning: "gear, joint with backlash, and screw (paper, Fig. 2)",
        keys: TRANSMISSION,
    },
    Section {
        name: "carriage",
        meaning: "carriage and guide; resistance F_r = a0 + a1·γ̇ + a2·γ̇² (eq. 13)",
        keys: CARRIAGE,
    },
    Section {
        name: "drive",
        meaning: "D/A converter and power amplifier (paper, Fig. 4)",
        keys: DRIVE,
    },
    Section {
        name: "encoder",
        meaning: "encoder on the motor shaft (eq. 21)",
        keys: ENCODER,
    },
    Section {
        name: "load_encoder",
        meaning: "encoder on the load side, at the screw or at the carriage",
        keys: LOAD_ENCODER,
    },
    Section {
        name: "controller",
        meaning: "position controller (eq. 23) and its timing",
        keys: CONTROLLER,
    },
    Section {
        name: "limits",
        meaning: "what the controller's supervision allows; a limit that is left out is not \
                  watched",
        keys: LIMITS,
    },
    Section {
        name: "backlash",
        meaning: "compensation of the backlash in the reference",
        keys: BACKLASH,
    },
    Section {
        name: "motion",
        meaning: "motion command with seven intervals (paper, Fig. 6)",
        keys: MOTION,
    },
    Section {
        name: "sequence",
        meaning: "requests to the controller at given times",
        keys: SEQUENCE,
    },
    Section {
        name: "gain_change",
        meaning: "gains that hold from a given time on",
        keys: GAIN_CHANGE,
    },
    Section {
        name: "inject",
        meaning: "hardware that misbehaves at given times",
        keys: INJECT,
    },
    Section {
        name: "target",
        meaning: "the chip, as far as the time of a step in QEMU depends on it: without clock_hz \
                  m4 has 168 MHz, m0 16 MHz, m3 72 MHz and rv32 108 MHz; a board tells its own \
                  clock and counts cycles",
        keys: TARGET,
    },
    Section {
        name: "run",
        meaning: "duration, solver and what is recorded",
        keys: RUN,
    },
    Section {
        name: "budget",
        meaning: "limits on the magnitude of summary figures; without this section the default \
                  budget holds, an empty one limits nothing; from instructions_per_step_max to \
                  stack_bytes the figures are those of a chip, and without a link to one they fail",
        keys: &BUDGET,
    },
];

const MOTOR: &[Key] = &[
    number("inertia_kg_m2", Positive, "kg m²", "rotor inertia J_m"),
    number(
        "torque_constant_nm_per_a",
        Positive,
        "N m/A",
        "torque and back-e.m.f. constant k_m",
    ),
    number("resistance_ohm", Positive, "Ω", "armature resistance R"),
    number("inductance_h", Positive, "H", "armature inductance L"),
];

const TRANSMISSION: &[Key] = &[
    number(
        "gear_ratio",
        Positive,
        "",
        "gear ratio z, gear output speed over motor speed,",
    ),
    value(
        "joint",
        Kind::Choice(&["elastic", "rigid"]),
        "",
        "joint between gear and screw",
    )
    .or(DefaultValue::Choice("elastic")),
    number(
        "stiffness_nm_per_rad",
        Positive,
        "N m/rad",
        "contact stiffness k of the joint",
    )
    .needed(Need::ElasticJoint),
    number(
        "damping_nms_per_rad",
        NotNegative,
        "N m s/rad",
        "contact damping c of the joint",
    )
    .needed(Need::ElasticJoint),
    number(
        "backlash_half_deg",
        NotNegative,
        "deg",
        "half backlash b of the joint",
    )
    .needed(Need::ElasticJoint),
    number(
        "screw_inertia_kg_m2",
        Positive,
        "kg m²",
        "screw inertia J_v",
    ),
    number(
        "screw_pitch_mm_per_rev",
        Positive,
        "mm/rev",
        "screw pitch p",
    ),
    flag(
        "no_pull",
        "switch that keeps the joint's flanks from pulling",
    ),
];

const CARRIAGE: &[Key] = &[
    number("mass_kg", Positive, "kg", "carriage mass M"),
    number("resistance_constant_n", Any, "N", "constant resistance a0")
        .or(DefaultValue::Number(0.0)),
    number(
        "resistance_linear_ns_per_rad",
        Any,
        "N s/rad",
        "linear resistance a1, per screw speed,",
    )
    .or(DefaultValue::Number(0.0)),
    number(
        "resistance_quadratic_ns2_per_rad2",
        Any,
        "N s²/rad²",
        "quadratic resistance a2, per screw speed squared,",
    )
    .or(DefaultValue::Number(0.0)),
    flag(
        "resistance_opposes_motion",
        "switch that turns a0 and a2 against the motion",
    ),
];

const DRIVE: &[Key] = &[
    value(
        "dac_bits",
        Kind::Whole(2, 24),
        "bits",
        "width n of the D/A converter",
    )
    .or(DefaultValue::Whole(16))
    .acting(Acts::FromQuantisedOrWith("dac_range_v")),
    number(
        "dac_lsb_v",
        Positive,
        "V",
        "D/A step K_dac, volts per code,",
    )
    .needed(Need::OneOf("dac_range_v")),
    number(
        "dac_range_v",
        Positive,
        "V",
        "full span ΔV of the D/A converter",
    )
    .needed(Need::OneOf("dac_lsb_v")),
    number("amplifier_gain", Positive, "", "amplifier gain K_a"),
    number(
        "voltage_limit_v",
        Positive,
        "V",
        "amplifier's output limit V_max",
    ),
];

const MOTION: &[Key] = &[
    number("travel_mm", Any, "mm", "travel h of the carriage"),
    value(
        "intervals_s",
        Kind::Intervals,
        "s",
        "list of the motion's intervals",
    ),
    number(
        "total_time_s",
        Positive,
        "s",
        "total time T_0 to which the intervals are stretched",
    )
    .needed(Need::Optional),
];

const RUN: &[Key] = &[
    time("duration_s", Positive, "duration of the run"),
    value(
        "solver",
        Kind::Choice(&["auto", "exact", "dopri5", "rk4"]),
        "",
        "method that solves the plant",
    )
    .or(DefaultValue::Choice("auto")),
    time(
        "row_interval_s",
        Positive,
        "interval between rows where the law is \"continuous\"",
    )
    .or(DefaultValue::Nanoseconds(1_000_000))
    .acting(Acts::OnContinuous),
    time("rk4_step_s", Positive, "step of solver \"rk4\"").or(DefaultValue::Nanoseconds(10_000)),
    // Below about 1e-14 the solver would chase rounding, not the solution,
    // and need steps without end; above 0.1 a "tolerance" tolerates anything.
    number(
        "tolerance",
        Between(1e-14, 0.1),
        "",
        "error tolerance of solver \"dopri5\"",
    )
    .or(DefaultValue::Number(1e-11)),
    number(
        "settling_band_um",
        Positive,
        "µm",
        "half width of the settling band",
    )
    .or(DefaultValue::Number(100.0)),
    flag("events", "switch that lists every contact change").or(DefaultValue::Flag(true)),
];

/// One key for every figure of the summary, then those of a chip, and last the
/// one of the clock.
const BUDGET: [Key; SUMMARY_FIGURES.len() + CHIP_FIGURES.len() + 1] = {
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
    number(figure.key, NotNegative, figure.unit, figure.label).needed(Need::Limit)
}
