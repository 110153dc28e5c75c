//! Rows hold the figures that the run alone gives.

use hil_runner::files;
use std::fs;
use std::path::Path;
use std::process::Command;

use hil_core::figures::SUMMARY_FIGURES;
use hil_core::run::{RunOptions, run};
use hil_core::runfile::builtin_text;

use crate::support::{STUDY, folder_with, messages, ran, results, said, study};
use crate::table::table;

/// Every tenth row of the study, figure by figure, to the last bit.
#[test]
fn a_row_has_the_figures_of_the_run() {
    let folder = folder_with(STUDY);
    ran(&folder, "small.toml --out out", 0);
    let (mut made, mut excluded, mut refused) = (0, 0, 0);
    let rows = results(&folder.path().join("out"));
    for (number, row) in rows.iter().enumerate() {
        let field = |name: &str| row[name].as_str();
        assert_eq!(field("row"), number.to_string());
        assert_eq!(field("rung"), ["sampled", "quantised"][number % 2]);
        let kd: f64 = field("controller.kd_s").parse().unwrap();
        let kp: f64 = field("controller.kp").parse().unwrap();
        assert_eq!(field("status") == "excluded", kd > 0.09);
        excluded += usize::from(kd > 0.09);
        if kd <= 0.09 && kp < 0.0 {
            assert_eq!((field("status"), field("pass")), ("refused", "false"));
            let reason = field("reason");
            assert!(reason.contains("K_p must be at least 0"), "{reason}");
            refused += 1;
        }
        if number % 10 > 1 || field("status") != "ok" {
            continue;
        }
        let sets = [
            "controller.kp",
            "controller.kd_s",
            "transmission.backlash_half_deg",
        ]
        .map(|key| format!("{key}={}", field(key)));
        let mut sets = sets.to_vec();
        sets.push("run.duration_s=0.3".to_owned());
        sets.push(format!("controller.law={}", field("rung")));
        let case = files::case("paper-2", &sets).unwrap();
        let summary = run(&case, RunOptions::default(), &mut |_| Ok(()))
            .unwrap()
            .summary;
        for figure in SUMMARY_FIGURES {
            let value = field(figure.key);
            let value: Option<f64> = (!value.is_empty()).then(|| value.parse().unwrap());
            let own = summary.figure(figure.key);
            assert_eq!(value, own, "{} of row {number}", figure.key);
        }
        let passes = summary.verdicts.iter().all(|verdict| verdict.pass);
        assert_eq!(field("pass"), passes.to_string());
        made += 1;
    }
    assert!(
        made > 200 && excluded > 100 && refused > 10,
        "{made} {excluded} {refused}"
    );
}

/// The first cells of every line of a folder of results.
fn first_cells(out: &Path, cells: usize) -> Vec<String> {
    let text = fs::read_to_string(out.join("results.csv")).unwrap();
    let line = |line: &str| line.split(',').take(cells).collect::<Vec<_>>().join(",");
    text.lines().map(line).collect()
}

/// A factor axis: the delay in sample times.
#[test]
fn an_axis_can_follow_another() {
    let folder = folder_with(include_str!("studies/follow.toml"));
    ran(&folder, "small.toml --out out", 0);
    assert_eq!(
        first_cells(&folder.path().join("out"), 4),
        [
            "row,controller.sample_time_s,controller.computation_delay_s/controller.sample_time_s,\
             controller.computation_delay_s",
            "0,0.001,0,0",
            "1,0.001,0.5,0.0005",
            "2,0.001,1,0.001",
            "3,0.002,0,0",
            "4,0.002,0.5,0.001",
            "5,0.002,1,0.002",
        ]
    );
}

