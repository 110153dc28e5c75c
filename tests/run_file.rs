//! The run file: what it accepts, and what it says about the rest.

#[cfg(test)]
#[path = "run_file/acts.rs"]
mod acts;
#[cfg(test)]
#[path = "run_file/cases.rs"]
mod cases;
#[cfg(test)]
#[path = "run_file/document.rs"]
mod document;
#[cfg(test)]
#[path = "run_file/every_key.rs"]
mod every_key;
#[cfg(test)]
#[path = "run_file/fields.rs"]
mod fields;
#[cfg(test)]
#[path = "run_file/fuzz.rs"]
mod fuzz;
#[cfg(test)]
#[path = "run_file/json_schema.rs"]
mod json_schema;
#[cfg(test)]
#[path = "run_file/options.rs"]
mod options;
#[cfg(test)]
#[path = "run_file/overrides.rs"]
mod overrides;
#[cfg(test)]
#[path = "run_file/sentences.rs"]
mod sentences;

use hil_core::case::Case;
use hil_core::runfile;

/// A run file in which every required key is given, one a line.
pub(crate) const BASE: &str = r#"[motor]
inertia_kg_m2 = 2e-4
torque_constant_nm_per_a = 0.25
resistance_ohm = 1.5
inductance_h = 6.5e-3

[transmission]
gear_ratio = 2
stiffness_nm_per_rad = 350
damping_nms_per_rad = 0.2
backlash_half_deg = 3.0
screw_inertia_kg_m2 = 8.5e-4
screw_pitch_mm_per_rev = 5.0

[carriage]
mass_kg = 50.0

[drive]
dac_lsb_v = 0.00488
amplifier_gain = 3.0
voltage_limit_v = 150.0

[encoder]
counts_per_rad = 636.0

[controller]
law = "sampled"
kp = 3.2
ki_per_s = 5.0
kd_s = 0.05
sample_time_s = 0.001

[motion]
travel_mm = 250.0
intervals_s = [0.25, 0.0, 0.25, 0.0, 0.25, 0.0, 0.25]

[run]
duration_s = 1.5
"#;

/// [`BASE`] with one piece of text replaced; the piece must be there once.
pub(crate) fn base_with(from: &str, to: &str) -> String {
    assert_eq!(BASE.matches(from).count(), 1, "{from:?} in the base");
    BASE.replace(from, to)
}

/// The lines printed for the run file named `x.toml`; empty if it is right.
pub(crate) fn messages(text: &str, sets: &[&str]) -> Vec<String> {
    match parse(text, sets) {
        Ok(_) => Vec::new(),
        Err(errors) => errors.to_string().lines().map(str::to_owned).collect(),
    }
}

pub(crate) fn parse(text: &str, sets: &[&str]) -> Result<Case, runfile::RunFileErrors> {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    runfile::parse("cases/x.toml", text, &sets)
}
