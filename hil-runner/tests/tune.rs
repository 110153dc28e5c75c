//! `hil-runner tune`: what is written is what was found and better than before, whatever the
//! number of threads and however often it was interrupted; and what it says to bad input.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

const KEYS: &str = r#"tune.keys=["controller.kp", "controller.ki_per_s", "controller.kd_s", "controller.velocity_ff_s", "controller.acceleration_ff_s2"]"#;

fn hil_runner(folder: &Path, args: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_hil-runner"));
    program.args(args).current_dir(folder).output().unwrap()
}

/// A tune of paper-2 with few runs.
fn tune(folder: &Path, more: &[&str]) -> Output {
    let args = ["tune", "paper-2", "--set", KEYS, "--set", "tune.runs=900"];
    hil_runner(folder, &[&args, more].concat())
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn json(text: &[u8]) -> Value {
    serde_json::from_slice(text).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// A row of a list by its figure.
fn of<'v>(list: &'v Value, figure: &str) -> &'v Value {
    let mut rows = list.as_array().unwrap().iter();
    rows.find(|row| row["figure"] == figure).unwrap()
}

#[test]
fn what_is_written_runs_as_it_was_found_and_better_than_before() {
    let folder = tempfile::tempdir().unwrap();
    let output = tune(folder.path(), &["--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let found = json(&output.stdout);
    let on_disk = fs::read(folder.path().join("out/tune-paper-2/tune.json")).unwrap();
    assert_eq!(found, json(&on_disk));

    // Only the tuned keys differ, and the comments beside them stay.
    let before = hil_core::runfile::builtin_text("paper-2").unwrap();
    let after = fs::read_to_string(folder.path().join("out/tune-paper-2/tuned.toml")).unwrap();
    let kept = |line: &&str| !before.lines().any(|own| own == *line);
    let changed: Vec<&str> = after.lines().filter(kept).collect();
    assert_eq!(changed.len(), 5, "{changed:?}");
    assert!(
        changed[0].starts_with("kp = ") && changed[0].contains("# K_p"),
        "{changed:?}"
    );
    for line in &changed {
        let value = line.split(['=', '#']).nth(1).unwrap().trim();
        let digits = value.trim_start_matches(['0', '.']).replace('.', "");
        let most = if line.contains("_ff_") { 4 } else { 3 };
        assert!(digits.split('e').next().unwrap().len() <= most, "{line}");
    }

    let run = hil_runner(
        folder.path(),
        &["run", "out/tune-paper-2/tuned.toml", "--json"],
    );
    let (summary, paper) = (
        json(&run.stdout),
        hil_runner(folder.path(), &["run", "paper-2", "--json"]),
    );
    let paper = json(&paper.stdout);
    for aim in ["peak_following_error_mm", "peak_abs_acc_mps2"] {
        let row = of(&found["aims"], aim);
        assert_eq!(number(&row["after"]), number(&summary[aim]), "{aim}");
        assert_eq!(number(&row["before"]), number(&paper[aim]), "{aim}");
        assert!(number(&row["after"]) < number(&row["before"]), "{aim}");
    }
    for (figure, least) in [("modulus_margin_contact", 0.5), ("modulus_margin_gap", 0.3)] {
        assert!(number(&summary[figure]) >= least, "{figure}");
        assert_eq!(of(&found["requirements"], figure)["kept"], true);
    }
    assert!(number(&summary["rest_ripple_um"]) <= 10.0);
    // The contrast: the paper's own gains break one of them.
    assert!(number(&paper["rest_ripple_um"]) > 10.0);
}

/// Bytes of everything that a tune writes.
fn written(folder: &Path) -> Vec<Vec<u8>> {
    let files = ["settings.csv", "tune.json", "tuned.toml", "report.html"];
    files
        .map(|file| fs::read(folder.join("out").join(file)).unwrap())
        .to_vec()
}

#[test]
fn threads_and_interruptions_change_no_byte() {
    let out = ["--out", "out"];
    let one = tempfile::tempdir().unwrap();
    assert_eq!(
        tune(one.path(), &[&out[..], &["--threads", "1"]].concat())
            .status
            .code(),
        Some(0)
    );
    let one = written(one.path());
    let two = tempfile::tempdir().unwrap();
    let tune_two = || tune(two.path(), &[&out[..], &["--threads", "2"]].concat());
    assert_eq!(tune_two().status.code(), Some(0));
    assert!(one == written(two.path()), "threads");

    // As killed within a line.
    let settings = two.path().join("out/settings.csv");
    let whole = fs::read(&settings).unwrap();
    for part in [0.0, 0.3, 0.9] {
        let cut = (part * whole.len() as f64) as usize;
        fs::write(&settings, &whole[..cut]).unwrap();
        let again = tune_two();
        assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
        assert_eq!(stderr(&again).contains("are there already"), part > 0.0);
        assert!(one == written(two.path()), "cut at {cut}");
    }

    // The contrast: another seed finds other settings, and will not go on with these.
    let other = tune(two.path(), &["--out", "out", "--set", "tune.seed=2"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(
        stderr(&other).contains("holds the settings of another tune"),
        "{}",
        stderr(&other)
    );
    let other = tempfile::tempdir().unwrap();
    tune(other.path(), &["--out", "out", "--set", "tune.seed=2"]);
    assert!(one[0] != written(other.path())[0]);

    // A line that is not the one that comes next.
    let text = String::from_utf8(whole).unwrap();
    let damaged = text.replacen("\n3.2,", "\n3.3,", 1);
    assert_ne!(text, damaged);
    fs::write(&settings, damaged).unwrap();
    let refused = tune_two();
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("settings.csv:3: this is not what the tune writes there"),
        "{}",
        stderr(&refused)
    );
}

/// What cannot be had: exit 1, which requirement must give way, and to what.
#[test]
fn the_requirement_that_must_give_way_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let require = r#"tune.require=["modulus_margin_contact >= 0.5", "peak_abs_acc_mps2 <= 1.2"]"#;
    let output = tune(folder.path(), &["--set", require]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let sentence = text
        .lines()
        .find(|line| line.starts_with("INFEASIBLE"))
        .unwrap();
    assert!(
        sentence.contains("peak_abs_acc_mps2 ≤ 1.2 would have to give way to 1."),
        "{sentence}"
    );
    assert!(!folder.path().join("out/tune-paper-2/tuned.toml").exists());
}

/// Before is what the file has, in or out of the ranges; and the yield's usual tolerances are
/// those of the ready study of that name.
#[test]
fn before_is_the_file_and_the_tolerance_the_ready_studys() {
    let folder = tempfile::tempdir().unwrap();
    let range = r#"tune.range={ "controller.kp" = [3.5, 20] }"#;
    let found = json(&tune(folder.path(), &["--set", range, "--json"]).stdout);
    assert_eq!(found["keys"][0]["before"], "3.2");
    let after: f64 = found["keys"][0]["after"].as_str().unwrap().parse().unwrap();
    assert!(after >= 3.5, "{after}");
    let paper = json(&hil_runner(folder.path(), &["run", "paper-2", "--json"]).stdout);
    let aim = "peak_following_error_mm";
    assert_eq!(
        number(&of(&found["aims"], aim)["before"]),
        number(&paper[aim])
    );

    let study = hil_runner(
        folder.path(),
        &["study", "tolerance", "--base", "paper-2", "--print"],
    );
    let study: toml::Table = String::from_utf8(study.stdout).unwrap().parse().unwrap();
    let drawn = study["axis"].as_array().unwrap().iter().map(|axis| {
        let distribution = axis["distribution"].clone();
        let distribution: hil_core::distribution::Distribution = distribution.try_into().unwrap();
        assert_eq!(axis["times"], axis["key"]);
        format!("{} × {distribution}", axis["key"].as_str().unwrap())
    });
    let drawn: Vec<Value> = drawn.map(Value::from).collect();
    assert_eq!(found["tolerance"]["drawn"], Value::Array(drawn));
}

/// Over several axes no aim gets worse on any of them; where only margins are required, the
/// acceleration gives way to the following error on one.
#[test]
fn over_several_axes_no_aim_gets_worse_on_any() {
    let folder = tempfile::tempdir().unwrap();
    let gaps = ["0.15", "0.3", "0.6"];
    let over = r#"tune.over={ "transmission.backlash_half_deg" = "0.5..2 x" }"#;
    let worst_parts = |out: &str, more: &[&str]| -> [f64; 2] {
        let args = ["tune", "paper-1", "--set", KEYS, "--set", "tune.runs=4000"];
        let args = [&args[..], &["--set", over, "--out", out], more].concat();
        let output = hil_runner(folder.path(), &args);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let figures = |file: &str, gap: &str| -> [f64; 2] {
            let set = format!("transmission.backlash_half_deg={gap}");
            let run = hil_runner(folder.path(), &["run", file, "--set", &set, "--json"]);
            let summary = json(&run.stdout);
            ["peak_following_error_mm", "peak_abs_acc_mps2"].map(|aim| number(&summary[aim]))
        };
        let mut worst = [0.0_f64; 2];
        for gap in gaps {
            let before = figures("paper-1", gap);
            let after = figures(&format!("{out}/tuned.toml"), gap);
            for aim in 0..2 {
                worst[aim] = worst[aim].max(after[aim] / before[aim]);
            }
        }
        worst
    };
    let [following, acceleration] = worst_parts("kept", &[]);
    assert!(
        following < 1.0 && acceleration <= 1.0,
        "{following} {acceleration}"
    );
    let margins = r#"tune.require=["modulus_margin_contact >= 0.5", "modulus_margin_gap >= 0.3"]"#;
    let [following, acceleration] = worst_parts("free", &["--set", margins]);
    assert!(
        following < 1.0 && acceleration > 1.0,
        "{following} {acceleration}"
    );
}

#[test]
fn one_sentence_for_each_mistake() {
    let folder = tempfile::tempdir().unwrap();
    let keys = |keys: &str| format!("tune.keys={keys}");
    let tried = [
        (
            vec![keys(r#"["controller.kp", "controller.tracking_time_s"]"#)],
            "tune.keys has controller.tracking_time_s, which moves none of the figures",
        ),
        (
            vec![KEYS.to_owned(), "tune.runs=20".to_owned()],
            "tune.runs = 20 is not allowed",
        ),
        (
            vec![
                keys(r#"["controller.kp"]"#),
                "tune.minimise={ encoder_bits_used = 1 }".to_owned(),
            ],
            "tune.minimise has encoder_bits_used, which no key of tune.keys moves",
        ),
        (
            vec![
                keys(r#"["controller.kp"]"#),
                r#"tune.range={ "controller.kp" = [5, 5] }"#.to_owned(),
            ],
            "tune.range",
        ),
        (
            vec![
                keys(r#"["controller.kp"]"#),
                r#"tune.require=["modulus_margin_gap >= before"]"#.to_owned(),
            ],
            "modulus_margin_gap takes a number: before serves a figure of runs",
        ),
        (
            vec![keys(r#"["controller.friction_ff_codes"]"#)],
            "has no range: the plant asks for none of it",
        ),
    ];
    for (sets, sentence) in tried {
        let mut args = vec!["tune", "paper-2"];
        args.extend(sets.iter().flat_map(|set| ["--set", set]));
        let output = hil_runner(folder.path(), &args);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(sentence), "{said}\nexpected: {sentence}");
    }
    let output = hil_runner(folder.path(), &["tune", "paper-2"]);
    assert!(
        stderr(&output).contains("paper-2 has no [tune]"),
        "{}",
        stderr(&output)
    );
}
