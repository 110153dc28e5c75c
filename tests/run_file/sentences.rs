//! Every kind of error with its exact sentence.
//!
//! `sentences.txt` holds blocks of changes to the base file (`-` old, `+` new,
//! `\n` for a line break) and the lines that the changed file prints. With
//! `BLESS=1 cargo test -p bench-tests --test run_file` it is written anew.

use hil_runner::files;

use super::{BASE, messages};

const GOLDEN: &str = include_str!("sentences.txt");

/// The text behind a `-` or `+`.
fn change(line: &str, sign: char) -> Option<&str> {
    let rest = line.strip_prefix(sign)?;
    Some(rest.strip_prefix(' ').unwrap_or(rest))
}

/// The changed file of a block.
fn apply(block: &str) -> String {
    let mut text = BASE.to_owned();
    let mut from = String::new();
    for line in block.lines() {
        if let Some(old) = change(line, '-') {
            from = old.replace("\\n", "\n");
            assert_eq!(text.matches(&from).count(), 1, "{from:?}");
        } else if let Some(new) = change(line, '+') {
            text = text.replace(&from, &new.replace("\\n", "\n"));
        }
    }
    text
}

#[test]
fn every_kind_of_error_has_its_sentence() {
    let mut printed = Vec::new();
    for block in GOLDEN.trim_end().split("\n\n") {
        let changes = block.lines().filter(|line| line.starts_with(['-', '+']));
        let mut lines: Vec<String> = changes.map(str::to_owned).collect();
        let told = messages(&apply(block), &[]);
        lines.extend(told.iter().map(|m| format!("  {m}")));
        printed.push(lines.join("\n"));
    }
    let printed = printed.join("\n\n") + "\n";
    if std::env::var_os("BLESS").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/run_file/sentences.txt");
        std::fs::write(path, &printed).unwrap();
    }
    for (printed, golden) in printed.split("\n\n").zip(GOLDEN.split("\n\n")) {
        assert_eq!(printed.trim_end(), golden.trim_end());
    }
    assert_eq!(printed, GOLDEN);
}

#[test]
fn the_base_file_is_right() {
    assert_eq!(messages(BASE, &[]), [""; 0]);
}

#[test]
fn all_errors_are_reported_at_once_in_the_order_of_the_file() {
    let text = BASE
        .replace("inertia_kg_m2 = 2e-4", "inertia_kg_m2 = 0")
        .replace("inductance_h = 6.5e-3\n", "")
        .replace("gear_ratio = 2", "gear_ratio = 2\ncolour = 1")
        .replace("law = \"sampled\"", "law = \"analogue\"")
        .replace("[0.25, 0.0, 0.25, 0.0", "[0, 0, 0, 0.0");
    assert_eq!(
        messages(&text, &["controller.kp=abc", "motor"]),
        [
            "cases/x.toml: [motor] (line 1) lacks inductance_h: armature inductance L, H, greater than 0",
            "cases/x.toml:2: motor.inertia_kg_m2 = 0 is not allowed: the rotor inertia J_m must be greater than 0 kg m²",
            "cases/x.toml:8: unknown key transmission.colour; the keys of [transmission] are gear_ratio, joint, stiffness_nm_per_rad, damping_nms_per_rad, backlash_half_deg, screw_inertia_kg_m2, screw_inertia_kg_cm2, screw_pitch_mm_per_rev, stiffness_n_per_um, damping_ns_per_m, backlash_um, start, no_pull",
            "cases/x.toml:27: controller.law = \"analogue\" is not allowed: the control law must be \"continuous\", \"sampled\", \"quantised\" or \"firmware\"",
            "cases/x.toml:35: motion.intervals_s = [0, 0, 0, 0.0, 0.25, 0.0, 0.25] is not allowed: t1, t2 and t3 are all 0; the motion needs an acceleration",
            "--set motor: there is no =; write --set section.key=value",
            "--set controller.kp=abc: controller.kp = abc is not allowed: the proportional gain K_p must be a number, at least 0 codes/count, not a string",
        ]
    );
}

/// The sentences on a screen, in the order of the file, and the number of others.
#[test]
fn of_very_many_errors_the_first_are_listed() {
    let printed = |unknown: usize| -> Vec<String> {
        let sections = (0..unknown).map(|n| format!("[strange{n}]\n"));
        messages(&(BASE.to_owned() + &sections.collect::<String>()), &[])
    };
    assert_eq!(printed(20).len(), 20);
    let many = printed(20_000);
    assert_eq!(many.len(), 21);
    let lines = BASE.lines().count();
    for (place, message) in many[..20].iter().enumerate() {
        let line = lines + place + 1;
        let start = format!("cases/x.toml:{line}: unknown section [strange{place}]");
        assert!(message.starts_with(&start), "{message}");
    }
    assert_eq!(many[20], "and 19980 more mistakes");
}

#[test]
fn an_empty_file_lacks_every_required_section() {
    let lines = messages("", &[]);
    let sections = "motor transmission carriage drive encoder controller motion run";
    let sections: Vec<&str> = sections.split(' ').collect();
    assert_eq!(lines.len(), sections.len());
    for (line, section) in lines.iter().zip(sections) {
        let start = format!("cases/x.toml: lacks the section [{section}] with ");
        assert!(line.starts_with(&start), "{line}");
    }
}

#[test]
fn lines_are_right_with_other_line_ends_and_a_byte_order_mark() {
    let wrong = BASE.replace("kp = 3.2", "kp = -3.2");
    let expected = messages(&wrong, &[]);
    assert!(expected[0].starts_with("cases/x.toml:28: "));
    assert_eq!(messages(&wrong.replace('\n', "\r\n"), &[]), expected);
    assert_eq!(messages(&format!("\u{feff}{wrong}"), &[]), expected);
}

#[test]
fn unreadable_files_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let write = |name: &str, bytes: &[u8]| std::fs::write(path(name), bytes).unwrap();
    write("latin.toml", b"[motor]\n# Tr\xe4gheit\n");
    write("large.toml", &vec![b' '; 2 << 20]);
    write("mine.toml", BASE.as_bytes());
    let directory = "this is a directory; give a run file (TOML) or a built-in case";
    let none = "there is no such file; the built-in cases are paper-1, paper-2, paper-3, paper-4, paper-2-12bit";
    for (name, sentence) in [
        (".", directory),
        (
            "latin.toml",
            "not UTF-8 text (line 2); save the file as UTF-8",
        ),
        (
            "large.toml",
            "more than 1 MiB; a run file has a few kilobytes",
        ),
        ("none.toml", none),
    ] {
        let errors = files::case(&path(name), &[]).unwrap_err();
        assert_eq!(errors.to_string(), format!("{}: {sentence}", path(name)));
    }
    let errors = files::case(&path("mine"), &[]).unwrap_err().to_string();
    let mean = format!("did you mean {}?", path("mine.toml"));
    assert!(errors.ends_with(&mean), "{errors}");
    let errors = files::case("paper-3.toml", &[]).unwrap_err();
    let called = "paper-3.toml: there is no such file; the built-in case is called paper-3";
    assert_eq!(errors.to_string(), called);
    let errors = files::case("", &[]).unwrap_err();
    assert_eq!(errors.to_string(), ": the name of the run file is empty");
    assert_eq!(files::case(&path("mine.toml"), &[]).unwrap().name, "mine");
}
