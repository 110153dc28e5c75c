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
        figure: "impacts",
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
            assert!(told[0].contains("gives the same in another way; give "));
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
    let shown = limits.iter().map(|l| (l.figure, l.limit));
    assert!(shown.eq([("impacts", 7.0), ("final_error_um", 2.0)]));
}

/// A change `set => sentence` a line; lines set in go on with the one before.
const WRONG: &str = include_str!("overrides.txt");

#[test]
fn wrong_overrides_have_their_sentences() {
    for case in WRONG.replace("\n    ", " ").lines() {
        let (set, sentence) = case.split_once("=>").unwrap();
        let (set, sentence) = (set.trim(), sentence.trim());
        assert_eq!(messages(BASE, &[set]), [format!("--set {set}: {sentence}")]);
    }
}
