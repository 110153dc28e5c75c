//! The README shows what its commands print. Every block that begins with
//! `$ hil-runner` is run and compared; lines about the host's clock are left
//! out, as they are in the README.
//!
//! `BLESS=1 cargo test -p hil-runner --test readme` rewrites the blocks after
//! an intended change; with `CI` set it refuses.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::process::Command;

const README: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md");

/// Output of a command: standard output, or the messages if there is none.
fn output_of(arguments: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(arguments.split_whitespace())
        .current_dir(folder.path())
        .output()
        .unwrap();
    let bytes = match output.stdout.as_slice() {
        [] => &output.stderr,
        _ => &output.stdout,
    };
    let text = String::from_utf8(bytes.clone()).unwrap();
    let lines = text.lines().filter(|line| !line.contains(": host step "));
    lines
        .map(|line| line.trim_end().to_owned() + "\n")
        .collect()
}

/// The text with the output of every command in it as it is now, and the
/// number of commands.
fn refreshed(text: &str) -> (String, usize) {
    let (mut fresh, mut commands, mut skipping) = (String::new(), 0, false);
    for line in text.lines() {
        if line == "```" {
            skipping = false;
        }
        if skipping {
            continue;
        }
        fresh += line;
        fresh += "\n";
        if let Some(arguments) = line.strip_prefix("$ hil-runner") {
            fresh += &output_of(arguments);
            commands += 1;
            skipping = true;
        }
    }
    (fresh, commands)
}

#[test]
fn readme_shows_what_its_commands_print() {
    let bless = std::env::var_os("BLESS").is_some();
    let in_ci = std::env::var_os("CI").is_some();
    assert!(!(bless && in_ci), "the README is not rewritten in CI");
    let text = std::fs::read_to_string(README).unwrap();
    let (fresh, commands) = refreshed(&text);
    assert_eq!(commands, 4);
    if bless {
        std::fs::write(README, &fresh).unwrap();
        return;
    }
    for (shown, printed) in text.lines().zip(fresh.lines()) {
        assert_eq!(shown, printed);
    }
    assert_eq!(text, fresh);
}

/// The contrast: a wrong digit is found.
#[test]
fn a_wrong_digit_is_found() {
    let text = "```text\n$ hil-runner run paper-9\nno such thing\n```\n";
    let (fresh, commands) = refreshed(text);
    assert_eq!(commands, 1);
    assert_ne!(fresh, text);
    assert!(fresh.contains("paper-2-12bit"), "{fresh}");
}
