//! `controller.computation_delay_s = "measured"`: every code acts when its own
//! step is done, by the clock of `[target]`.

use std::collections::BTreeSet;

use hil_core::case::Case;
use hil_core::controllers::{Controller, IoKind, measure_gap};
use hil_core::lanes::Runs;
use hil_core::run::{Outcome, RunOptions, run, run_over};
use hil_core::runfile::SECTIONS;
use hil_core::trace::Row;
use hil_runner::chip::client::Client;
use hil_runner::host::LinkKind;
use plant::{Drive, Plant, Solver};

use crate::loopback::Loopback;
use crate::same_codes::{case, on_chip, on_host};

const MEASURED: &str = "controller.computation_delay_s=measured";

/// A run on a chip whose steps take `ticks`, over and over.
fn timed(case: &Case, ticks: &'static [u32]) -> (Vec<Row>, Outcome) {
    let line = Box::new(Loopback::with_ticks(ticks));
    on_chip(case, &mut Client::greet(line).unwrap()).unwrap()
}

/// 100 instructions, 400 cycles, at 168 MHz 2380.95 ns.
#[test]
fn the_measured_time_is_the_delay() {
    let measured = case("paper-2", &[MEASURED]);
    let (rows, _) = timed(&measured, &[320]);
    let given = case("paper-2", &["controller.computation_delay_s=2.381e-6"]);
    let (fixed, _) = on_host(&given);
    assert!(rows == fixed);
    // The contrast: a nanosecond more.
    let more = case("paper-2", &["controller.computation_delay_s=2.382e-6"]);
    assert!(rows != on_host(&more).0);
}

/// Every key of `[target]` shifts the codes, and their costs.
#[test]
fn every_key_of_the_target_is_turned() {
    let (rows, outcome) = timed(&case("paper-2", &[MEASURED]), &[320]);
    let chip = outcome.summary.chip.unwrap();
    let knobs = ["target.clock_hz=16e6", "target.cycles_per_instruction=2"];
    for knob in knobs {
        let (others, outcome) = timed(&case("paper-2", &[MEASURED, knob]), &[320]);
        assert!(rows != others, "{knob}");
        let other = outcome.summary.chip.unwrap();
        assert_ne!(
            other.utilisation_max_percent, chip.utilisation_max_percent,
            "{knob}"
        );
    }
    let turned: BTreeSet<&str> = knobs
        .iter()
        .filter_map(|knob| knob.split('=').next())
        .collect();
    let section = SECTIONS.iter().find(|section| section.name == "target");
    let keys = section.unwrap().keys.iter();
    let keys: Vec<String> = keys.map(|key| format!("target.{}", key.name)).collect();
    assert_eq!(turned, keys.iter().map(String::as_str).collect());
    // The contrast: where the delay is given they move no code.
    let sets = ["controller.computation_delay_s=1e-5", "target.clock_hz=1e6"];
    let (given, _) = timed(&case("paper-2", &sets[..1]), &[320]);
    assert!(given == timed(&case("paper-2", &sets), &[320]).0);
}

/// Half a sample, none, a whole one, two, some: with 1 cycle an instruction and
/// 1 MHz an instruction is a microsecond.
const UNEVEN: &[u32] = &[1_600, 0, 3_200, 6_400, 1_066];
const UNEVEN_NS: [u64; 5] = [500_000, 0, 1_000_000, 1_000_000, 333_000];

/// True if the plant comes by every row if code k comes into force
/// `delays_ns[k]` after its sample, and code k − 1 stays until then.
fn replays(case: &Case, rows: &[Row], delays_ns: impl Iterator<Item = u64>) -> bool {
    let period_ns = case.controller.sample_time_ns.unwrap();
    let mut plant = Plant::new(&case.axis, Solver::Exact);
    let mut in_force_v = 0.0;
    for (tick, (row, delay_ns)) in (0..).zip(rows.iter().zip(delays_ns)) {
        let state = plant.state();
        if (state.beta_rad, state.current_a) != (row.beta_rad, row.current_a) {
            return false;
        }
        let start_ns = tick * period_ns;
        let parts = [
            (in_force_v, start_ns + delay_ns),
            (row.motor_voltage_v, start_ns + period_ns),
        ];
        for (voltage_v, until_ns) in parts {
            plant
                .advance(&Drive::Held(voltage_v), until_ns, &mut ())
                .unwrap();
        }
        in_force_v = row.motor_voltage_v;
    }
    true
}

