//! docs/CONTROLLER.md shows what its commands print. Every command behind a
//! `$` is run; what stands below it must be part of what it prints. Line breaks
//! do not count: the page folds long messages.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::process::Command;

const PAGE: &str = include_str!("../../docs/CONTROLLER.md");

/// The words of a text with one space between them.
fn folded(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// `NAME="…"` in the page's first block of settings.
fn variables(page: &str) -> Vec<(String, String)> {
    let assignments = page.lines().filter_map(|line| {
        let (name, value) = line.split_once("=\"")?;
        let name_only = name.chars().all(|c| c.is_ascii_uppercase());
        let value = value.strip_suffix('"')?;
        name_only.then(|| (format!("${name}"), value.to_owned()))
    });
    assignments.collect()
}

/// Commands with what the page shows below them.
fn shown(page: &str) -> Vec<(String, String)> {
    let mut commands: Vec<(String, String)> = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        if line.starts_with("```") {
            inside = false;
        } else if let Some(command) = line.strip_prefix("$ hil-runner ") {
            commands.push((command.to_owned(), String::new()));
            inside = true;
        } else if let (true, Some((command, text))) = (inside, commands.last_mut()) {
            match command.strip_suffix('\\') {
                Some(begun) => *command = format!("{begun}{line}"),
                None => *text += &format!("{line}\n"),
            }
        }
    }
    commands
}

/// Everything that a command prints.
fn printed(command: &str, variables: &[(String, String)]) -> String {
    let command = variables
        .iter()
        .fold(command.to_owned(), |command, (name, value)| {
            command.replace(name, value)
        });
    let output = Command::new(env!("CARGO_BIN_EXE_hil-runner"))
        .args(command.split_whitespace())
        .output()
        .unwrap();
    let both = [output.stdout, output.stderr].concat();
    folded(&String::from_utf8(both).unwrap())
}

#[test]
fn the_page_shows_what_its_commands_print() {
    let variables = variables(PAGE);
    let commands = shown(PAGE);
    assert!(commands.len() >= 11, "{} commands", commands.len());
    for (command, text) in &commands {
        let (text, printed) = (folded(text), printed(command, &variables));
        assert!(!text.is_empty(), "{command}");
        assert!(printed.contains(&text), "{command}\n{text}\n{printed}");
    }
}

/// The contrast: a wrong digit is found.
#[test]
fn a_wrong_digit_is_found() {
    let page = "```text\n$ hil-runner measure-backlash \\\n  paper-9\nno such case 8\n```\n";
    let [(command, text)] = &shown(page)[..] else {
        panic!("one command: {:?}", shown(page));
    };
    assert_eq!(folded(command), "measure-backlash paper-9");
    assert!(!printed(command, &[]).contains(&folded(text)));
}
