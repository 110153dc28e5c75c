//! The program as a script sees it: exit status, files, standard output.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the program in `folder`.
fn hil_runner(folder: impl AsRef<Path>, args: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_hil-runner"));
    program
        .args(args)
        .current_dir(folder.as_ref())
        .output()
        .unwrap()
}

/// Runs the program in `folder` with the words of a line.
fn ran(folder: impl AsRef<Path>, line: &str) -> Output {
    hil_runner(folder, &line.split_whitespace().collect::<Vec<_>>())
}

fn status(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn read(folder: &tempfile::TempDir, file: &str) -> String {
    std::fs::read_to_string(folder.path().join(file)).unwrap()
}

/// Names of the files in a folder.
fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

#[test]
fn main_job_passes_and_writes_the_report() {
    let folder = folder();
    let output = ran(&folder, "");
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let text = stdout(&output);
    for name in ["paper-1", "paper-2", "paper-3", "paper-4"] {
        assert!(text.contains(name), "{text}");
    }
    assert_eq!(text.matches(" pass").count(), 12, "{text}");
    assert!(!text.contains("FAIL"));
    let page = read(&folder, "out/report.html");
    assert!(page.contains("paper-4"));
    assert_eq!(files(&folder.path().join("out")), ["report.html"]);
}

#[test]
fn honest_converter_fails_its_budget() {
    let folder = folder();
    let output = ran(&folder, "run paper-2-12bit --summary s.json");
    assert_eq!(status(&output), 1);
    let text = stdout(&output);
    let broken = |line: &&str| line.trim_end().ends_with("FAIL");
    assert_eq!(text.lines().filter(broken).count(), 2);
    assert!(text.contains("\nFAIL: 2 of 3 limits broken\n"), "{text}");
    let summary = read(&folder, "s.json");
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["max_abs_dac_code"], 2047.0);
    assert_eq!(summary["verdicts"][0]["pass"], false);
}

#[test]
fn tables_fit_a_hundred_columns() {
    let folder = folder();
    for line in [
        "run paper-1 paper-2-12bit",
        "run paper-2-12bit --set name=a-name-that-is-longer-than-any-table",
        "ladder paper-2",
    ] {
        let output = ran(&folder, line);
        for line in stdout(&output).lines().filter(|line| !line.contains(':')) {
            assert!(line.trim_end().chars().count() <= 100, "{line}");
        }
    }
}

#[test]
fn budget_of_the_run_file_decides() {
    let folder = folder();
    let run = |limit: &str| {
        let set = format!("budget.final_error_um={limit}");
        status(&ran(&folder, &format!("run paper-1 --set {set}")))
    };
    assert_eq!((run("651"), run("650")), (0, 1));
}

#[test]
fn host_step_time_is_judged_only_where_it_is_asked_for() {
    let folder = folder();
    let run = |limit: &str| {
        let set = format!("budget.host_step_p99_us={limit}");
        let output = ran(
            &folder,
            &format!("run paper-1 --set {set} --summary s.json"),
        );
        assert!(stdout(&output).contains("host_step_p99_us"));
        // It is a matter of this machine's clock and in no summary.
        let summary = read(&folder, "s.json");
        assert!(!summary.contains("host_step"));
        status(&output)
    };
    assert_eq!((run("1e6"), run("0")), (0, 1));
}

#[test]
fn data_on_standard_output_stays_alone() {
    let folder = folder();
    let output = ran(&folder, "run paper-1 --trace -");
    assert_eq!(status(&output), 0);
    let mut reader = csv::Reader::from_reader(output.stdout.as_slice());
    assert_eq!(reader.records().map(Result::unwrap).count(), 1501);
    assert!(stderr(&output).contains("peak_abs_acc_mps2"));
}

#[test]
fn trace_has_the_columns_of_its_rung() {
    let folder = folder();
    let header = |law: &str| {
        let set = format!("controller.law={law}");
        let output = ran(&folder, &format!("run paper-1 --set {set} --trace -"));
        stdout(&output).lines().next().unwrap().to_owned()
    };
    let reference = "t_s,x_ref_m,acc_ref_mps2";
    let plant = "motor_voltage_v,current_a,beta_rad,beta_dot_radps,gamma_rad,gamma_dot_radps,acc_mps2,contact";
    assert_eq!(header("continuous"), format!("{reference},{plant}"));
    let codes = format!("{reference},error_counts,dac_code,{plant}");
    assert_eq!(header("firmware"), codes);
}

#[test]
fn same_input_gives_the_same_bytes() {
    let folder = folder();
    for (trace, link) in [("a.csv", "in-process"), ("b.csv", "channel")] {
        let args = format!("run paper-3 --trace {trace} --link {link}");
        assert_eq!(status(&ran(&folder, &args)), 0);
    }
    assert_eq!(read(&folder, "a.csv"), read(&folder, "b.csv"));
}

