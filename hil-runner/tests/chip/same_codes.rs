//! Over a line the run is the same, to the last bit.

use hil_core::case::Case;
use hil_core::run::{CaseRun, Outcome, RunOptions, run, run_over};
use hil_core::trace::Row;
use hil_runner::chip::ChipLaw;
use hil_runner::chip::client::Client;
use hil_runner::chip::line::Line;
use hil_runner::files;
use plant::Motion;

use crate::loopback::Loopback;

pub(crate) fn case(name: &str, sets: &[&str]) -> Case {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    files::case(name, &sets).unwrap()
}

pub(crate) fn on_host(case: &Case) -> (Vec<Row>, Outcome) {
    let mut rows = Vec::new();
    let mut sink = |row: &Row| {
        rows.push(*row);
        Ok(())
    };
    let outcome = run(case, RunOptions::default(), &mut sink).unwrap();
    (rows, outcome)
}

pub(crate) fn on_chip(case: &Case, client: &mut Client) -> Result<(Vec<Row>, Outcome), String> {
    let mut rows = Vec::new();
    let mut sink = |row: &Row| {
        rows.push(*row);
        Ok(())
    };
    let law = ChipLaw::new(client, case, true);
    let outcome =
        law.and_then(|mut law| run_over(case, RunOptions::default(), &mut law, &mut sink));
    outcome
        .map(|outcome| (rows, outcome))
        .map_err(|error| error.to_string())
}

/// Cases that use all that goes over a line.
pub(crate) const CASES: [(&str, &[&str]); 10] = [
    ("paper-1", &[]),
    ("paper-2", &[]),
    ("paper-3", &[]),
    ("paper-4", &[]),
    ("paper-2-12bit", &[]),
    (
        "paper-2",
        &[
            "controller.anti_windup=clamp",
            "controller.quantiser=error-feedback",
            "controller.derivative=measurement",
            "controller.setpoints=generator",
            "controller.slew_limit_codes_per_s=200000",
            "encoder.counter_bits=16",
            "gain_change.at_s=0.4",
            "gain_change.kp=4",
        ],
    ),
    (
        "paper-3",
        &[
            "controller.setpoints=queue",
            "controller.velocity_ff_s=0.02",
            "inject.setpoint_underrun_s=0.4",
            "sequence.reset_s=0.6",
            "sequence.enable_s=0.7",
        ],
    ),
    (
        "paper-2",
        &[
            "inject.bus_error_s=0.3",
            "inject.encoder_glitch_s=0.2",
            "inject.encoder_glitch_counts=-4096",
            "limits.count_jump_counts=1000",
            "sequence.reset_s=0.25",
            "sequence.enable_s=0.26",
        ],
    ),
    (
        "paper-2",
        &[
            "controller.velocity_ff_s=0.02685",
            "controller.acceleration_ff_s2=0.0024",
            "controller.friction_ff_codes=20",
            "backlash.compensation=acceleration",
            "limits.velocity_mps=1",
            "limits.acceleration_mps2=5",
            "limits.following_error_counts=500",
            "limits.following_error_per_speed_s=0.01",
        ],
    ),
    (
        "paper-4",
        &[
            "load_encoder.counts_per_mm=1000",
            "controller.feedback=dual",
            "controller.derivative=measurement",
            "controller.anti_windup=back-calculation",
            "controller.derivative_filter_s=0.002",
            "limits.following_error_counts=2000",
            "inject.missed_tick_s=0.5",
            "limits.missed_ticks=true",
        ],
    ),
];

/// The summary without what only the chip says.
fn of_the_run(outcome: &Outcome) -> Outcome {
    let mut outcome = outcome.clone();
    outcome.summary.chip = None;
    let verdicts = &mut outcome.summary.verdicts;
    verdicts.retain(|verdict| verdict.figure != "deadline_misses");
    outcome
}

pub(crate) fn agree(client: &mut Client) {
    for (name, sets) in CASES {
        let case = case(name, sets);
        let (host_rows, host) = on_host(&case);
        let (chip_rows, chip) = on_chip(&case, client).unwrap();
        assert_eq!(chip_rows, host_rows, "{name} {sets:?}");
        assert_eq!(of_the_run(&chip), host, "{name} {sets:?}");
        let report = chip.summary.chip.unwrap();
        assert!(report.link_steps > 1_000, "{name} {sets:?}");
    }
}

