//! A guarded child and its folder are gone, however the one who started it
//! ended.

use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use hil_runner::chip::guard::Guarded;

use crate::support::{processes_in, signal, within};

/// All is gone within this; some 10 ms on an idle machine.
const GONE: Duration = Duration::from_secs(5);

/// A child that ignores what can be ignored, as QEMU does in a semihosting
/// call.
fn stubborn() -> Guarded {
    shell("trap '' TERM INT HUP; exec sleep 1000")
}

/// A child that is a shell script.
pub(crate) fn shell(script: &str) -> Guarded {
    let arguments = ["-c", script].map(Into::into);
    Guarded::start("the fake", Path::new("sh"), arguments).unwrap()
}

fn nothing_left(folder: &Path) -> bool {
    !folder.exists() && processes_in(folder).is_empty()
}

#[test]
fn dropping_it_leaves_nothing() {
    let guarded = stubborn();
    let folder = guarded.folder().to_path_buf();
    assert!(folder.join("to-chip").exists());
    // Guard, helper, child: what is looked for below can be found.
    assert!(within(GONE, || processes_in(&folder).len() >= 3));
    drop(guarded);
    assert!(nothing_left(&folder));
}

#[test]
fn its_end_is_told() {
    for (script, told) in [
        ("exit 0", "the fake has ended"),
        (
            "echo no such board >&2; exit 3",
            "the fake has ended with status 3; it said: no such board",
        ),
        ("kill -9 $$", "the fake has ended with signal 9"),
    ] {
        let mut guarded = shell(script);
        let folder = guarded.folder().to_path_buf();
        assert_eq!(guarded.ended_within(GONE).as_deref(), Some(told));
        // Not only when it is dropped.
        assert!(within(GONE, || nothing_left(&folder)));
    }
}

#[test]
fn program_that_is_missing_is_told() {
    let program = Path::new("/no/such/program");
    let mut guarded = Guarded::start("the fake", program, []).unwrap();
    let told = guarded.ended_within(GONE).unwrap();
    let words = "the fake has ended with status 127; it said:";
    assert!(told.starts_with(words), "{told}");
    assert!(told.contains("/no/such/program"), "{told}");
}

#[test]
fn guard_that_is_killed_is_told_and_leaves_nothing() {
    let mut guarded = stubborn();
    let folder = guarded.folder().to_path_buf();
    // The first to work there.
    let guard = processes_in(&folder).into_iter().min().unwrap();
    signal("KILL", &guard.to_string());
    let told = guarded.ended_within(GONE);
    assert_eq!(
        told.as_deref(),
        Some("the guard of the fake has ended with signal 9")
    );
    drop(guarded);
    assert!(within(GONE, || nothing_left(&folder)));
}

#[test]
fn guard_that_is_terminated_takes_its_child_along() {
    let mut guarded = stubborn();
    let folder = guarded.folder().to_path_buf();
    let guard = processes_in(&folder).into_iter().min().unwrap();
    signal("TERM", &guard.to_string());
    let told = guarded.ended_within(GONE);
    assert_eq!(told.as_deref(), Some("the fake has ended with signal 9"));
    assert!(within(GONE, || nothing_left(&folder)));
}

/// The work of [`starter`] once its child runs.
const END: &str = "CHIP_TEST_STARTER";

/// Not a test: a process that starts a guarded child and ends as it is told.
#[test]
#[ignore = "a process that other tests start"]
fn starter() {
    let Ok(end) = std::env::var(END) else { return };
    let guarded = stubborn();
    println!("folder {}", guarded.folder().display());
    match end.as_str() {
        "exit" => std::process::exit(0),
        "panic" => panic!("as it was told"),
        _ => std::thread::sleep(Duration::from_secs(1000)),
    }
}

/// Starts [`starter`] as the leader of a process group, as a terminal does;
/// gives its child's folder.
fn start(end: &str) -> (Child, PathBuf) {
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "guard::starter", "--ignored", "--nocapture"])
        .env(END, end)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .process_group(0)
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let folder = lines
        .map_while(Result::ok)
        .find_map(|line| Some(PathBuf::from(line.split_once("folder ")?.1)));
    (child, folder.unwrap())
}

#[test]
fn however_its_starter_ends_nothing_is_left() {
    for end in ["exit", "panic"] {
        let (mut starter, folder) = start(end);
        starter.wait().unwrap();
        assert!(within(GONE, || nothing_left(&folder)), "{end}");
    }
    for end in ["KILL", "TERM", "INT", "HUP"] {
        let (mut starter, folder) = start(end);
        assert!(within(GONE, || processes_in(&folder).len() >= 3));
        // To all of its group, as Ctrl-C at a terminal.
        signal(end, &format!("-{}", starter.id()));
        starter.wait().unwrap();
        assert!(within(GONE, || nothing_left(&folder)), "{end}");
    }
}

#[test]
fn interrupt_at_the_terminal_is_for_the_starter_alone() {
    let (mut starter, folder) = start("stay");
    assert!(within(GONE, || processes_in(&folder).len() >= 3));
    for process in processes_in(&folder) {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
        // Behind the name in brackets: state, parent, group.
        let group = stat.rsplit(')').next().unwrap().split_whitespace().nth(2);
        assert_ne!(group.unwrap(), starter.id().to_string());
    }
    starter.kill().unwrap();
    starter.wait().unwrap();
    assert!(within(GONE, || nothing_left(&folder)));
}

/// The contrast: a child without a guard outlives its starter.
#[test]
fn child_without_a_guard_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut shell = Command::new("sh")
        .args(["-c", "sleep 1000 & wait"])
        .current_dir(folder.path())
        .spawn()
        .unwrap();
    assert!(within(GONE, || processes_in(folder.path()).len() == 2));
    shell.kill().unwrap();
    shell.wait().unwrap();
    let left = processes_in(folder.path());
    assert_eq!(left.len(), 1);
    signal("KILL", &left[0].to_string());
}
