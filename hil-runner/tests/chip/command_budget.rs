//! `hil-runner budget` as a script sees it: the committed goldens hold, and one
//! that is 4 % off does not.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use hil_runner::chip::spec::{Target, Transport};

use crate::targets::targets;

fn budget(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hil-runner"));
    command.arg("budget").args(args).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn goldens_of_the_m4_hold_and_one_that_is_4_percent_off_does_not() {
    let here = targets("the budget of the m4", Transport::Fifo);
    if !here.contains(&Target::M4) {
        return;
    }
    let committed =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware/cortex-m/goldens/m4.toml");
    let output = budget(&["m4"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = stdout(&output);
    assert!(
        !text.contains("FAIL") && text.contains("tick, everything"),
        "{text}"
    );
    let output = budget(&["m4", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let targets: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(targets[0]["target"], "m4");
    let figures = targets[0]["figures"].as_array().unwrap();
    let tick = figures
        .iter()
        .find(|row| row["figure"] == "tick, everything");
    let most = tick.unwrap()["measured"]["max"].to_string();
    let row = text
        .lines()
        .find(|line| line.starts_with("tick, everything "));
    assert!(
        row.unwrap().contains(&format!(" {most} ")),
        "{most}: {row:?}"
    );
    assert!(figures.iter().all(|row| row["pass"] == true));

    // The same goldens, but for the most of one.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m4.toml");
    let goldens = fs::read_to_string(committed).unwrap();
    let line = goldens
        .lines()
        .find(|line| line.starts_with("\"tick, everything\""))
        .unwrap();
    let (before, rest) = line.split_once("max = ").unwrap();
    let (most, rest) = rest.split_once(',').unwrap();
    let most: u32 = most.parse().unwrap();
    let worse = format!("{before}max = {},{rest}", most * 100 / 104);
    fs::write(&path, goldens.replace(line, &worse)).unwrap();
    let folder = folder.path().to_str().unwrap();
    let output = budget(&["m4", "--goldens", folder]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let text = stdout(&output);
    let failed: Vec<&str> = text.lines().filter(|line| line.contains("FAIL")).collect();
    assert!(
        matches!(failed[..], [line] if line.starts_with("tick, everything ")),
        "{text}"
    );
    let told = String::from_utf8_lossy(&output.stderr);
    let advice = format!("`hil-runner budget m4 --goldens {folder} --bless`");
    assert!(told.contains(&advice), "{told}");

    // Goldens that are not there are no measurement that has failed.
    let empty = tempfile::tempdir().unwrap();
    let output = budget(&["m4", "--goldens", empty.path().to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("m4.toml is not there; --bless writes it")
    );

    // Blessed, it says what has changed and holds.
    let output = budget(&["m4", "--goldens", folder, "--bless"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = stdout(&output);
    assert!(text.contains("m4: tick, everything: max "), "{text}");
    assert_eq!(budget(&["m4", "--goldens", folder]).status.code(), Some(0));
}

#[test]
fn file_that_has_no_goldens_is_refused_with_its_name() {
    let here = targets("goldens that cannot be read", Transport::Fifo);
    if !here.contains(&Target::M4) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("m4.toml"), "[instruction]\n").unwrap();
    let output = budget(&["m4", "--goldens", folder.path().to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("m4.toml is no file of goldens"), "{told}");
}