#[test]
fn a_chip_in_memory_gives_the_codes_of_the_host() {
    let line: Box<dyn Line> = Box::new(Loopback::new());
    agree(&mut Client::greet(line).unwrap());
}

/// Tables that the memory of the chip has no room for come with the samples, and the run
/// says so: of the paper's law, of an axis, and with rates, three words a sample.
#[test]
fn a_table_longer_than_the_memory_comes_with_the_samples() {
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let sets: [(&[&str], &str); 3] = [
        (&["controller.sample_time_s=5e-5"], "20001"),
        (
            &[
                "controller.sample_time_s=5e-5",
                "controller.anti_windup=clamp",
            ],
            "20001",
        ),
        (
            &[
                "controller.sample_time_s=1.5e-4",
                "controller.velocity_ff_s=0.02",
            ],
            "20004",
        ),
    ];
    for (sets, words) in sets {
        let case = case("paper-2", sets);
        let (host_rows, host) = on_host(&case);
        let (chip_rows, chip) = on_chip(&case, &mut client).unwrap();
        assert_eq!(chip_rows, host_rows, "{sets:?}");
        assert_eq!(of_the_run(&chip), host, "{sets:?}");
        let told = CaseRun::of(&case, chip).warnings;
        let wanted = format!(
            "the table of setpoints has {words} words, the chip's memory room for 16384: they came \
             with the samples, as from a queue"
        );
        assert!(told.contains(&wanted), "{told:?}");
    }
    // The contrast: one that has room.
    let case = case("paper-2", &["controller.velocity_ff_s=0.02"]);
    let (_, chip) = on_chip(&case, &mut client).unwrap();
    let told = CaseRun::of(&case, chip).warnings;
    assert!(
        !told.iter().any(|told| told.contains("memory room")),
        "{told:?}"
    );
}

/// A row of moves goes over the line as a table, with rates or without, and as a queue.
#[test]
fn a_row_of_moves_gives_the_codes_of_the_host() {
    let there = Motion::new(0.12, [0.1, 0.1, 0.1, 0.05, 0.1, 0.1, 0.1]).unwrap();
    let back = Motion::new(-0.05, [0.12, 0.05, 0.12, 0.0, 0.12, 0.05, 0.12]).unwrap();
    let row = Motion::row(&[(there, 0.0507), (back, 0.1)]).unwrap();
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let ahead = "controller.velocity_ff_s=0.02685";
    let sets: [&[&str]; 3] = [&[], &[ahead], &[ahead, "controller.setpoints=queue"]];
    for sets in sets {
        let mut case = case("paper-2", sets);
        case.motion = row.clone();
        let (host_rows, host) = on_host(&case);
        let (chip_rows, chip) = on_chip(&case, &mut client).unwrap();
        assert_eq!(chip_rows, host_rows, "{sets:?}");
        assert_eq!(of_the_run(&chip), host, "{sets:?}");
    }
}

/// The contrast: other words on the chip than on the host.
#[test]
fn other_gains_give_other_rows() {
    let (host, _) = on_host(&case("paper-2", &[]));
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let other = case("paper-2", &["controller.kp=3.2001"]);
    let (chip, _) = on_chip(&other, &mut client).unwrap();
    assert_ne!(chip, host);
}

#[test]
fn the_summary_tells_what_the_steps_took() {
    let mut client = Client::greet(Box::new(Loopback::new())).unwrap();
    let (_, outcome) = on_chip(&case("paper-2", &[]), &mut client).unwrap();
    let json = serde_json::to_value(&outcome.summary).unwrap();
    assert_eq!(json["target"], "m4");
    assert_eq!(json["link_steps"], 1_501);
    assert_eq!(json["instructions_per_step_max"], 100);
    // 400 cycles at 168 MHz of 1 ms.
    let share = json["utilisation_max_percent"].as_f64().unwrap();
    assert!((share - 0.2381).abs() < 1e-6, "{share}");
    assert_eq!(json["states"][0]["state"], "paper");
    assert_eq!(json["stack_bytes"], 500);
}