/// Only a chip's steps have a time of their own; word lengths know no delay.
#[test]
fn gains_can_be_told_without_a_delay() {
    let line = "scaling paper-1 --set controller.computation_delay_s=measured";
    let output = ran(folder(), line);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
}

/// Whoever limits what a chip costs and runs without one is told why it fails.
#[test]
fn limits_of_a_chip_say_that_they_need_one() {
    let folder = folder();
    let output = ran(&folder, "run paper-1 --set budget.cycles_per_step_max=800");
    assert_eq!(status(&output), 1);
    let row = stdout(&output);
    let limited = |line: &&str| line.contains("cycles_per_step_max");
    let row = row.lines().find(limited).unwrap();
    assert!(row.contains('–') && row.ends_with("FAIL"), "{row}");
    let warning = "warning: budget.cycles_per_step_max cannot pass: only a chip, over --link";
    assert!(stderr(&output).contains(warning), "{}", stderr(&output));
}

/// A key that the rung leaves out is told on every way out of a run.
#[test]
fn keys_that_the_rung_leaves_out_are_told() {
    let folder = folder();
    let run = |law: &str| {
        let law = format!("controller.law={law}");
        let line = format!(
            "run paper-2 --summary s.json --report r.html --set {law} \
             --set controller.setpoints=generator --set controller.velocity_ff_s=0.02"
        );
        let output = ran(&folder, &line);
        let summary: serde_json::Value = serde_json::from_str(&read(&folder, "s.json")).unwrap();
        (stderr(&output), summary, read(&folder, "r.html"))
    };
    let keys = ["controller.velocity_ff_s", "controller.setpoints"];
    let left_out = keys.join(", ");
    let told = format!("rung sampled leaves out {left_out}: they act on rung firmware");
    let (terminal, summary, page) = run("sampled");
    let warning = format!("paper-2: warning: {told}\n");
    assert!(terminal.contains(&warning), "{terminal}");
    assert_eq!(summary["keys_without_effect"], serde_json::json!(keys));
    assert!(page.contains(&told));
    // The contrast: where they act there is nothing to tell.
    let (terminal, summary, page) = run("firmware");
    assert!(!terminal.contains("leave"), "{terminal}");
    assert!(summary.get("keys_without_effect").is_none());
    assert!(!page.contains("leaves out"));
}

/// A link stays one, and its target gets the data; the system's own, such as
/// that of /dev/stdout to a pipe, leads where it always does.
#[cfg(unix)]
#[test]
fn links_lead_to_their_targets() {
    let folder = folder();
    let link = folder.path().join("link.csv");
    std::os::unix::fs::symlink("t.csv", &link).unwrap();
    let run = |trace: &str| {
        let output = ran(&folder, &format!("run paper-1 --trace {trace}"));
        assert_eq!(status(&output), 0, "{}", stderr(&output));
        stdout(&output)
    };
    run("link.csv");
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    let trace = read(&folder, "t.csv");
    assert!(run("/dev/stdout").starts_with(&trace));
    std::fs::remove_file(folder.path().join("t.csv")).unwrap();
    let output = ran(&folder, "run paper-1 --trace link.csv --summary t.csv");
    assert!(stderr(&output).contains("is given for two outputs"));
}

/// An interrupt ends the run, keeps the trace so far and leaves no file behind;
/// who sent it is not known, and not said.
#[cfg(unix)]
#[test]
fn an_interrupt_keeps_the_trace_so_far() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        interrupted_by(signal);
    }
}

