//! The README and four pages of the docs show what their commands print. Every
//! block that begins with `$ hil-runner` is run, those of a page in one folder, and
//! compared; lines about the host's clock are left out, as they are on the pages. A block
//! of TOML whose first line is `# NAME.toml` is that file of the folder.
//!
//! `BLESS=1 cargo test -p hil-runner --test readme` rewrites the blocks after
//! an intended change; with `CI` set it refuses.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::process::Command;

/// The pages, from the project's root, and the number of commands on each.
const PAGES: [(&str, usize); 5] = [
    ("README.md", 2),
    ("docs/OUTPUTS.md", 2),
    ("docs/RUN-FILES.md", 1),
    ("docs/OWN-AXIS.md", 6),
    ("docs/TUNING.md", 6),
];

/// Output of a command: standard output, or the messages if there is none; nothing
/// where it goes into a file of the folder.
fn output_of(arguments: &str, folder: &Path) -> String {
    let (arguments, file) = match arguments.split_once(" > ") {
        Some((arguments, file)) => (arguments, Some(file)),
        None => (arguments, None),
    };
    let output = Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap();
    if let Some(file) = file {
        std::fs::write(folder.join(file), output.stdout).unwrap();
        return String::new();
    }
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
    let folder = tempfile::tempdir().unwrap();
    let (mut fresh, mut commands, mut skipping) = (String::new(), 0, false);
    let mut file: Option<String> = None;
    for line in text.lines() {
        if line == "```" {
            skipping = false;
            file = None;
        }
        if let Some(file) = &file {
            let path = folder.path().join(file);
            let known = std::fs::read_to_string(&path).unwrap_or_default();
            std::fs::write(path, known + line + "\n").unwrap();
        }
        if let Some(name) = line
            .strip_prefix("# ")
            .filter(|name| name.ends_with(".toml"))
            && fresh.ends_with("```toml\n")
        {
            file = Some(name.to_owned());
        }
        if skipping {
            continue;
        }
        fresh += line;
        fresh += "\n";
        if let Some(arguments) = line.strip_prefix("$ hil-runner") {
            fresh += &output_of(arguments, folder.path());
            commands += 1;
            skipping = true;
        }
    }
    (fresh, commands)
}

#[test]
fn pages_show_what_their_commands_print() {
    let bless = std::env::var_os("BLESS").is_some();
    let in_ci = std::env::var_os("CI").is_some();
    assert!(!(bless && in_ci), "pages are not rewritten in CI");
    for (page, expected) in PAGES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(page);
        let text = std::fs::read_to_string(&path).unwrap();
        let (fresh, commands) = refreshed(&text);
        assert_eq!(commands, expected, "{page}");
        if bless {
            std::fs::write(&path, &fresh).unwrap();
            continue;
        }
        for (shown, printed) in text.lines().zip(fresh.lines()) {
            assert_eq!(shown, printed, "{page}");
        }
        assert_eq!(text, fresh, "{page}");
    }
}

/// The README is a first page, and the rest stands in the docs.
#[test]
fn readme_is_short() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let lines = std::fs::read_to_string(readme).unwrap().lines().count();
    assert!(lines <= 200, "{lines} lines");
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
