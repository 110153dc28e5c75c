//! No dead knobs: for every key of the product's axis, a run in which changing
//! that key alone changes what happens.

use std::collections::BTreeSet;

use hil_core::controllers::{GapMeasurement, IoKind, measure_gap};
use hil_core::runfile::SECTIONS;
use hil_core::summary::FaultReport;
use hil_core::trace::Row;

use super::backlash::LIMITS;
use super::{FRICTION, Ran};

/// A key: the runs' common settings, and the two settings of the key.
struct Knob {
    key: &'static str,
    base: Vec<&'static str>,
    values: [&'static str; 2],
}

/// A key that is left out.
const LEFT_OUT: &str = "";

fn knob(
    key: &'static str,
    base: &[&'static str],
    first: &'static str,
    second: &'static str,
) -> Knob {
    let (base, values) = (base.to_vec(), [first, second]);
    Knob { key, base, values }
}

const GENERATOR: &str = "controller.setpoints=generator";
const SCALE: &str = "load_encoder.counts_per_mm=1000";
const FREEZE: &str = "inject.encoder_freeze_s=0.4";
const GLITCH: [&str; 2] = [
    "inject.encoder_glitch_s=0.4",
    "inject.encoder_glitch_counts=-4096",
];
const STOP: &str = "sequence.emergency_stop_s=0.4";

fn knobs() -> Vec<Knob> {
    let measured_speed = "controller.derivative=measurement";
    let dual = ["controller.feedback=dual", measured_speed];
    let loss = [FREEZE, "limits.encoder_loss_s=0.01"];
    let follow = [FREEZE, "limits.following_error_counts=1400"];
    let scaled = [
        "inject.encoder_freeze_s=0.05 limits.following_error_counts=200 \
         limits.following_error_per_speed_s=0.007",
    ];
    let twelve = ["drive.dac_bits=12"];
    let back = ["drive.dac_bits=12 controller.anti_windup=back-calculation"];
    let dither = ["controller.quantiser=dither"];
    let released = [STOP, "sequence.emergency_stop_release_s=0.5"];
    let reset = [&released[..], &["sequence.reset_s=0.6"]].concat();
    let compensation = [&LIMITS[..], &["backlash.compensation=acceleration"]].concat();
    let friction = ["carriage.resistance_constant_n=250 carriage.resistance_opposes_motion=true"];
    let gap = [SCALE, "backlash.gap=measured"];
    let measured = [&compensation[..], &gap, &friction].concat();
    let by_effort = ["backlash.backlash_measurement_detection=effort"];
    let effort = [&measured[..], &by_effort].concat();
    let given = [&measured[..], &["backlash.half_gap_deg=4"]].concat();
    let pressed = [STOP, "sequence.reset_s=0.6"];
    let missed = ["inject.missed_tick_s=0.4"];
    let disabled = ["sequence.disable_s=0.4"];
    let queue = ["controller.setpoints=queue"];
    let motor = [SCALE, measured_speed];
    let rest = [&FRICTION[..], &["controller.rest_dead_band_counts=4"]].concat();
    let later = ["gain_change.at_s=0.3", "gain_change.kp=4"];
    vec![
        knob("encoder.counter_bits", &[], "8", "16"),
        knob("load_encoder.counts_per_rad", &dual, "1600", "1000"),
        knob("load_encoder.counts_per_mm", &dual, "1000", "500"),
        knob("controller.derivative", &[], "error", "measurement"),
        knob("controller.derivative_filter_s", &[], "0", "0.002"),
        knob("controller.anti_windup", &twelve, "none", "clamp"),
        knob("controller.tracking_time_s", &back, "0.01", "0.1"),
        knob("controller.word_bits", &[], "31", "22"),
        knob("controller.gain_fraction_bits", &[], "24", "4"),
        knob("controller.quantiser", &[], "nearest", "error-feedback"),
        knob("controller.dither_seed", &dither, "1", "2"),
        knob("controller.slew_limit_codes_per_s", &[], LEFT_OUT, "20000"),
        knob("controller.velocity_ff_s", &[GENERATOR], "0", "0.01"),
        knob("controller.acceleration_ff_s2", &[GENERATOR], "0", "0.0001"),
        knob("controller.friction_ff_codes", &[GENERATOR], "0", "10"),
        knob("controller.setpoints", &scaled, "table", "generator"),
        knob("controller.feedback", &motor, "motor", "dual"),
        knob("controller.rest_dead_band_counts", &FRICTION, "0", "4"),
        knob("controller.rest_integrator", &rest, "run", "hold"),
        knob("limits.following_error_counts", &[FREEZE], "1400", "2000"),
        knob("limits.following_error_per_speed_s", &follow, "0", "0.01"),
        knob("limits.count_jump_counts", &GLITCH, LEFT_OUT, "300"),
        knob("limits.encoder_loss_s", &[FREEZE], "0.01", "0.02"),
        knob("limits.encoder_loss_codes", &loss, "100", "7000"),
        knob("limits.saturation_s", &twelve, "0.05", "0.06"),
        knob("limits.missed_ticks", &missed, "false", "true"),
        knob("limits.velocity_mps", &compensation, "0.51", "2"),
        knob("limits.acceleration_mps2", &compensation, "2", "20"),
        knob("backlash.compensation", &LIMITS, "velocity", "acceleration"),
        knob("backlash.half_gap_deg", &compensation, LEFT_OUT, "4"),
        knob("backlash.gap", &given, "given", "measured"),
        knob(
            "backlash.backlash_measurement_detection",
            &measured,
            "load-encoder",
            "effort",
        ),
        knob(
            "backlash.backlash_measurement_speed_counts_per_s",
            &measured,
            "100",
            "2000",
        ),
        knob(
            "backlash.backlash_measurement_effort_codes",
            &effort,
            "30",
            "150",
        ),
        knob("sequence.disable_s", &[], LEFT_OUT, "0.4"),
        knob("sequence.enable_s", &disabled, "0.5", "0.6"),
        knob("sequence.emergency_stop_s", &[], LEFT_OUT, "0.4"),
        knob(
            "sequence.emergency_stop_release_s",
            &pressed,
            LEFT_OUT,
            "0.5",
        ),
        knob("sequence.reset_s", &released, "0.6", "0.7"),
        knob("gain_change.at_s", &["gain_change.kp=4"], "0.3", "0.4"),
        knob("gain_change.kp", &["gain_change.at_s=0.3"], "4", "5"),
        knob("gain_change.ki_per_s", &later, "5", "10"),
        knob("gain_change.kd_s", &later, "0.05", "0.06"),
        knob("inject.encoder_glitch_s", &GLITCH[1..], "0.4", "0.5"),
        knob("inject.encoder_glitch_counts", &GLITCH[..1], "-4096", "10"),
        knob("inject.encoder_freeze_s", &[], LEFT_OUT, "0.4"),
        knob("inject.missed_tick_s", &[], LEFT_OUT, "0.4"),
        knob("inject.bus_error_s", &[], LEFT_OUT, "0.4"),
        knob("inject.setpoint_underrun_s", &queue, LEFT_OUT, "0.4"),
        knob("sequence.enable_s", &reset, LEFT_OUT, "0.7"),
    ]
}

/// The effect of a setting: on the rows and the fault of the run, and for a
/// measurement of the gap, which must give the same gap on whatever way, on its own record.
type Effect = (Vec<Row>, Option<FaultReport>, Option<GapMeasurement>);

fn effect(base: &[&str], key: &str, value: &str) -> Effect {
    let set = format!("{key}={value}");
    let more: &[&str] = if value == LEFT_OUT { &[] } else { &[&set] };
    // One harmless key, so that both are runs of the product's axis.
    let axis: &[&str] = match key {
        "limits.saturation_s" => &[],
        _ => &["limits.saturation_s=1e3"],
    };
    let case = bench_tests::case("paper-2", &[axis, base, more].concat());
    let measures = key.starts_with("backlash.backlash_measurement");
    let gap = measures.then(|| measure_gap(&case).unwrap());
    let ran = Ran::of_case(case, IoKind::Direct).unwrap();
    let fault = ran.axis().fault.clone();
    (ran.rows, fault, gap)
}

#[test]
fn every_key_changes_something() {
    let mut dead = Vec::new();
    for Knob { key, base, values } in knobs() {
        let [first, second] = values.map(|value| effect(&base, key, value));
        let differing = first.0.iter().zip(&second.0).filter(|(a, b)| a != b);
        println!("{key}: {} rows differ", differing.count());
        if first == second {
            dead.push(key);
        }
    }
    assert!(dead.is_empty(), "dead knobs: {dead:?}");
}

/// A key of the product's axis that is not in the list above is missing there.
#[test]
fn every_key_is_turned() {
    let turned: BTreeSet<&str> = knobs().into_iter().map(|knob| knob.key).collect();
    let mut of_the_axis = BTreeSet::new();
    // What a chip costs is seen on a chip alone.
    for section in SECTIONS.iter().filter(|section| section.name != "target") {
        for key in section.keys.iter().filter(|key| key.is_of_firmware()) {
            of_the_axis.insert(format!("{}.{}", section.name, key.name));
        }
    }
    let turned: BTreeSet<String> = turned.into_iter().map(str::to_owned).collect();
    assert_eq!(turned, of_the_axis);
}
