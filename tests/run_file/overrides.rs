//! `--set section.key=value`.

use hil_core::case::{Law, Limit};

use super::{BASE, messages, parse};

#[test]
fn values_are_toml_and_a_bare_word_is_a_string() {
    let case = parse(
        BASE,
        &[
            "controller.law=firmware",
            "controller.kp = 4",
            "transmission.joint=\"rigid\"",
            "run.events=false",
            "motion.intervals_s=[0.5, 0, 0, 0, 0, 0, 0.5]",
            "name=my run",
            "budget.impacts=3",
        ],
    )
    .unwrap();
    assert_eq!(case.controller.law, Law::Firmware);
    assert_eq!(case.controller.gains.kp, 4.0);
    assert_eq!(case.axis.transmission.joint, plant::Joint::Rigid);
    assert!(!case.run.events);
    assert_eq!(case.motion.end_s(), 1.0);
    assert_eq!(case.name, "my run");
    let impacts = Limit {
        figure: "impacts".to_owned(),
        limit: 3.0,
    };
    assert_eq!(case.budget, Some(vec![impacts]));
}

#[test]
fn the_last_override_wins_and_a_wrong_value_of_the_file_is_replaced() {
    let case = parse(BASE, &["controller.kp=4", "controller.kp=5"]).unwrap();
    assert_eq!(case.controller.gains.kp, 5.0);
    let wrong = BASE.replace("kp = 3.2", "kp = -1");
    assert!(parse(&wrong, &[]).is_err());
    let case = parse(&wrong, &["controller.kp=5"]).unwrap();
    assert_eq!(case.controller.gains.kp, 5.0);
}

/// One rule for `run` and for studies; both at once are a slip.
#[test]
fn one_of_a_pair_takes_the_place_of_the_file_s() {
    let loaded = BASE.replace("[run]", "[load_encoder]\ncounts_per_mm = 100\n[run]");
    for (key, partner) in [
        ("drive.dac_range_v=80", "drive.dac_lsb_v=0.1"),
        ("encoder.lines=500", "encoder.counts_per_rad=300"),
        (
            "load_encoder.counts_per_rad=80",
            "load_encoder.counts_per_mm=50",
        ),
    ] {
        let alone = parse(&loaded, &[key]).unwrap();
        assert_ne!(alone, parse(&loaded, &[]).unwrap(), "{key} has no effect");
        assert_ne!(alone, parse(&loaded, &[partner]).unwrap(), "{partner}");
        for sets in [[key, partner], [partner, key]] {
            let told = messages(&loaded, &sets);
            assert_eq!(told.len(), 1, "{told:?}");
            assert!(told[0].contains("sets the same quantity; give one of the two"));
        }
    }
    // What replaces a whole section has only what it has.
    let whole = parse(&loaded, &["encoder={lines=500}"]).unwrap();
    assert_eq!(whole, parse(&loaded, &["encoder.lines=500"]).unwrap());
}

#[test]
fn a_missing_section_can_be_given_and_a_whole_one_replaced() {
    let without = BASE.replace("[carriage]\nmass_kg = 50.0\n", "");
    let case = parse(&without, &["carriage.mass_kg=20"]).unwrap();
    assert_eq!(case.axis.carriage.mass_kg, 20.0);
    let limited = format!("{BASE}[budget]\nimpacts = 1\n");
    let case = parse(&limited, &["budget={}"]).unwrap();
    assert_eq!(case.budget, Some(vec![]));
}

#[test]
fn a_budget_figure_keeps_its_place() {
    let text = format!("{BASE}[budget]\nimpacts = 1\nfinal_error_um = 2\n");
    let limits = parse(&text, &["budget.impacts=7"]).unwrap().budget.unwrap();
    let shown = limits.iter().map(|l| (l.figure.as_str(), l.limit));
    assert!(shown.eq([("impacts", 7.0), ("final_error_um", 2.0)]));
}

/// A change `set => sentence` a line; lines set in go on with the one before.
const WRONG: &str = r#"
controller.kp => there is no =; write --set section.key=value
=> there is no =; write --set section.key=value
=3 => the key is incomplete; write --set section.key=value
controller.=3 => the key is incomplete; write --set section.key=value
.kp=3 => the key is incomplete; write --set section.key=value
controller.kp= => there is no value after the =
a.b.c=3 => the key is too deep; write --set section.key=value
motor=3 => motor is a section; set one of its keys, such as motor.inertia_kg_m2
moter.inertia_kg_m2=3 => unknown section [moter]; did you mean [motor]?
kp=3 => unknown key kp; kp belongs to [controller]
controller.kpp=3 => unknown key controller.kpp; did you mean kp?
budget.late_steps=0 => budget.late_steps is now deadline_misses
backlash.homing_detection=effort
    => backlash.homing_detection is now backlash_measurement_detection
motion.intervals_s=[1, 2 => the value is not TOML: unclosed array, expected `]`
controller.kp=abc
    => controller.kp = abc is not allowed: the proportional gain K_p must be a number, at least 0
    codes/count, not a string
controller.kp=3,2
    => controller.kp = 3,2 is not allowed: the proportional gain K_p must be a number, at least 0
    codes/count, not a string
controller.law=firmwar
    => controller.law = firmwar is not allowed: the control law must be "continuous", "sampled",
    "quantised" or "firmware"
controller.computation_delay_s=1
    => controller.computation_delay_s = 1 is not allowed: the delay must be at most the sample
    time, controller.sample_time_s = 0.001 (line 31)
controller.computation_delay_s=fast
    => controller.computation_delay_s = fast is not allowed: the delay from sample to new voltage
    must be a number, at least 0 s or "measured"
controller.computation_delay_s=-1
    => controller.computation_delay_s = -1 is not allowed: the delay from sample to new voltage
    must be at least 0 s or "measured"
target.clock_hz=168000000.5
    => target.clock_hz = 168000000.5 is not allowed: the clock of the core must be a whole number
    from 1 to 10000000000
name=3
    => name = 3 is not allowed: the name of the run must be a string that is not empty, not a
    number
"#;

#[test]
fn wrong_overrides_have_their_sentences() {
    for case in WRONG.trim().replace("\n    ", " ").lines() {
        let (set, sentence) = case.split_once("=>").unwrap();
        let (set, sentence) = (set.trim(), sentence.trim());
        assert_eq!(messages(BASE, &[set]), [format!("--set {set}: {sentence}")]);
    }
}
