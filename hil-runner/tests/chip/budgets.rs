//! Limits on what the chip's part costs, and the page and report that show it.

use hil_core::case::Case;
use hil_core::figures::CHIP_FIGURES;
use hil_core::ladder::{Rung, climb, climb_over, confirm};
use hil_core::run::{CaseRun, RunOptions, run_over};
use hil_runner::chip::ChipLaw;
use hil_runner::chip::client::Client;

use crate::loopback::Loopback;
use crate::same_codes::case;

const PAGE: &str = include_str!("../../../docs/OUTPUTS.md");

/// So slow that the longest step is late: 400 cycles of 2.5 µs.
const SETS: [&str; 2] = ["run.duration_s=0.1", "target.clock_hz=399999"];

fn on_chip(sets: &[&str]) -> CaseRun {
    let mut client = Client::greet(Box::new(Loopback::with_ticks(&[160, 320, 160]))).unwrap();
    let case = case("paper-2", &[&SETS, sets].concat());
    let mut law = ChipLaw::new(&mut client, &case, true).unwrap();
    let outcome = run_over(&case, RunOptions::default(), &mut law, &mut |_| Ok(())).unwrap();
    CaseRun::of(&case, outcome)
}

/// Each figure holds a limit of its own size, and none that is smaller.
#[test]
fn every_figure_of_the_chip_can_be_limited() {
    let run = on_chip(&[]);
    for figure in CHIP_FIGURES {
        let value = run.outcome.summary.figure(figure.key).unwrap();
        assert!(value > 0.0, "{}", figure.key);
        for (limit, holds) in [(value, true), (0.999 * value, false)] {
            let set = format!("budget.{}={limit:e}", figure.key);
            let run = on_chip(&[&set]);
            let verdict = run.verdicts().find(|v| v.figure == figure.key);
            let verdict = verdict.unwrap();
            assert_eq!((verdict.pass, verdict.default), (holds, false), "{set}");
            assert_eq!(verdict.value, Some(value));
            let named = run.warnings.iter().any(|w| w.contains(figure.key));
            assert!(!named, "{:?}", run.warnings);
        }
    }
}

/// Without a chip a limit on its figures fails, and says why.
#[test]
fn without_a_chip_its_limits_fail() {
    let sets = ["budget.flash_bytes=8192", "budget.deadline_misses=0"];
    let case = case("paper-2", &sets);
    let run = CaseRun::new(&case, RunOptions::default(), &mut |_| Ok(())).unwrap();
    assert!(!run.passes());
    assert!(run.verdicts().all(|verdict| verdict.value.is_none()));
    let sentence = "budget.deadline_misses, budget.flash_bytes cannot pass: only a chip, over \
                    --link, has such figures";
    assert!(
        run.warnings.iter().any(|w| w == sentence),
        "{:?}",
        run.warnings
    );
    // The report names what could not be judged.
    let report = hil_core::report::report("x", "x", std::slice::from_ref(&run));
    let flash = report.cases[0]
        .figures
        .iter()
        .find(|row| row.key == "flash_bytes");
    assert_eq!(flash.unwrap().value, None);
}

#[test]
fn the_report_shows_the_chip_where_there_is_one() {
    let rows = |run: &CaseRun| {
        let report = hil_core::report::report("x", "x", std::slice::from_ref(run));
        let case = &report.cases[0];
        let figures = case.figures.iter().map(|row| (row.key.clone(), row.value));
        let labels = case.parameters.iter().map(|row| row.label.clone());
        (figures.collect::<Vec<_>>(), labels.collect::<Vec<_>>())
    };
    let (figures, labels) = rows(&on_chip(&[]));
    for (key, value) in [
        ("instructions_per_step_max", 100.0),
        ("stack_bytes", 500.0),
        ("states.paper.max", 100.0),
        ("states.paper.median", 50.0),
    ] {
        assert!(figures.contains(&(key.to_owned(), Some(value))), "{key}");
    }
    assert!(labels.contains(&"Target".to_owned()));
    // The contrast: nothing of it without a chip.
    let case = case("paper-2", &SETS);
    let host = CaseRun::new(&case, RunOptions::default(), &mut |_| Ok(())).unwrap();
    let (figures, labels) = rows(&host);
    assert!(figures.iter().all(|(key, _)| key != "stack_bytes"));
    assert!(!labels.contains(&"Target".to_owned()));
}

