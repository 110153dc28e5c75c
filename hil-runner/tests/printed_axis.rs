//! `hil-runner scaling --rust` and `--c` print an axis that compiles, and that is the
//! one of the run.
//!
//! `BLESS=1 cargo test -p hil-runner --test printed_axis` rewrites the files
//! after an intended change; with `CI` set it refuses.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

/// What the command printed, pasted.
#[allow(
    clippy::panic,
    clippy::unreadable_literal,
    missing_docs,
    unreachable_pub,
    reason = "a constant of an image ends its build where something is refused"
)]
mod printed_axis {
    #[rustfmt::skip]
    pub(crate) mod dual;
    #[rustfmt::skip]
    pub(crate) mod everything;
    #[rustfmt::skip]
    pub(crate) mod paper;
}

use std::path::Path;
use std::process::{Command, Output};

use firmware::{Axis, Settings};
use hil_core::controllers::{Setup, compensated};
use hil_core::runfile::builtin;

/// Every part of an axis on the motor's encoder that can be off, on.
const EVERYTHING: &str = include_str!("printed_axis/everything.txt");

/// The position from the load.
const DUAL: [&str; 4] = [
    "controller.derivative=measurement",
    "controller.feedback=dual",
    "load_encoder.counts_per_mm=1000",
    "limits.count_jump_counts=300",
];

fn scaling(language: &str, sets: &[&str], more: &[&str]) -> Output {
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_hil-runner"));
    let command = command.args(["scaling", "paper-2", language]);
    command.args(sets).args(more).output().unwrap()
}

/// The axis of the run.
fn axis(sets: &[&str]) -> Axis {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let case = builtin("paper-2", &sets).unwrap();
    let setup = Setup::of(&case, case.controller.sample_time_ns.unwrap()).unwrap();
    compensated(&setup, setup.law().unwrap().law).unwrap()
}

#[test]
fn the_printed_constant_is_the_axis_of_the_run() {
    let everything: Vec<&str> = EVERYTHING.lines().collect();
    for (file, sets, printed) in [
        ("paper", &[][..], printed_axis::paper::AXIS),
        ("everything", &everything, printed_axis::everything::AXIS),
        ("dual", &DUAL, printed_axis::dual::AXIS),
    ] {
        let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/printed_axis");
        let path = here.join(file).with_extension("rs");
        let output = scaling("--rust", sets, &[]);
        assert!(output.status.success(), "{output:?}");
        if std::env::var_os("BLESS").is_some() {
            assert!(std::env::var_os("CI").is_none(), "not rewritten in CI");
            std::fs::write(&path, &output.stdout).unwrap();
            continue;
        }
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text, std::fs::read_to_string(&path).unwrap(), "{file}");
        assert_eq!(printed, axis(sets), "{file}");
    }
    // The contrast: an axis is told from that of one setting less.
    assert_ne!(printed_axis::dual::AXIS, axis(&DUAL[..3]));
}

/// The words of the printed initialiser, as a program in C has them.
fn words_in_c(sets: &[&str]) -> Vec<u32> {
    let output = scaling("--c", sets, &[]);
    assert!(output.status.success(), "{output:?}");
    let folder = tempfile::tempdir().unwrap();
    let [source, program] = ["axis.c", "axis"].map(|name| folder.path().join(name));
    let main = "#include <stdio.h>\nint main(void) {\n  const uint32_t *word = (const void *)&axis;\n  \
                for (unsigned i = 0; i < sizeof axis / 4; i++) printf(\"%u\\n\", (unsigned)word[i]);\n  \
                return 0;\n}\n";
    std::fs::write(&source, [&output.stdout, main.as_bytes()].concat()).unwrap();
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware/c/include");
    let mut compiler = Command::new("cc");
    compiler.args([
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Werror",
        "-I",
    ]);
    let compiler = compiler.arg(header).arg(source).arg("-o").arg(&program);
    assert!(compiler.status().unwrap().success());
    let printed = Command::new(program).output().unwrap().stdout;
    let lines = String::from_utf8(printed).unwrap();
    lines.lines().map(|line| line.parse().unwrap()).collect()
}

#[test]
fn the_printed_initialiser_has_the_words_of_the_run() {
    let everything: Vec<&str> = EVERYTHING.lines().collect();
    for sets in [&[][..], &everything, &DUAL] {
        let words = Settings::of(&axis(sets)).to_words();
        assert_eq!(words_in_c(sets), words);
    }
    // The contrast: words are told from those of one setting less.
    assert_ne!(
        words_in_c(&DUAL),
        Settings::of(&axis(&DUAL[..3])).to_words()
    );
}

#[test]
fn one_axis_at_a_time() {
    for (language, more, sentence) in [
        (
            "--rust",
            "paper-1",
            "--rust prints the axis of one case, not of 2",
        ),
        (
            "--c",
            "paper-1",
            "--c prints the axis of one case, not of 2",
        ),
        (
            "--c",
            "--rust",
            "--rust and --c each print an axis of their own: give one of them",
        ),
    ] {
        let output = scaling(language, &[], &[more]);
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(sentence), "{said}");
    }
}
