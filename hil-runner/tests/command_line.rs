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
        let output = ran(
            &folder,
            &format!("run paper-1 --set controller.law={law} --trace -"),
        );
        stdout(&output).lines().next().unwrap().to_owned()
    };
    let reference = "t_s,x_ref_m,acc_ref_mps2";
    let plant = "motor_voltage_v,current_a,beta_rad,beta_dot_radps,gamma_rad,gamma_dot_radps,acc_mps2,contact,x_m,v_mps,v_ref_mps";
    assert_eq!(header("continuous"), format!("{reference},{plant}"));
    let codes = format!("{reference},error_counts,dac_code,{plant}");
    assert_eq!(header("firmware"), codes);
    let supervised = "firmware --set controller.anti_windup=clamp";
    assert_eq!(
        header(supervised),
        codes.replace("contact,", "contact,axis_state,")
    );
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

/// Values that a file still has from its template are told on every way out of a run.
#[test]
fn values_of_the_template_are_told() {
    let folder = folder();
    let init = |name: &str| ran(&folder, &format!("init --template {name}"));
    let text = String::from_utf8(init("belt").stdout).unwrap();
    let run = |text: &str| {
        std::fs::write(folder.path().join("axis.toml"), text).unwrap();
        let output = ran(&folder, "run axis.toml --summary s.json --report r.html");
        let summary: serde_json::Value = serde_json::from_str(&read(&folder, "s.json")).unwrap();
        (stderr(&output), summary, read(&folder, "r.html"))
    };
    let heavier = text.replace("mass_kg = 8.0", "mass_kg = 9.0");
    assert_ne!(heavier, text);
    let told = "values of template belt, not of an axis of your own: [motor] all; [transmission] all; \
                [carriage] resistance_constant_n, resistance_linear_ns_per_m; ";
    let (terminal, summary, page) = run(&heavier);
    assert!(
        terminal.contains(&format!("axis: warning: {told}")),
        "{terminal}"
    );
    assert!(page.contains(told));
    let values = summary["template_values"].as_array().unwrap();
    assert!(
        values.contains(&"carriage.resistance_constant_n".into()),
        "{values:?}"
    );
    assert!(!values.contains(&"carriage.mass_kg".into()), "{values:?}");
    // The contrast: a file that names no template.
    let (terminal, summary, page) = run(&text.replace("template = ", "# template = "));
    assert!(!terminal.contains("of template"), "{terminal}");
    assert!(summary.get("template_values").is_none());
    assert!(!page.contains("values of template"));
    let unknown = stderr(&init("hydraulics"));
    let names = "there is no template \"hydraulics\"; there are ballscrew, belt, rack, gearbox";
    assert!(unknown.contains(names), "{unknown}");
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

/// The curves of a page by name.
fn curves(page: &str) -> serde_json::Value {
    let (_, rest) = page.split_once("id=\"plot-data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

/// Rows of the trace stand in the page to its seven digits; the velocity of the
/// command is what the steps of its position say.
#[test]
fn the_page_has_the_positions_and_velocities_of_the_trace() {
    let folder = folder();
    ran(&folder, "run paper-2 --trace t.csv --report r.html");
    let data = curves(&read(&folder, "r.html"));
    let traces = &data["cases"][0]["traces"];
    let column = |name: &str| -> Vec<f64> {
        let values = traces[name].as_array().unwrap().iter();
        values.map(|value| value.as_f64().unwrap()).collect()
    };
    let [t, x_ref, x, v_ref, v] = ["t_s", "x_ref_m", "x_m", "v_ref_mps", "v_mps"].map(column);
    let trace = read(&folder, "t.csv");
    let mut reader = csv::Reader::from_reader(trace.as_bytes());
    let header = reader.headers().unwrap().clone();
    let rows: Vec<Vec<f64>> = reader
        .records()
        .map(|row| {
            row.unwrap()
                .iter()
                .map(|cell| cell.parse().unwrap())
                .collect()
        })
        .collect();
    let place = |name: &str| header.iter().position(|head| head == name).unwrap();
    let [time, reference, gamma, speed] =
        ["t_s", "x_ref_m", "gamma_rad", "gamma_dot_radps"].map(place);
    let pitch = 5e-3 / (2.0 * std::f64::consts::PI);
    let near = |shown: f64, exact: f64| (shown - exact).abs() <= 0.51e-6 * exact.abs();
    let (mut shown, mut late, mut slow) = (0, 0, 0);
    for three in rows.windows(3) {
        let [before, row, after] = three else {
            panic!()
        };
        // Of a bucket of rows the page has four at most.
        let Some(i) = t.iter().rposition(|t| *t == row[time]) else {
            continue;
        };
        shown += 1;
        assert!(
            near(x_ref[i], row[reference]) && near(x[i], pitch * row[gamma]),
            "{row:?}"
        );
        assert!(near(v[i], pitch * row[speed]), "{row:?}");
        // The central difference errs by 1/6 of the jerk, below 10 m/s³, times Δt².
        let rise = (after[reference] - before[reference]) / 2e-3;
        assert!((rise - v_ref[i]).abs() < 2e-6, "{row:?}");
        // The contrasts: the row after it, and the carriage's own velocity.
        late += usize::from(near(x[i], pitch * after[gamma]));
        slow += usize::from((rise - v[i]).abs() < 2e-6);
    }
    assert!(
        shown > 1000 && late < 50 && slow < 50,
        "{shown} {late} {slow}"
    );
}

/// Between two codes a loop or a limit within the amplifier moves the voltage, which is a
/// curve then; else it holds, and is drawn as steps.
#[test]
fn the_voltage_is_drawn_held_where_it_is() {
    let folder = folder();
    let limited = "drive.current_limit_a=5";
    for (sets, held) in [
        ("", true),
        (limited, false),
        ("controller.law=continuous", false),
    ] {
        let set = if sets.is_empty() { "" } else { " --set " };
        let line = format!("run paper-2 --report r.html{set}{sets}");
        ran(&folder, &line);
        let data = curves(&read(&folder, "r.html"));
        assert_eq!(data["cases"][0]["traces"]["voltage_held"], held, "{line}");
    }
}

/// A log is compared with every run, on the terminal and in the page; what is not
/// used is told. The differences of a trace to its own run are 0, 1 mm is 1 mm.
#[test]
fn a_measured_log_is_laid_over_the_runs() {
    let folder = folder();
    ran(&folder, "run paper-2 --trace t.csv");
    let trace = read(&folder, "t.csv");
    let mut lines = trace
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let x_ref = header.iter().position(|name| *name == "x_ref_m").unwrap();
    let mut log = "t_s,x_ref_m,note\n".to_owned();
    for row in lines.step_by(10) {
        let moved = row[x_ref].parse::<f64>().unwrap() + 1e-3;
        let time = row[0].parse::<f64>().unwrap() + 0.5;
        log += &format!("{time},{moved},hm\n");
    }
    std::fs::write(folder.path().join("m.csv"), log).unwrap();
    let line = "run paper-2 paper-1 --log m.csv --log-offset -0.5 --report r.html";
    let output = ran(&folder, line);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let text = stdout(&output);
    assert!(
        text.contains("measured: x_ref_m of m.csv\nignored: note\n"),
        "{text}"
    );
    let of = |case: &str| {
        let row = text
            .lines()
            .find(|line| line.starts_with(case) && line.contains("x_ref_m"));
        row.unwrap()
            .split_whitespace()
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert_eq!(of("paper-2")[2..7], ["151", "of", "151", "0.001", "−0.001"]);
    // The contrast: another command.
    assert_ne!(of("paper-1")[5], "0.001");
    let page = read(&folder, "r.html");
    let data = curves(&page);
    assert_eq!(data["log"]["t_s"].as_array().unwrap().len(), 151);
    assert!(page.contains("ignored: note") && page.contains("--log m.csv --log-offset -0.5"));
    let ladder = ran(
        &folder,
        "ladder paper-2 --report l.html --log m.csv --log-offset -0.5",
    );
    let rungs = curves(&read(&folder, "l.html"))["ladder"]["rungs"].clone();
    assert_eq!(status(&ladder), 0);
    for rung in rungs.as_array().unwrap() {
        let rms = rung["log"][0]["rms"].as_f64().unwrap();
        assert!((rms - 1e-3).abs() < 1e-12, "{rms}");
    }
    assert!(rungs.as_array().unwrap().len() == 4);
    // Nor the points of a profile.
    std::fs::write(folder.path().join("p.csv"), "t_s,x_mm\n0,0\n1,9\n").unwrap();
    for command in ["run", "ladder"] {
        for output in ["--report", "--junit"] {
            let line = format!("{command} paper-2 {output} p.csv --set motion.profile=p.csv");
            let refused = ran(&folder, &line);
            let told = stderr(&refused);
            assert!(
                told.contains("p.csv is a profile of this command"),
                "{told}"
            );
            assert!(read(&folder, "p.csv").starts_with("t_s,x_mm"));
        }
    }
    // No output may replace the log, and JSON stays alone on standard output.
    for command in ["run", "ladder --report l.html"] {
        let line = format!("{command} paper-2 --log m.csv --junit m.csv");
        let refused = ran(&folder, &line);
        assert!(stderr(&refused).contains("m.csv is the log of this command"));
        assert!(read(&folder, "m.csv").starts_with("t_s,x_ref_m"));
        let line = format!("{command} paper-2 --log t.csv --json");
        let output = ran(&folder, &line);
        assert!(serde_json::from_str::<serde_json::Value>(&stdout(&output)).is_ok());
        assert!(stderr(&output).contains("of t.csv"), "{}", stderr(&output));
    }
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
    let text = stdout(&output);
    std::fs::write(folder.path().join("mine.toml"), &text).unwrap();
    // Editors look for the schema where its first line says, and it says how it gets there.
    let first = text.lines().next().unwrap();
    let schema = first.strip_prefix("#:schema ./").unwrap();
    let told = text
        .lines()
        .find_map(|line| line.strip_prefix("# Editors look for the schema there; "));
    assert_eq!(
        told.unwrap(),
        format!("hil-runner schema > {schema} makes it.")
    );
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
    let schema = |of: &str| -> serde_json::Value {
        serde_json::from_slice(&ran(folder(), of).stdout).unwrap()
    };
    assert_eq!(schema("schema"), hil_core::runfile::schema());
    assert_eq!(schema("schema run-file"), hil_core::runfile::schema());
    assert_eq!(schema("schema study"), hil_runner::study::schema());
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
