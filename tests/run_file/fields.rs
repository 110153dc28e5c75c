//! The settings of the controller, which stand once more on the way to a chip:
//! the table of keys and the fields of [`Axis`](firmware::axis::Axis), both ways.

use std::collections::BTreeMap;

use hil_core::controllers::{Setup, compensated};

use super::document::all_keys;
use super::{BASE, parse};

/// Paths and values of all fields of the axis that a run on rung `firmware` with
/// these sets has, as `Debug` shows them.
fn fields(sets: &[&str]) -> BTreeMap<String, String> {
    let sets = [&["controller.law=firmware"], sets].concat();
    let case = parse(BASE, &sets).unwrap_or_else(|errors| panic!("{errors}"));
    let setup = Setup::of(&case, case.controller.sample_time_ns.unwrap()).unwrap();
    let axis = compensated(&setup, setup.law().unwrap().law).unwrap();
    let shown = format!("{axis:#?}");
    let mut fields = BTreeMap::new();
    let mut path: Vec<&str> = Vec::new();
    for line in shown.lines().skip(1).map(str::trim) {
        let (name, value) = line.split_once(": ").unwrap_or(("", line));
        if value.ends_with(['{', '(']) {
            path.push(name);
        } else if value.starts_with(['}', ')']) {
            path.pop();
        } else {
            let names = path.iter().chain([&name]).copied();
            let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
            let value = value.trim_end_matches(',').to_owned();
            fields.insert(names.join("."), value);
        }
    }
    fields
}

fn is_within(path: &str, field: &str) -> bool {
    path.strip_prefix(field)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

const COMPENSATION: [&str; 4] = [
    "controller.setpoints=generator",
    "limits.velocity_mps=2",
    "limits.acceleration_mps2=20",
    "backlash.compensation=velocity",
];

/// Further keys that must be given, and two values of the key.
fn values(path: &str) -> (&'static [&'static str], [&'static str; 2]) {
    let generator = &COMPENSATION[..1];
    match path {
        "drive.dac_bits" => (&[], ["14", "16"]),
        "encoder.counter_bits" => (&[], ["16", "32"]),
        "controller.kp" | "controller.ki_per_s" | "controller.kd_s" => (&[], ["0.01", "0.02"]),
        "controller.derivative" => (&[], ["error", "measurement"]),
        "controller.derivative_filter_s" => (&[], ["0.001", "0.002"]),
        "controller.anti_windup" => (&[], ["none", "clamp"]),
        "controller.tracking_time_s" => (
            &["controller.anti_windup=back-calculation"],
            ["0.01", "0.1"],
        ),
        "controller.quantiser" => (&[], ["nearest", "error-feedback"]),
        "controller.dither_seed" => (&["controller.quantiser=dither"], ["1", "2"]),
        "controller.slew_limit_codes_per_s" => (&[], ["1e5", "2e5"]),
        "controller.velocity_ff_s" | "controller.acceleration_ff_s2" => {
            (generator, ["0.001", "0.002"])
        }
        "controller.friction_ff_codes" => (generator, ["10", "20"]),
        "controller.feedback" => (
            &[
                "load_encoder.counts_per_mm=1000",
                "controller.derivative=measurement",
            ],
            ["motor", "dual"],
        ),
        "controller.rest_dead_band_counts" => (&[], ["0", "4"]),
        "controller.rest_integrator" => (&[], ["run", "hold"]),
        "limits.following_error_counts" => (&[], ["1400", "2000"]),
        "limits.following_error_per_speed_s" => {
            (&["limits.following_error_counts=1400"], ["0.01", "0.03"])
        }
        "limits.count_jump_counts" => (&[], ["300", "400"]),
        "limits.encoder_loss_s" | "limits.saturation_s" => (&[], ["0.01", "0.02"]),
        "limits.encoder_loss_codes" => (&["limits.encoder_loss_s=0.01"], ["100", "200"]),
        "limits.missed_ticks" => (&[], ["false", "true"]),
        "backlash.compensation" => (&COMPENSATION[..3], ["velocity", "acceleration"]),
        "backlash.half_gap_deg" => (&COMPENSATION, ["3", "4"]),
        path => panic!("{path} has no values here"),
    }
}

#[test]
fn a_key_that_names_a_field_decides_on_it() {
    for (section, key) in all_keys() {
        let Some(field) = key.field else { continue };
        let path = format!("{}.{}", section.name, key.name);
        let (beside, values) = values(&path);
        let [first, second] = values.map(|value| {
            let all = fields(&[beside, &[&format!("{path}={value}")]].concat());
            let within = all.into_iter().filter(|(path, _)| is_within(path, field));
            within.collect::<Vec<_>>()
        });
        assert!(!second.is_empty(), "{path}: there is no field {field}");
        assert_ne!(first, second, "{path} does not decide on {field}");
    }
}

/// Fields that follow from several keys or from others.
const DERIVED: [&str; 13] = [
    "law.dac",
    "law.error_sum_limit",
    "law.largest",
    "law.settings",
    "law.words.error_bits",
    "law.words.integral_bits",
    "output.dac",
    "output.kept",
    "output.set",
    "backlash_compensation.first",
    "backlash_compensation.half_samples",
    "monitors.following_error.fraction_bits",
    "monitors.following_error.velocity_fraction_bits",
];

#[test]
fn a_field_that_no_key_names_is_derived() {
    let everything = [
        &COMPENSATION[..],
        &[
            "controller.derivative=measurement",
            "controller.derivative_filter_s=0.001",
            "controller.anti_windup=back-calculation",
            "controller.quantiser=dither",
            "limits.following_error_counts=1400",
            "limits.count_jump_counts=300",
            "limits.encoder_loss_s=0.05",
            "limits.saturation_s=0.05",
            "limits.missed_ticks=true",
        ],
    ];
    let fields = fields(&everything.concat());
    let named = |path: &str| {
        let mut named = all_keys().filter_map(|(_, key)| key.field);
        named.any(|field| is_within(path, field))
    };
    for path in fields.keys() {
        let derived = DERIVED.iter().any(|field| is_within(path, field));
        assert_ne!(named(path), derived, "{path}");
    }
    for field in DERIVED {
        assert!(fields.keys().any(|path| is_within(path, field)), "{field}");
    }
}
