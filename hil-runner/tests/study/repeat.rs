//! The command line that a page, a Parquet part and a message show makes the
//! same study again.
#![cfg(unix)]

use std::fs;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::support::{self, assert_same, folder_with, made, messages, program, ran, shell};

const STUDY: &str = include_str!("studies/repeat.toml");

/// The command line of a page, without what HTML makes of it.
fn repeat_it(page: &str) -> String {
    let from = page.find("hil-runner study").unwrap();
    let line = page[from..].split('<').next().unwrap().to_owned();
    let signs = [
        ("&#x27;", "'"),
        ("&#x2f;", "/"),
        ("&quot;", "\""),
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&amp;", "&"),
    ];
    let plain = |line: String, (html, sign): (&str, &str)| line.replace(html, sign);
    signs.into_iter().fold(line, plain)
}

#[test]
fn a_shell_takes_the_line_of_the_page() {
    let folder = folder_with(STUDY);
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("it's $HOME [x]")).unwrap();
    fs::rename(at("small.toml"), at("it's $HOME [x]/small \"1\".toml")).unwrap();
    let base = hil_core::runfile::builtin_text("paper-1").unwrap();
    fs::write(at("own `axis`; *.toml"), base).unwrap();
    let arguments = [
        "it's $HOME [x]/small \"1\".toml",
        "--base",
        "own `axis`; *.toml",
        "--set",
        "motion.intervals_s=[0.02, 0.05, 0.02, 0.05, 0.02, 0.05, 0.02]",
        "--set",
        "name='a \"$b\" !'",
        "--set",
        "budget={peak_abs_voltage_v = 99, final_error_um = 1e9}",
        "--out",
        "my results/$1 [2]",
    ];
    fs::create_dir(at("my results")).unwrap();
    let made = program(&folder, "").args(arguments).output();
    messages(&made.unwrap(), 0);
    let out = at("my results/$1 [2]");
    let line = repeat_it(&fs::read_to_string(out.join("report.html")).unwrap());
    assert!(line.ends_with("--out 'my results/$1 [2]'"), "{line}");
    fs::rename(&out, at("first")).unwrap();
    let again = shell(folder.path(), &line);
    messages(&again, 0);
    assert_same(&at("first"), &out);
    // The contrast: what was shown before quoting does not make it.
    let plain = ["hil-runner", "study"].into_iter().chain(arguments);
    let plain = plain.collect::<Vec<_>>().join(" ");
    fs::remove_dir_all(&out).unwrap();
    assert!(!shell(folder.path(), &plain).status.success());
    assert!(!out.exists());
}

/// Without `--out` there is none in the line, and the folder is that of the
/// command.
#[test]
fn the_line_has_what_was_given() {
    let folder = folder_with(STUDY);
    ran(&folder, "small.toml", 0);
    let page = folder.path().join("out/study-small/report.html");
    let line = repeat_it(&fs::read_to_string(page).unwrap());
    assert_eq!(line, "hil-runner study small.toml");
}

/// The message of a study that was interrupted shows the line that goes on.
#[test]
fn the_line_of_an_interrupted_study_goes_on() {
    let folder = folder_with(&support::STUDY.replace("runs = 1500", "runs = 20000"));
    let whole = made(&folder, "small.toml", "whole");
    let out = folder.path().join("out");
    let mut child = program(&folder, "small.toml --threads 1 --out out");
    let child = child.stderr(Stdio::piped()).spawn().unwrap();
    while fs::metadata(out.join("results.csv")).map_or(0, |csv| csv.len()) < 10_000 {
        sleep(Duration::from_millis(1));
    }
    let id = child.id().to_string();
    let interrupt = Command::new("kill").args(["-INT", &id]).status();
    assert!(interrupt.unwrap().success());
    let told = messages(&child.wait_with_output().unwrap(), 2);
    let line = told.lines().find_map(|line| line.split_once("to go on: "));
    let (_, line) = line.unwrap();
    assert_eq!(line, "hil-runner study small.toml --out out");
    let rows = |folder: &std::path::Path| fs::read(folder.join("results.csv")).unwrap().len();
    assert!(rows(&out) < rows(&whole));
    messages(&shell(folder.path(), line), 0);
    assert_same(&whole, &out);
}
