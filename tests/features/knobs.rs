//! No dead knobs: for every key of the product's axis, a run in which changing
//! that key alone changes what happens.

use std::collections::BTreeSet;

use hil_core::controllers::{GapMeasurement, IoKind, measure_gap};
use hil_core::runfile::SECTIONS;
use hil_core::summary::FaultReport;
use hil_core::trace::Row;

use super::Ran;

/// Keys under the runs' common settings, each with its two settings, of which the
/// first may be to leave it out.
const KNOBS: &str = include_str!("knobs.txt");

/// The common settings of a key, the key and its two settings.
fn knobs() -> Vec<[&'static str; 4]> {
    let mut knobs = Vec::new();
    let mut base = "";
    for line in KNOBS.lines().filter(|line| !line.is_empty()) {
        match line.split_once(" =") {
            Some((key, values)) => {
                let (first, second) = values.split_once('|').unwrap();
                knobs.push([base, key, first.trim(), second.trim()]);
            }
            None => base = line.strip_prefix("with").unwrap(),
        }
    }
    knobs
}

/// The effect of a setting: on the rows and the fault of the run, and for a
/// measurement of the gap, which must give the same gap on whatever way, on its own record.
type Effect = (Vec<Row>, Option<FaultReport>, Option<GapMeasurement>);

fn effect(base: &str, key: &str, value: &str) -> Effect {
    let set = match value {
        "" => String::new(),
        _ => format!("{key}={value}"),
    };
    // One harmless key, so that both are runs of the product's axis.
    let axis = match key {
        "limits.saturation_s" => "",
        _ => "limits.saturation_s=1e3",
    };
    let case = bench_tests::case("paper-2", &[axis, base, &set]);
    let measures = key.starts_with("backlash.backlash_measurement");
    let gap = measures.then(|| measure_gap(&case).unwrap());
    let ran = Ran::of_case(case, IoKind::Direct).unwrap();
    let fault = ran.axis().fault.clone();
    (ran.rows, fault, gap)
}

#[test]
fn every_key_changes_something() {
    let mut dead = Vec::new();
    for [base, key, first, second] in knobs() {
        let [first, second] = [first, second].map(|value| effect(base, key, value));
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
    let turned = knobs().into_iter().map(|[_, key, ..]| key.to_owned());
    let mut of_the_axis = BTreeSet::new();
    // What a chip costs is seen on a chip alone.
    for section in SECTIONS.iter().filter(|section| section.name != "target") {
        for key in section.keys.iter().filter(|key| key.is_of_firmware()) {
            of_the_axis.insert(format!("{}.{}", section.name, key.name));
        }
    }
    assert_eq!(turned.collect::<BTreeSet<String>>(), of_the_axis);
}
