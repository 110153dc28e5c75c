//! `include/servo.h` is that of the sources, and C and C++ read it.
//!
//! `BLESS=1 cargo test -p firmware-c --test header` writes it anew.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use firmware::{Event, FaultCause, Settings, State};

/// Numbers with names, as the sources have them.
fn numbered<T: Copy>(
    of: &str,
    prefix: &str,
    all: &[T],
    pair: fn(T) -> (&'static str, u32),
) -> String {
    let mut text = format!("enum {of} {{\n");
    for (name, number) in all.iter().copied().map(pair) {
        let name = name.to_uppercase().replace('-', "_");
        writeln!(text, "  {prefix}_{name} = {number},").unwrap();
    }
    text + "};\n\n"
}

/// What is made of tables of the firmware.
fn tables() -> String {
    let mut text = "\n/** State of an axis. */\n".to_owned();
    text += &numbered("servo_state", "SERVO_STATE", &State::ALL, |s| {
        (s.name(), s as u32)
    });
    text += "/** Request for another state. */\n";
    let requests = Event::ALL.into_iter();
    let requests: Vec<Event> = requests
        .filter(|e| !matches!(e, Event::MotionEnded | Event::Fail))
        .collect();
    text += &numbered("servo_event", "SERVO_EVENT", &requests, |e| {
        (e.name(), e as u32)
    });
    text += "/** Cause of a fault, the most urgent first. */\n";
    text += &numbered("servo_cause", "SERVO_CAUSE", &FaultCause::ALL, |c| {
        (c.name(), c as u32)
    });
    text += "/**\n * Settings of an axis, as `hil-runner scaling CASE --c` prints them. A limit of\n \
             * 2^32 - 1 is none.\n */\ntypedef struct servo_settings {\n";
    for ((name, meaning), [least, most]) in Settings::NAMES
        .iter()
        .zip(Settings::MEANINGS)
        .zip(Settings::RANGES)
    {
        let meaning = meaning.replace(['\\', '`'], "");
        writeln!(
            text,
            "  /**{meaning} {least} to {most}. */\n  uint32_t {name};"
        )
        .unwrap();
    }
    text + "} servo_settings;"
}

#[test]
fn the_header_is_that_of_the_sources_and_c_reads_it() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config = cbindgen::Config::from_file(here.join("cbindgen.toml")).unwrap();
    config.after_includes = Some(tables());
    let made = cbindgen::Builder::new()
        .with_config(config)
        .with_src(here.join("src/lib.rs"))
        .with_src(here.join("src/structures.rs"));
    let mut text = Vec::new();
    made.generate().unwrap().write(&mut text);
    // Brackets of units are escaped in Rust alone.
    let text = String::from_utf8(text).unwrap().replace('\\', "");
    let path = here.join("include/servo.h");
    if std::env::var_os("BLESS").is_some() {
        assert!(std::env::var_os("CI").is_none(), "not rewritten in CI");
        std::fs::write(&path, &text).unwrap();
    }
    assert_eq!(text, std::fs::read_to_string(&path).unwrap());
    c99_and_cpp_read_it();
}

/// Behind the comparison, which may write it.
fn c99_and_cpp_read_it() {
    let compiles = |compiler: &str, standard: &str| {
        let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/servo.h");
        let mut command = Command::new(compiler);
        command.args([
            standard,
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "-fsyntax-only",
        ]);
        command.arg(header).output().unwrap().status.success()
    };
    assert!(compiles("cc", "-std=c99"));
    assert!(compiles("c++", "-std=c++11"));
    // The contrast: C89 has neither such comments nor such numbers.
    assert!(!compiles("cc", "-std=c89"));
}
