//! A run that the supervision of the axis ends, as a script sees it: exit
//! status, trace and summary.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::process::Command;

/// Exit status, summary and rows of paper-2 with `sets`; the rows have the
/// time, the code, the voltage and the state.
fn run(sets: &[&str]) -> (i32, serde_json::Value, Vec<[String; 4]>) {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_hil-runner"));
    command.current_dir(folder.path());
    command.args(["run", "paper-2", "--trace", "t.csv", "--summary", "s.json"]);
    for set in sets {
        command.args(["--set", set]);
    }
    let output = command.output().unwrap();
    let read = |name| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let trace = read("t.csv");
    let mut lines = trace
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let columns = ["t_s", "dac_code", "motor_voltage_v", "axis_state"]
        .map(|name| header.iter().position(|column| *column == name).unwrap());
    let rows = lines.map(|line| columns.map(|column| line[column].to_owned()));
    let rows = rows.collect();
    let summary = serde_json::from_str(&read("s.json")).unwrap();
    (output.status.code().unwrap(), summary, rows)
}

/// No other budget than the one of the faults.
const ANY: &str = "budget={}";

#[test]
fn an_emergency_stop_fails_the_run() {
    let (status, summary, rows) = run(&[ANY, "sequence.emergency_stop_s=0.4"]);
    assert_eq!(status, 1);
    assert_eq!(rows[399][3], "moving");
    assert_ne!(rows[399][2], "0");
    assert_eq!(rows[400], ["0.4", "0", "0", "fault"]);

    assert_eq!(summary["faults"], 1);
    let axis = &summary["axis"];
    assert_eq!(axis["state"], "fault");
    let fault = &axis["fault"];
    assert_eq!(fault["cause"], "emergency-stop");
    assert_eq!((&fault["tick"], &fault["t_s"]), (&400.into(), &0.4.into()));
    assert_eq!(fault["setpoint_counts"], 30_615);
    assert_eq!(fault["position_counts"], 29_264);
    assert_eq!(fault["error_counts"], 1_351);
    assert_eq!(fault["dac_code"].to_string(), rows[399][1]);
    assert!(
        fault["message"]
            .as_str()
            .unwrap()
            .starts_with("the emergency stop is pressed")
    );

    let verdicts = summary["verdicts"].as_array().unwrap();
    assert_eq!(verdicts.len(), 1);
    let found = (&verdicts[0]["figure"], &verdicts[0]["pass"]);
    assert_eq!(found, (&"faults".into(), &false.into()));
}

/// The contrast: the same axis, watched as closely, with nothing to stop for.
#[test]
fn a_quiet_run_passes() {
    let watched = ["limits.missed_ticks=true", "limits.count_jump_counts=300"];
    let (status, summary, rows) = run(&[&[ANY][..], &watched].concat());
    assert_eq!(status, 0);
    let found = (&summary["faults"], &summary["axis"]["state"]);
    assert_eq!(found, (&0.into(), &"holding".into()));
    assert!(summary["axis"]["fault"].is_null());
    assert_eq!(rows.last().unwrap()[3], "holding");
}
