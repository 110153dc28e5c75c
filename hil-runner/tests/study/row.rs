//! `hil-runner study OUT --row N`: a row as a run of its own.
#![cfg(unix)]

use std::fs;

use hil_core::figures::SUMMARY_FIGURES;
use serde_json::Value;

use crate::support::{
    contents, folder_with, made, messages, program, refused, results, shell, study,
};

/// Every kind of axis and value, on every rung; some points are left out, some
/// make no run.
const STUDY: &str = include_str!("studies/every-rung.toml");

/// The line with the equivalent command.
fn command(printed: &str) -> String {
    let line = printed
        .lines()
        .find_map(|line| line.strip_prefix("the same run: "));
    line.unwrap().to_owned()
}

/// The contents of a page, but for the time that the host took.
fn shown(page: &[u8]) -> Value {
    let page = std::str::from_utf8(page).unwrap();
    let (_, data) = page.split_once("id=\"plot-data\">").unwrap();
    let mut shown: Value = serde_json::from_str(data.split("</script>").next().unwrap()).unwrap();
    for case in shown["cases"].as_array_mut().unwrap() {
        assert!(case["traces"].is_object() || case["traces"].is_array());
        case["host_timing"] = Value::Null;
    }
    shown
}

/// The figures of a row, of its run, and of the command that is printed for it:
/// all the same, to the last bit; with the gains as they are and scaled.
#[test]
fn a_row_its_run_and_the_printed_command_are_one() {
    for loop_gain in ["per-count", "constant"] {
        let text = STUDY.replace("LOOP_GAIN", loop_gain);
        let folder = folder_with(&text);
        let base = hil_core::runfile::builtin_text("paper-2").unwrap();
        fs::write(folder.path().join("axis.toml"), base).unwrap();
        let out = made(&folder, "small.toml", "a b");
        fs::remove_file(folder.path().join("axis.toml")).unwrap();
        fs::remove_file(folder.path().join("small.toml")).unwrap();
        let before = contents(&out);
        let (mut made, mut peaks) = ([0; 4], Vec::new());
        let (mut excluded, mut refused) = (0, 0);
        for (number, row) in results(&out).iter().enumerate() {
            let field = |name: &str| row[name].as_str();
            let number = number.to_string();
            let mut of_row = program(&folder, "");
            let output = of_row.args(["a b", "--row", &number]).output().unwrap();
            if field("status") != "ok" {
                let told = messages(&output, 2);
                assert!(told.contains(field("reason")), "{told}");
                assert!(told.contains(field("status")), "{told}");
                assert!(!out.join(format!("row-{number}.html")).exists());
                excluded += usize::from(field("status") == "excluded");
                refused += usize::from(field("status") == "refused");
                continue;
            }
            let passes = field("pass") == "true";
            messages(&output, i32::from(!passes));
            let line = command(&String::from_utf8(output.stdout).unwrap());
            let outputs = "--summary s.json --report s.html --trace s.csv";
            let again = shell(folder.path(), &format!("{line} {outputs}"));
            messages(&again, i32::from(!passes));
            let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
            assert!(bytes(&format!("a b/row-{number}.csv")) == bytes("s.csv"));
            let [of_row, of_command] = [format!("a b/row-{number}.html"), "s.html".to_owned()]
                .map(|it| shown(&bytes(&it)));
            assert!(of_row == of_command, "{line}");
            assert_eq!(of_row["command_line"], *line);
            let summary = String::from_utf8(bytes("s.json")).unwrap();
            let summary = |key: &str| {
                let begin = format!("  \"{key}\": ");
                let line = summary.lines().find_map(|line| line.strip_prefix(&begin));
                line.map(|value| value.trim_end_matches(',').to_owned())
            };
            let name = format!("\"every-rung row {number}\"");
            assert_eq!(summary("name"), Some(name));
            let law = format!("\"{}\"", field("rung"));
            assert_eq!(summary("law"), Some(law));
            for figure in SUMMARY_FIGURES {
                let cell = field(figure.key);
                let cell: Option<f64> = (!cell.is_empty()).then(|| cell.parse().unwrap());
                // Without supervision a summary has no faults, which are none.
                let of_run = match summary(figure.key) {
                    None => (figure.key == "faults").then_some(0.0),
                    Some(null) if null == "null" => None,
                    // To the last bit, as a number of JSON is not read.
                    Some(number) => Some(number.parse().unwrap()),
                };
                assert_eq!(cell, of_run, "{} of row {number}: {line}", figure.key);
            }
            made[number.parse::<usize>().unwrap() % 4] += 1;
            peaks.push(field("peak_following_error_mm").to_owned());
        }
        assert!(made.iter().all(|made| *made >= 4), "{made:?}");
        assert!(excluded > 0 && refused > 0, "{excluded} {refused}");
        // The contrast: other rows have other figures.
        peaks.sort();
        peaks.dedup();
        assert!(peaks.len() > made.iter().sum::<usize>() / 2, "{peaks:?}");
        // And nothing but the rows' own files was written.
        let kept: Vec<_> = contents(&out)
            .into_iter()
            .filter(|(name, _)| !name.to_string_lossy().starts_with("row-"))
            .collect();
        assert!(kept == before);
    }
}