#[test]
fn every_step_has_its_own_delay() {
    let sets = [
        MEASURED,
        "target.clock_hz=1e6",
        "target.cycles_per_instruction=1",
    ];
    for (name, beyond) in [
        ("paper-2", ""),
        // The product's axis: it has states, and a tick that is missed.
        ("paper-1", "inject.missed_tick_s=0.5"),
    ] {
        let beyond = (!beyond.is_empty()).then_some(beyond);
        let sets: Vec<&str> = sets.into_iter().chain(beyond).collect();
        let case = case(name, &sets);
        let (rows, outcome) = timed(&case, UNEVEN);
        assert_eq!(rows.len(), 1_501);
        // The chip makes no step at a tick that it misses.
        let missed = beyond.map(|_| 500);
        let delays = || {
            let mut steps = UNEVEN_NS.into_iter().cycle();
            (0..1_501).map(move |tick| match missed {
                Some(missed) if missed == tick => 0,
                _ => steps.next().unwrap(),
            })
        };
        assert!(replays(&case, &rows, delays()), "{name}");
        // The contrast: the delays of the samples before.
        assert!(!replays(&case, &rows, delays().skip(4)), "{name}");
        let found = outcome.summary.chip.unwrap().deadline_misses;
        assert_eq!(found, Some(300), "{name}");
    }
}

/// 400 cycles at 100 kHz are four samples: every code comes when the next one is
/// due, and the run has failed.
#[test]
fn what_comes_late_is_clamped_and_fails() {
    let late = |clock: &str| {
        let (rows, outcome) = timed(&case("paper-2", &[MEASURED, clock]), &[320]);
        let verdicts = outcome.summary.verdicts;
        let verdict = verdicts.into_iter().find(|v| v.figure == "deadline_misses");
        let verdict = verdict.unwrap();
        assert!(verdict.default);
        (
            rows,
            outcome.summary.chip.unwrap().deadline_misses,
            verdict.pass,
        )
    };
    let (rows, deadline_misses, pass) = late("target.clock_hz=100000");
    assert_eq!((deadline_misses, pass), (Some(1_501), false));
    let whole = case("paper-2", &["controller.computation_delay_s=0.001"]);
    assert!(rows == on_host(&whole).0);
    // The contrast: exactly the sample time is not late.
    let (same, deadline_misses, pass) = late("target.clock_hz=400000");
    assert_eq!((deadline_misses, pass), (Some(0), true));
    assert!(same == rows);
}

/// Without a chip there is no such time, and no run.
#[test]
fn only_a_chip_measures() {
    let sentence = "only the steps of a chip are measured";
    for law in ["sampled", "quantised", "firmware"] {
        let law = format!("controller.law={law}");
        let case = case("paper-2", &[MEASURED, &law]);
        for link in [LinkKind::InProcess, LinkKind::Channel] {
            let options = RunOptions::default();
            let error = link.run(&case, options, &mut |_| Ok(())).unwrap_err();
            assert!(error.to_string().contains(sentence), "{error}");
        }
        let error = Runs::new().single(&case).unwrap_err();
        assert!(error.to_string().contains(sentence), "{error}");
        let mut controller = Controller::new(&case, IoKind::Direct).unwrap().unwrap();
        let options = RunOptions::default();
        let error = run_over(&case, options, &mut controller, &mut |_| Ok(()));
        assert!(error.unwrap_err().to_string().contains(sentence));
        let error = measure_gap(&case).unwrap_err();
        assert!(error.to_string().contains(sentence), "{error}");
    }
    // The contrasts: a rung without samples has no delay.
    let continuous = case("paper-2", &[MEASURED, "controller.law=continuous"]);
    assert!(run(&continuous, RunOptions::default(), &mut |_| Ok(())).is_ok());
    let given = case("paper-2", &["controller.computation_delay_s=0.001"]);
    assert!(run(&given, RunOptions::default(), &mut |_| Ok(())).is_ok());
}