#[cfg(unix)]
fn interrupted_by(signal: &str) {
    let folder = folder();
    let child = Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(["run", "paper-1", "--set", "run.duration_s=90000"])
        .args(["--trace", "t.csv", "--summary", "s.json"])
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Until it is under way: the first block of rows has been written.
    let long = |folder: &Path| {
        let entries = std::fs::read_dir(folder).unwrap().flatten();
        entries.map(|entry| entry.metadata().unwrap().len()).max() > Some(10_000)
    };
    while !long(folder.path()) {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let id = child.id().to_string();
    let killed = Command::new("kill").args([signal, &id]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(status(&output), 2);
    assert_eq!(stderr(&output), "paper-1: interrupted\n", "{signal}");
    assert_eq!(files(folder.path()), ["t.csv"]);
    let trace = read(&folder, "t.csv");
    assert!(trace.lines().count() > 10 && trace.ends_with('\n'));
}

#[cfg(unix)]
#[test]
fn a_reader_that_hangs_up_is_no_error() {
    let folder = folder();
    let program = env!("CARGO_BIN_EXE_hil-runner");
    for command in ["run paper-1 --trace -", "run paper-1 2>/dev/full"] {
        let line = format!("{program} {command} | head -1; exit ${{PIPESTATUS[0]}}");
        let output = Command::new("bash")
            .args(["-c", &line])
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert_eq!(status(&output), 0, "{command}: {}", stderr(&output));
    }
}

#[test]
fn state_that_leaves_the_finite_numbers_keeps_the_trace_so_far() {
    let folder = folder();
    // A guide that pushes harder the faster the carriage moves.
    let set = "carriage.resistance_linear_ns_per_rad=-1000";
    let args = format!("run paper-1 --set {set} --trace t.csv --summary s.json");
    let output = ran(&folder, &args);
    assert_eq!(status(&output), 2);
    let text = stderr(&output);
    assert!(text.contains("left the finite numbers at t = 0."), "{text}");
    let trace = read(&folder, "t.csv");
    assert!(trace.lines().count() > 100);
    assert_eq!(files(folder.path()), ["t.csv"]);
}

/// A run that would take for ever ends with the reason, and keeps its trace; with
/// more work, or time, it goes on.
#[test]
fn a_run_that_takes_too_long_ends_with_the_reason() {
    let folder = folder();
    let stiff = "--set carriage.resistance_linear_ns_per_rad=1e9";
    for (limit, words) in [
        (
            format!("{stiff} --set run.work_limit=1000000"),
            "run.work_limit = 1000000 allows no more",
        ),
        (
            "--time-limit 1e-6".to_owned(),
            "--time-limit 0.000001 allows no more seconds",
        ),
    ] {
        let args = format!("run paper-2 --trace t.csv --summary s.json {limit}");
        let output = ran(&folder, &args);
        let told = stderr(&output);
        assert_eq!(status(&output), 2, "{told}");
        assert!(
            told.contains("stopped at t = ") && told.contains(words),
            "{told}"
        );
        assert_eq!(files(folder.path()), ["t.csv"]);
        assert!(read(&folder, "t.csv").lines().count() > 1);
    }
    // The contrast.
    let line = "run paper-2 --time-limit 600 --set run.work_limit=1000";
    assert_eq!(status(&ran(&folder, line)), 0);
    for bad in ["0", "-1", "inf", "soon"] {
        let output = ran(&folder, &format!("run paper-2 --time-limit={bad}"));
        assert_eq!(status(&output), 2);
        assert!(
            stderr(&output).contains("greater than 0 is allowed"),
            "{bad}"
        );
    }
}

#[test]
fn init_prints_a_case_that_runs() {
    let folder = folder();
    let output = ran(&folder, "init paper-4");
    std::fs::write(folder.path().join("mine.toml"), &output.stdout).unwrap();
    let output = ran(&folder, "run mine.toml");
    assert_eq!(status(&output), 0, "{}", stderr(&output));
}

#[test]
fn ladder_compares_the_rungs() {
    let folder = folder();
    let output = ran(&folder, "ladder paper-2 --report l.html");
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    for law in ["continuous", "sampled", "quantised", "firmware"] {
        assert!(stdout(&output).contains(law));
    }
    assert_eq!(files(folder.path()), ["l.html"]);
    let said = stderr(&output);
    assert!(said.ends_with("plots: l.html\n"), "{said}");
    assert!(!said.contains("leave"), "{said}");
    let set = "--set controller.derivative=measurement";
    let output = ran(&folder, &format!("ladder paper-2 --report l.html {set}"));
    let told = "paper-2: warning: rungs continuous, sampled, quantised leave out \
                controller.derivative: it acts on rung firmware\n";
    assert!(stderr(&output).contains(told), "{}", stderr(&output));
    let page = read(&folder, "l.html");
    assert!(page.contains(told.trim_start_matches("paper-2: warning: ").trim_end()));
}

#[test]
fn schema_is_json() {
    let output = ran(folder(), "schema");
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(schema["additionalProperties"], false);
}

/// Pages show the whole command, in quotes where a shell would take it apart;
/// what was left at its default is left out.
#[test]
fn pages_show_a_command_that_a_shell_takes() {
    let folder = folder();
    let spaced = "motion.intervals_s=[0.02, 0.05, 0.02, 0.05, 0.02, 0.05, 0.02]";
    let more = ["--set", spaced, "--report", "page.html"];
    let quoted = format!("paper-2-12bit --set 'run.duration_s=0.3' --set '{spaced}'");
    for (command, given, links) in [
        ("run", "", ""),
        ("run", "--io spi --link channel", " --link channel --io spi"),
        ("ladder", "", ""),
    ] {
        let line = format!("{command} paper-2-12bit {given} --set run.duration_s=0.3");
        let arguments: Vec<&str> = line.split_whitespace().chain(more).collect();
        let output = hil_runner(&folder, &arguments);
        assert!(status(&output) < 2, "{}", stderr(&output));
        let line = format!("hil-runner {command} {quoted}{links}");
        let shown = format!("\"command_line\":\"{line}\"");
        assert!(read(&folder, "page.html").contains(&shown), "{line}");
    }
}