/// A row that is not made yet, and one that another shard makes.
#[test]
fn the_plan_alone_decides_what_a_row_is() {
    let text = STUDY
        .replace("LOOP_GAIN", "per-count")
        .replace("axis.toml", "paper-2");
    let folder = folder_with(&text);
    let whole = made(&folder, "small.toml", "whole");
    let rows = results(&whole);
    let made_rows = (0..rows.len()).filter(|row| rows[*row]["status"] == "ok");
    let made_rows: Vec<String> = made_rows.map(|row| row.to_string()).collect();
    let (first, last) = (&made_rows[0], &made_rows[made_rows.len() - 1]);
    let shard = made(&folder, "small.toml --shard 1/2", "shard");
    let begun = folder.path().join("begun");
    fs::create_dir(&begun).unwrap();
    for file in ["study.toml", "base.toml", "study.json"] {
        fs::copy(whole.join(file), begun.join(file)).unwrap();
    }
    for row in [first, last] {
        let name = format!("row-{row}.csv");
        for out in ["whole", "shard", "begun"] {
            let output = study(&folder, &format!("{out} --row {row}"));
            assert!(output.status.code().unwrap() < 2, "{output:?}");
        }
        let trace = fs::read(whole.join(&name)).unwrap();
        assert!(trace == fs::read(shard.join(&name)).unwrap());
        assert!(trace == fs::read(begun.join(&name)).unwrap());
    }
    let trace = |row: &str| fs::read(whole.join(format!("row-{row}.csv"))).unwrap();
    assert!(trace(first) != trace(last));
}

/// A profile lies beside the base, not among the results: a row finds it there, and other
/// points are another study.
#[test]
fn the_points_of_a_profile_are_part_of_the_study() {
    let base = hil_core::runfile::builtin_text("paper-2").unwrap();
    let of_intervals =
        |line: &&str| line.starts_with("travel_mm") || line.starts_with("intervals_s");
    let base: String = (base.lines().filter(|line| !of_intervals(line)))
        .map(|line| line.to_owned() + "\n")
        .collect();
    let base = base.replace("[motion]\n", "[motion]\nprofile = \"move.csv\"\n");
    let text = "base = \"axis.toml\"\n[[axis]]\nkey = \"controller.kp\"\nvalues = [3, 4]\n";
    let folder = folder_with(text);
    let write = |file: &str, text: &str| fs::write(folder.path().join(file), text).unwrap();
    write("axis.toml", &base);
    write("move.csv", "t_s,x_mm\n0,0\n0.5,40\n1,100\n");
    let out = made(&folder, "small.toml", "results");
    let output = study(&folder, "results --row 1");
    assert!(output.status.code().unwrap() < 2, "{output:?}");
    let line = command(&String::from_utf8(output.stdout).unwrap());
    let again = shell(folder.path(), &format!("{line} --trace again.csv"));
    assert!(again.status.code().unwrap() < 2, "{again:?}");
    let bytes = |path: &std::path::Path| fs::read(path).unwrap();
    let again = bytes(&folder.path().join("again.csv"));
    assert!(bytes(&out.join("row-1.csv")) == again);
    write("move.csv", "t_s,x_mm\n0,0\n0.5,40\n1,101\n");
    let told = messages(&study(&folder, "small.toml --out results"), 2);
    assert!(told.contains("holds results of another study"), "{told}");
}

#[test]
fn mistakes_have_a_sentence() {
    let text = STUDY
        .replace("LOOP_GAIN", "per-count")
        .replace("axis.toml", "paper-2");
    let folder = folder_with(&text);
    let out = made(&folder, "small.toml", "made");
    fs::create_dir(folder.path().join("empty")).unwrap();
    let before = contents(&out);
    let cases = "
made --row 48 => row 48 is not allowed: the rows of study every-rung are 0 to 47
made --row=-1 => --row
made --row x => --row
empty --row 0 => empty holds no results of a study: empty/study.json is missing
small.toml --row 0 => small.toml/study.json
made --row 0 --set controller.kp=1 => cannot be used with
made --report x.html => --row
made => made: this is a folder of results; --row N
made --row 0 --trace made/results.csv => made/results.csv is part of the results of the study
made --row 0 --report made/base.toml => made/base.toml is part of the results of the study
made --row 0 --report x --trace x => x is given for two outputs
";
    for case in cases.trim().lines() {
        refused(&folder, case);
        assert!(before == contents(&out), "{case}");
    }
}
