//! A study small enough for tests, and the program that makes it.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

use crate::table::table;

/// 3,000 short runs on two rungs, some of which cannot be made.
pub(crate) const STUDY: &str = include_str!("studies/small.toml");

/// A folder with a study file.
pub(crate) fn folder_with(study: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("small.toml"), study).unwrap();
    folder
}

/// The command `study` in a folder, with the words of a line.
pub(crate) fn program(folder: impl AsRef<Path>, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hil-runner"));
    command.current_dir(folder).arg("study");
    command.args(line.split_whitespace());
    command
}

/// Runs `study` with the words of a line.
pub(crate) fn study(folder: impl AsRef<Path>, line: &str) -> Output {
    program(folder.as_ref(), line).output().unwrap()
}

/// The messages of `study` with the words of a line; it must end with `status`.
pub(crate) fn ran(folder: impl AsRef<Path>, line: &str, status: i32) -> String {
    messages(&study(folder, line), status)
}

/// Makes a study and moves its results to `name`. All are made into `out`, since
/// the page shows the command line with its `--out`.
pub(crate) fn made(folder: impl AsRef<Path>, line: &str, name: &str) -> PathBuf {
    let folder = folder.as_ref();
    ran(folder, &format!("{line} --out out"), 0);
    let moved = folder.join(name);
    fs::rename(folder.join("out"), &moved).unwrap();
    moved
}

/// The program's messages but for the rate of its runs; it must end with `status`.
pub(crate) fn messages(output: &Output, status: i32) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{text}");
    let lines = text.split_inclusive('\n');
    lines.filter(|line| !line.ends_with(" runs/s\n")).collect()
}

/// Panics unless every line `arguments => words` of a table ends with status 2
/// and a message with these words; the messages.
#[track_caller]
pub(crate) fn refused(folder: impl AsRef<Path>, cases: &str) -> Vec<String> {
    let told = table(cases).into_iter().map(|(line, words)| {
        let told = ran(&folder, &line, 2);
        assert!(told.contains(&words), "{line}\n{told}");
        told
    });
    told.collect()
}

/// What the program says on standard output.
pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The rows of a folder of results: every cell by the name of its column.
pub(crate) fn results(folder: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(folder.join("results.csv")).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

/// Every file of a folder of results with its bytes, by name.
pub(crate) fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_owned();
                files.push((name, fs::read(&path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

/// Panics unless two folders hold the same files with the same bytes.
#[track_caller]
pub(crate) fn assert_same(one: &Path, other: &Path) {
    let (one, other) = (contents(one), contents(other));
    let names = |files: &[(PathBuf, Vec<u8>)]| -> Vec<PathBuf> {
        files.iter().map(|(name, _)| name.clone()).collect()
    };
    assert_eq!(names(&one), names(&other));
    for ((name, one), (_, other)) in one.iter().zip(&other) {
        assert!(one == other, "{} differs", name.display());
    }
}

/// Runs a line in a shell, with the program on its path.
pub(crate) fn shell(folder: &Path, line: &str) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_hil-runner"));
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", program.parent().unwrap().display());
    let mut shell = Command::new("sh");
    shell.args(["-c", line]).current_dir(folder);
    shell.env("PATH", path).output().unwrap()
}
