//! Sentences of the program: `said/refused.txt` has those for inputs that it
//! refuses, `said/help.txt` the help of every command, both with the exit
//! status. A block is a title (`#`), the line for the shell (`$`), both streams
//! and the status. `scripts/net` runs the same lines.
//!
//! `BLESS=1 cargo test -p hil-runner --test said` rewrites the files after an
//! intended change; with `CI` set it refuses.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// Output of the shell for a line, in an empty folder, and the exit status.
fn shown(line: &str) -> (String, i32) {
    let folder = tempfile::tempdir().unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_hil-runner"));
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", program.parent().unwrap().display());
    let output = Command::new("sh")
        .args(["-c", &format!("exec 2>&1\n{line}")])
        .env("PATH", path)
        .current_dir(folder.path())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    (text, output.status.code().unwrap())
}

/// A title and the line for the shell, which may be several.
#[derive(Debug)]
struct Block {
    title: String,
    line: String,
}

fn blocks(text: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for line in text.lines() {
        if let Some(title) = line.strip_prefix("# ") {
            let (title, line) = (title.to_owned(), String::new());
            blocks.push(Block { title, line });
        } else if let Some(command) = line.strip_prefix("$ ") {
            blocks.last_mut().unwrap().line += &format!("{command}\n");
        }
    }
    blocks
}

/// A block as it stands in the file, with the output of now.
fn refreshed(block: &Block) -> String {
    let (text, status) = shown(&block.line);
    let mut fresh = format!("# {}\n", block.title);
    for command in block.line.lines() {
        fresh += &format!("$ {command}\n");
    }
    // How long runs took is another matter every time.
    for line in text.lines().filter(|line| !line.ends_with(" runs/s")) {
        fresh += format!("  {line}").trim_end();
        fresh += "\n";
    }
    fresh + &format!("exit {status}\n")
}

/// The blocks of a file that is as the program is now, read and printed again.
fn checked(name: &str) -> (Vec<Block>, Vec<String>) {
    let bless = std::env::var_os("BLESS").is_some();
    let in_ci = std::env::var_os("CI").is_some();
    assert!(!(bless && in_ci), "{name} is not rewritten in CI");
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/said");
    let path = path.join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let blocks = blocks(&text);
    let fresh: Vec<String> = blocks.iter().map(refreshed).collect();
    if bless {
        std::fs::write(&path, fresh.join("\n")).unwrap();
        return (blocks, fresh);
    }
    for fresh in &fresh {
        assert!(text.contains(fresh), "{name} has not:\n{fresh}");
    }
    let whole = fresh.join("\n") == text;
    assert!(whole, "{name} has more than its blocks, or their order");
    (blocks, fresh)
}

#[test]
fn refused_inputs_get_their_sentence() {
    let (blocks, fresh) = checked("refused.txt");
    assert!(blocks.len() >= 40);
    for (place, (block, fresh)) in blocks.iter().zip(&fresh).enumerate() {
        assert!(fresh.ends_with("\nexit 2\n"), "{fresh}");
        let before = &blocks[..place];
        let known = before.iter().any(|other| other.title == block.title);
        assert!(!known, "there are two of {}", block.title);
    }
}

#[test]
fn every_command_has_its_help_here() {
    let (blocks, _) = checked("help.txt");
    let (help, _) = shown("hil-runner --help");
    let commands = help.split("Commands:\n").nth(1).unwrap();
    let commands = commands.split("\n\n").next().unwrap().lines();
    for command in commands.map(|line| line.split_whitespace().next().unwrap()) {
        let line = format!("hil-runner {command} --help\n");
        assert!(
            command == "help" || blocks.iter().any(|block| block.line == line),
            "said/help.txt lacks hil-runner {command} --help"
        );
    }
}

/// The options of a command's help that none of its examples has.
fn without_example(help: &str) -> Vec<&str> {
    let (about, examples) = help.split_once("Example").unwrap_or((help, ""));
    let (_, options) = about.split_once("Options:").unwrap_or_default();
    let options = options.lines().filter_map(|line| {
        let long = line.trim_start().strip_prefix("--")?;
        long.split([' ', '\n']).next()
    });
    let shown = |name: &str| examples.contains(&format!(" --{name} "));
    options.filter(|name| !shown(name)).collect()
}

/// Whoever looks an option up sees it used.
#[test]
fn every_option_has_an_example() {
    let help = include_str!("said/help.txt").replace('\n', " \n");
    let blocks = help
        .split("\n# ")
        .filter(|block| block.contains("Options:"));
    let blocks: Vec<&str> = blocks.collect();
    assert!(blocks.len() > 12);
    for block in &blocks {
        assert_eq!(without_example(block), [""; 0], "{block}");
        assert!(block.contains("Example"), "{block}");
    }
    // The contrast: an option without its example.
    let ladder = blocks
        .iter()
        .find(|block| block.starts_with("ladder"))
        .unwrap();
    let fewer = ladder.replace(" --junit verdicts.xml ", "");
    assert_eq!(without_example(&fewer), ["junit"]);
}

/// The contrast: another word, another status and another command are found.
#[test]
fn a_change_is_found() {
    let said = "# a verb that is none\n$ hil-runner fly\n";
    let fresh = refreshed(&blocks(said)[0]);
    assert!(fresh.starts_with(said) && fresh.ends_with("\nexit 2\n"));
    assert!(fresh.contains("  error: unrecognized subcommand 'fly'\n"));
    let of = |line: &str| refreshed(&blocks(&format!("# a verb that is none\n$ {line}\n"))[0]);
    assert_eq!(of("hil-runner fly"), fresh);
    for other in ["hil-runner flee", "hil-runner fly; exit 1", "true"] {
        assert_ne!(of(other), fresh);
    }
}