/// Factors of what the base has, with a budget and a base of one's own; and an
/// axis that is a factor of such a one.
#[test]
fn an_axis_can_scatter_around_the_base() {
    let folder = folder_with(include_str!("studies/scatter.toml"));
    let heavy = builtin_text("paper-2").unwrap();
    let heavy = heavy.replace("mass_kg = 50.0", "mass_kg = 80.0");
    fs::write(folder.path().join("heavy.toml"), heavy).unwrap();
    let output = study(&folder, "small.toml --base heavy.toml");
    let said = said(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    let none = "sampled: 0 of 4 runs within the limits (0 %)";
    assert!(said.contains(none), "{said}");
    assert!(said.contains("FAIL: less than the required 99 %"), "{said}");
    let out = folder.path().join("out/study-small-heavy");
    assert_eq!(
        first_cells(&out, 5),
        [
            "row,controller.sample_time_s,controller.computation_delay_s/controller.sample_time_s,\
             controller.computation_delay_s,carriage.mass_kg",
            "0,0.0005,0,0,40",
            "1,0.0005,1,0.0005,40",
            "2,0.002,0,0,40",
            "3,0.002,1,0.002,40",
        ]
    );
    // The budget's limit stands in the picture of its figure alone.
    let text = |file: &str| fs::read_to_string(out.join(file)).unwrap();
    assert!(text("f.vl.json").contains("Allowed: 1\u{a0}mm/s²"));
    assert!(!text("g.vl.json").contains("Allowed"));
    let report = text("report.html");
    assert!(report.contains("Limits: peak_abs_acc_mps2 ≤ 0.001."));
    assert!(report.contains("required are 99"));
}

/// The report says how a range is gone through: in steps, or drawn from.
#[test]
fn the_report_says_how_a_range_is_taken() {
    let axis = "[[axis]]\nkey = \"controller.kp\"\nfrom = 1\nto = 4\nscale = \"log\"\n";
    for (plan, points, words) in [
        ("grid\"", "points = 3\n", "3 values logarithmically spaced"),
        ("sobol\"\nruns = 3", "", "logarithmically drawn"),
    ] {
        let words = format!("1 to 4, {words}");
        let set = "[set]\nrun.duration_s = 0.05\n";
        let text = format!("base = \"paper-2\"\nplan = \"{plan}\n{set}{axis}{points}");
        let folder = folder_with(&text);
        ran(&folder, "small.toml --out out", 0);
        let report = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
        assert!(report.contains(&words), "{plan}");
    }
}

/// Steps of encoder and converter change, the loop does not.
#[test]
fn the_loop_gain_can_be_kept() {
    let text = include_str!("studies/loop-gain.toml");
    let peaks = |loop_gain: &str| -> Vec<f64> {
        let folder = folder_with(&text.replace("LOOP_GAIN", loop_gain));
        let output = study(&folder, "small.toml --out out");
        assert!(output.status.code().unwrap() < 2, "{output:?}");
        let rows = results(&folder.path().join("out"));
        let peak = rows
            .iter()
            .map(|row| row["peak_following_error_mm"].parse());
        peak.map(Result::unwrap).collect()
    };
    // On rung `sampled` nothing is rounded, so only the loop gain could matter.
    let kept = peaks("constant");
    assert!(
        kept.iter().all(|peak| (peak / kept[0] - 1.0).abs() < 1e-9),
        "{kept:?}"
    );
    let changed = peaks("per-count");
    assert!(changed[2] > 10.0 * changed[1], "{changed:?}");
}

/// Of a pair such as `dac_lsb_v` and `dac_range_v` the later one counts: the
/// base's, then `[set]`, then the command line.
#[test]
fn a_set_takes_the_place_of_its_partner() {
    let folder =
        folder_with("base = \"paper-2\"\n[set]\nrun.duration_s = 0.3\ndrive.dac_range_v = 40\n");
    let own = |set: &str| {
        let sets = ["run.duration_s=0.3", set].map(str::to_owned);
        let case = files::case("paper-2", &sets).unwrap();
        let summary = run(&case, RunOptions::default(), &mut |_| Ok(())).unwrap();
        summary.summary.figure("peak_abs_voltage_v").unwrap()
    };
    let made = |out: &str, sets: &str| -> f64 {
        ran(&folder, &format!("small.toml --out {out} {sets}"), 0);
        let rows = results(&folder.path().join(out));
        rows[0]["peak_abs_voltage_v"].parse().unwrap()
    };
    assert_eq!(made("set", ""), own("drive.dac_range_v=40"));
    let by_line = made("line", "--set drive.dac_lsb_v=0.01");
    assert_eq!(by_line, own("drive.dac_lsb_v=0.01"));
    assert_ne!(by_line, own("drive.dac_range_v=40"));
    let both = "small.toml --set drive.dac_lsb_v=0.01 --set drive.dac_range_v=20";
    assert!(
        ran(&folder, both, 2)
            .contains("gives the same in another way; give dac_lsb_v or dac_range_v")
    );
}

/// Settings that the firmware does not take make a run `refused`, with the
/// sentence of the run; one that ends on its way has `failed`.
#[test]
fn a_row_that_acceptance_refuses_is_refused() {
    for (set, words) in table(
        "
controller.kp = [1e5] => controller.kp = 100000
limits.following_error_counts = [2000000000] => limits.following_error_counts = 2000000000
carriage.resistance_linear_ns_per_rad = [-1000] => left the finite numbers
run.work_limit = [3] => run.work_limit = 3 allows no more
",
    ) {
        let (key, values) = set.split_once(" = ").unwrap();
        let failed = words.contains("finite numbers") || words.contains("work_limit");
        let status = if failed { "failed" } else { "refused" };
        let folder = folder_with(&format!(
            "base = \"paper-2\"\nrungs = [\"firmware\"]\n[[axis]]\nkey = \"{key}\"\nvalues = {values}\n"
        ));
        study(&folder, "small.toml --out out");
        let rows = results(&folder.path().join("out"));
        let field = |name: &str| rows[0][name].as_str();
        assert_eq!((field("status"), field("pass")), (status, "false"), "{key}");
        assert!(field("reason").contains(&words), "{}", field("reason"));
        // The same from `hil-runner run`.
        let told = Command::new(env!("CARGO_BIN_EXE_hil-runner"))
            .args(["run", "paper-2", "--set", "controller.law=firmware"])
            .args(["--set", &format!("{}={}", key, field(key))])
            .output()
            .unwrap();
        let told = messages(&told, 2);
        println!("{told}{}", field("reason"));
        let tail = |text: &str| text.trim().rsplit(": ").next().unwrap().to_owned();
        assert_eq!(tail(field("reason")), tail(&told));
    }
}

/// A study says how many of its runs did not go side by side, and why, in the line with their
/// rate; the contrast is a study of which all do.
#[test]
fn runs_that_go_one_by_one_are_told() {
    const FEW: &str = "name = 'few'\nbase = 'paper-2'\nrungs = ['continuous', 'quantised']\n\
        plan = 'grid'\n[set]\nrun.duration_s = 0.3\n\
        [[axis]]\nkey = 'controller.kp'\nvalues = [3.0, 4.0, 5.0]\n";
    let rate = |line: &str| {
        let output = study(folder_with(FEW), line);
        assert!(output.status.success(), "{output:?}");
        let lines = String::from_utf8_lossy(&output.stderr).into_owned();
        let rate = lines.lines().find(|line| line.ends_with(" runs/s"));
        rate.unwrap_or_default().to_owned()
    };
    let mixed = rate("small.toml --set run.duration_s=0.3");
    let told = "3 of them one by one (3 for rung continuous), ";
    assert!(
        mixed.starts_with("6 runs in ") && mixed.contains(told),
        "{mixed}"
    );
    let drive = "drive.kind=current --set drive.amplifier_gain_a_per_v=2 --set \
        drive.current_limit_a=20";
    let driven = rate(&format!("small.toml --rungs quantised --set {drive}"));
    let told = "3 of them one by one (3 for a current drive, or a load that comes or goes), ";
    assert!(driven.contains(told), "{driven}");
    let together = rate("small.toml --rungs quantised");
    assert!(!together.contains("one by one"), "{together}");
}
