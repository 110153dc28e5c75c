//! The run files to make an axis of one's own from.

use hil_core::case::Law;
use hil_core::run::{RunOptions, run};
use hil_core::runfile::{template_names, template_text, values_of_template};
use hil_core::theory::{JointState, margin};
use hil_runner::study::{Changes, Study, ready};

use super::parse;

fn texts() -> impl Iterator<Item = (&'static str, &'static str)> {
    template_names().map(|name| (name, template_text(name).unwrap()))
}

/// What is told of a file, or nothing.
fn told(text: &str, sets: &[&str]) -> String {
    let case = parse(text, sets).unwrap_or_else(|errors| panic!("{errors}"));
    let told = values_of_template(&case).unwrap_or_default();
    assert_eq!(told.is_empty(), case.template_values.is_empty());
    told
}

#[test]
fn each_passes_its_own_budget_on_every_rung() {
    for (name, text) in texts() {
        for law in Law::ALL {
            let law = format!("controller.law={}", law.name());
            let verdicts = |sets: &[&str]| -> Vec<(&'static str, bool)> {
                let case = parse(text, sets).unwrap_or_else(|errors| panic!("{errors}"));
                let outcome = run(&case, RunOptions::default(), &mut |_| Ok(())).unwrap();
                let verdicts = outcome.summary.verdicts.iter();
                verdicts
                    .map(|verdict| (verdict.figure, verdict.pass))
                    .collect()
            };
            let own = verdicts(&[&law]);
            assert!(own.len() >= 6, "{name}: {own:?}");
            assert!(own.iter().all(|(_, pass)| *pass), "{name} {law}: {own:?}");
            // The limits judge: a tenth of the velocity loop's gain is too little.
            let weak = verdicts(&[&law, "controller.velocity_gain_vs_per_rad=0.02"]);
            assert!(weak.iter().any(|(_, pass)| !pass), "{name} {law}: {weak:?}");
        }
    }
}

/// The margins that the remark at the gains promises; theory has no loop with dry friction.
#[test]
fn the_gains_have_the_margins_that_they_promise() {
    let free = [
        "carriage.resistance_opposes_motion=false",
        "carriage.resistance_constant_n=0",
    ];
    for (name, text) in texts() {
        assert!(
            text.contains("these have modulus margins above 0.5"),
            "{name}"
        );
        let margins = |sets: &[&str]| {
            let case = parse(text, &[&free[..], sets].concat()).unwrap();
            [JointState::Contact, JointState::Gap]
                .map(|joint| margin(&case, joint).unwrap().modulus)
        };
        let own = margins(&[]);
        assert!(own.iter().all(|margin| *margin > 0.5), "{name}: {own:?}");
        // The contrast: three times the velocity loop's gain.
        let gain = text.split("velocity_gain_vs_per_rad = ").nth(1).unwrap();
        let gain: f64 = gain.split_whitespace().next().unwrap().parse().unwrap();
        let high = margins(&[&format!(
            "controller.velocity_gain_vs_per_rad={}",
            3.0 * gain
        )]);
        assert!(high.iter().any(|margin| *margin < 0.5), "{name}: {high:?}");
    }
}

#[test]
fn each_value_says_where_it_is_found() {
    for (name, text) in texts() {
        assert!(text.contains(&format!("template = \"{name}\"")));
        for line in text.lines().filter(|line| line.contains(" = ")) {
            assert!(
                line.starts_with('#') || line.contains(" # "),
                "{name}: {line}"
            );
        }
    }
}

#[test]
fn values_that_are_still_the_templates_are_told() {
    for (name, text) in texts() {
        let start = format!(
            "values of template {name}, not of an axis of your own: [motor] all; [transmission] all; \
             [carriage] all; [drive] all; [encoder] all; [controller] all; [motion] all; [budget] all"
        );
        assert_eq!(told(text, &[]), start);
    }
    let text = template_text("ballscrew").unwrap();
    let edited = |from: &str, to: &str| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        told(&text.replace(from, to), &[])
    };
    let but_the_mass = "[carriage] resistance_constant_n, resistance_linear_ns_per_m; [drive] all";
    // Another value, or the same one by whoever knows that it is right.
    assert!(edited("mass_kg = 40.0", "mass_kg = 41.0").contains(but_the_mass));
    assert!(edited("mass_kg = 40.0", "mass_kg = 40").contains(but_the_mass));
    assert!(told(text, &["carriage.mass_kg=40.0"]).contains(but_the_mass));
    assert!(!edited("mass_kg = 40.0", "mass_kg  =  40.0").contains(but_the_mass));
    // Gains in another way are not the template's.
    let codes = [
        "controller.kp=1",
        "controller.ki_per_s=1",
        "controller.kd_s=1",
    ];
    assert!(told(text, &codes).contains("[controller] sample_time_s; [motion] all"));
    assert_eq!(edited("template = \"ballscrew\"", ""), "");
}

/// In the place of a voltage drive's gain.
const SERVO: &str = "kind = \"current\"\namplifier_gain_a_per_v = 2.0\ncurrent_limit_a = 20.0\n\
                     current_bandwidth_hz = 400.0\n";

/// Every ready study finds its numbers, and its first, a middle and its last point are
/// runs.
#[test]
fn every_ready_study_is_one_around_each() {
    let mut cases = 0;
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../cases/templates");
    let scratch = tempfile::tempdir().unwrap();
    for (name, is_servo) in template_names().flat_map(|name| [(name, false), (name, true)]) {
        let mut path = format!("{folder}/{name}.toml");
        if is_servo {
            // The same axis with a bought servo amplifier, its move within limits.
            let text = template_text(name).unwrap().lines().map(|line| {
                let key = line.split(" = ").next().unwrap_or_default();
                match key {
                    "amplifier_gain" => SERVO.to_owned(),
                    "velocity_gain_vs_per_rad" => "velocity_gain_as_per_rad = 0.2\n".to_owned(),
                    "intervals_s" | "total_time_s" => String::new(),
                    "travel_mm" => format!("{line}\nmax_acceleration_mps2 = 1.5\n"),
                    _ => format!("{line}\n"),
                }
            });
            path = scratch.path().join("servo.toml").display().to_string();
            std::fs::write(&path, text.collect::<String>()).unwrap();
        }
        for study in ready::names() {
            let changes = Changes {
                base: Some(path.clone()),
                ..Changes::default()
            };
            let read = Study::load(study, &changes);
            let read =
                read.unwrap_or_else(|error| panic!("{study} of {name}, servo {is_servo}: {error}"));
            let points = read.plan.points();
            for point in [0, points / 2, points - 1] {
                for rung in 0..read.rungs.len() {
                    let case = read.case(&read.point(point), rung);
                    let case = case.unwrap_or_else(|why| panic!("{study} of {name}: {why}"));
                    assert!(case.controller.gains.kp > 0.0);
                    cases += 1;
                }
            }
        }
    }
    assert!(cases >= 2 * 4 * 7 * 3, "{cases}");
}