/// docs/OUTPUTS.md names the chip's keys in their order, and nothing else.
#[test]
fn the_page_names_every_key_of_the_chip() {
    let section = PAGE.split("\n## ").find(|s| s.starts_with("On a chip"));
    let rows = section.unwrap().lines();
    let names = rows.filter_map(|row| row.strip_prefix("| `")?.split('`').next());
    let documented: Vec<&str> = names.collect();
    let chip = on_chip(&[]).outcome.summary.chip.unwrap();
    let json = serde_json::to_value(&chip).unwrap();
    let mut keys: Vec<String> = json.as_object().unwrap().keys().cloned().collect();
    let state = &json["states"][0];
    keys.pop();
    keys.extend(
        state
            .as_object()
            .unwrap()
            .keys()
            .map(|key| format!("states[].{key}")),
    );
    assert_eq!(documented, keys);
    // The contrast: as many of them are limits as the key table knows.
    let limited = keys
        .iter()
        .filter(|key| CHIP_FIGURES.iter().any(|f| f.key == **key));
    assert_eq!(limited.count(), CHIP_FIGURES.len());
}

/// A run on a chip is held against a second one on the host, whose codes are the
/// same bits. Where the delay is measured there is none, and nothing is said.
#[test]
fn figures_of_a_chip_are_confirmed_on_the_host() {
    let rattling = [
        "target.clock_hz=168e6",
        "controller.sample_time_s=2.51e-3",
        "run.duration_s=6",
        "run.events=false",
    ];
    let confirmed = |mut run: CaseRun| {
        let options = RunOptions::default();
        run.confirm(options, &mut |_| Ok(())).unwrap();
        run.outcome.summary.digits_that_hold
    };
    let case = case("paper-2", &rattling);
    let host = CaseRun::new(&case, RunOptions::default(), &mut |_| Ok(())).unwrap();
    let digits = confirmed(on_chip(&rattling));
    assert!(!digits.is_empty());
    assert_eq!(digits, confirmed(host));
    let measured = [&rattling[..], &["controller.computation_delay_s=measured"]].concat();
    assert!(confirmed(on_chip(&measured)).is_empty());
}

/// So is the chip's rung of a ladder.
#[test]
fn a_ladder_confirms_the_rung_of_its_chip() {
    let sets = ["controller.sample_time_s=2.51e-3", "run.duration_s=6"];
    let with_law = |law: &str| case("paper-2", &[&sets[..], &[law]].concat());
    let cases = ["controller.law=quantised", "controller.law=firmware"].map(with_law);
    let rungs = |on_chip: &Case| {
        let options = RunOptions::default();
        let mut rungs = climb(&cases, options, &mut |_| Ok(())).unwrap();
        let mut client = Client::greet(Box::new(Loopback::with_ticks(&[320]))).unwrap();
        let mut law = ChipLaw::new(&mut client, on_chip, true).unwrap();
        climb_over(&mut rungs, on_chip, options, &mut law, &mut |_| Ok(())).unwrap();
        confirm(&mut rungs, &cases, &mut |_| Ok(())).unwrap();
        rungs
    };
    let [_, firmware, chip] = &rungs(&cases[1])[..] else {
        unreachable!("three rungs")
    };
    let digits = |rung: &Rung| rung.outcome.summary.digits_that_hold.clone();
    assert!(!digits(firmware).is_empty());
    assert_eq!(digits(chip), digits(firmware));
    assert_eq!(chip.difference_digits, [None, None]);
    let measured = with_law("controller.computation_delay_s=measured");
    let rungs = rungs(&measured);
    assert_eq!(digits(&rungs[1]), digits(firmware));
    assert!(digits(&rungs[2]).is_empty());
}
