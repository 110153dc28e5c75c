//! The golden vectors: `firmware/link/vectors/*.txt` against the axis, rebuilt from
//! the text alone. `BLESS=1` writes the files anew.

#![allow(clippy::expect_used, reason = "a test stops where its setup fails")]

#[path = "../../tests/rig/mod.rs"]
mod rig;
mod vectors;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Once;

use firmware_link::vectors::{ALL, File, What, replay, report};
use vectors::scenarios;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("vectors")
}

/// The stored files, by name; written first where that was asked for.
fn stored() -> BTreeMap<String, String> {
    // Once, and before any test reads: they run side by side.
    static BLESSED: Once = Once::new();
    BLESSED.call_once(|| {
        if std::env::var_os("BLESS").is_some_and(|bless| bless == "1") {
            for (name, text) in scenarios::all() {
                let path = folder().join(name).with_extension("txt");
                std::fs::write(path, text).expect("the folder of the vectors");
            }
        }
    });
    let files = std::fs::read_dir(folder()).expect("the folder of the vectors");
    files
        .map(|file| file.expect("a file").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "txt"))
        .map(|path| {
            let name = path.file_stem().expect("a name").to_string_lossy();
            let text = std::fs::read_to_string(&path).expect("a text file");
            (name.into_owned(), text)
        })
        .collect()
}

#[test]
fn every_row_of_every_file_is_what_the_axis_gives() {
    let mut rows = 0;
    for (name, text) in stored() {
        let replayed = replay(&text).unwrap_or_else(|part| {
            let line = text.lines().nth(part.line - 1).unwrap_or_default();
            panic!("{name}.txt:{}: {:?}: {line}", part.line, part.what)
        });
        assert!(replayed >= 80, "{name}: {replayed} rows");
        rows += replayed;
    }
    assert!(rows > 2_000, "{rows}");
}

#[test]
fn the_files_are_those_of_the_scenarios() {
    let stored = stored();
    let scenarios = scenarios::all();
    let names: Vec<&str> = scenarios.iter().map(|(name, _)| *name).collect();
    for (name, text) in &scenarios {
        assert_eq!(stored.get(*name), Some(text), "{name}");
    }
    assert_eq!(stored.len(), names.len(), "a file without scenario");
    let size: usize = stored.values().map(String::len).sum();
    println!("{} files, {size} bytes", stored.len());
    assert!(size < 400_000, "{size} bytes");
}

/// One call for a board: all of the folder, and the first row that differs.
#[test]
fn a_report_says_what_is_equal_and_what_is_not() {
    let mut names: Vec<String> = stored().into_keys().map(|name| name + ".txt").collect();
    names.sort();
    assert_eq!(names, ALL.map(|(name, _)| name));
    let said = |files: &[File]| {
        let mut line = String::new();
        let equal = report(files.iter().copied(), &mut line).expect("a string takes it");
        (equal, line)
    };
    assert_eq!(
        said(&ALL),
        (true, "5518 rows of 35 files, all equal\n".into())
    );

    // Contrast: the first row of the last file wants another code.
    let mut files = ALL;
    let (_, text) = &mut files[34];
    *text = text.replacen("| 0 0 disabled", "| 1 0 disabled", 1).leak();
    let differs = "wrap-32.txt, line 10: the axis gives 0 0 disabled 0 0 -; \
                   the file has - 0 2147483448 - 0 0 none | 1 0 disabled 0 0 -\n";
    assert_eq!(said(&files), (false, differs.into()));
}

/// The lines of a file that set something, with their place.
fn settings(text: &str) -> Vec<(usize, &str)> {
    let lines = text.lines().enumerate();
    lines
        .filter(|(_, line)| line.contains('=') && !line.starts_with('#'))
        .collect()
}

/// The text with another line in the place of one.
fn with_line(text: &str, place: usize, line: &str) -> String {
    let lines = text.lines().enumerate();
    let lines: Vec<&str> = lines
        .map(|(at, old)| if at == place { line } else { old })
        .collect();
    lines.join("\n")
}

/// Contrast: a flipped bit in the mantissa of a gain. The upper 5 of its bits
/// are noticed in every file, however short.
#[test]
fn a_flipped_bit_in_a_word_is_noticed() {
    let (mut flipped, mut lower, mut lower_noticed) = (0, 0, 0);
    // The runs into a fault are too short to tell an integral gain to 8 bits.
    let runs = stored()
        .into_iter()
        .filter(|(name, _)| !name.starts_with("fault"));
    for (name, text) in runs {
        for (place, line) in settings(&text) {
            let (key, value) = line.split_once(" = ").expect("a setting");
            let gains = ["kp", "ki_dt", "kd_per_dt"];
            if !(gains.contains(&key) || key.ends_with("_ff") || key == "filter") {
                continue;
            }
            let (mantissa, bits) = value.split_once(' ').expect("a word");
            let mantissa: i32 = mantissa.parse().expect("a mantissa");
            for bit in 0..31 {
                let other = format!("{key} = {} {bits}", mantissa ^ (1 << bit));
                let noticed = replay(&with_line(&text, place, &other)).is_err();
                if bit + 5 >= 31 - mantissa.leading_zeros().saturating_sub(1) {
                    assert!(noticed, "{name}: {other} for {line}");
                    flipped += 1;
                } else {
                    lower += 1;
                    lower_noticed += i32::from(noticed);
                }
            }
        }
    }
    println!("{flipped} upper bits, {lower_noticed} of {lower} lower ones noticed");
    assert!(flipped > 250, "{flipped}");
}

/// Contrast: every setting of every file does something there; but for the
/// declared ranges, which decide on acceptance only.
#[test]
fn a_setting_left_out_is_noticed() {
    let ranges = ["error_bits", "integral_bits"];
    for (name, text) in stored() {
        for (place, line) in settings(&text) {
            let (key, _) = line.split_once(" = ").expect("a setting");
            let noticed = replay(&with_line(&text, place, "")).is_err();
            assert!(noticed || ranges.contains(&key), "{name}: {line}");
        }
    }
}

/// Contrast: one more in the whole part of each number of a stretch, one sample
/// less, and the other direction.
#[test]
fn another_stretch_is_noticed() {
    let text = &stored()["stretches"];
    let mut noticed = 0;
    for (place, line) in text.lines().enumerate() {
        let Some((inputs, words)) = line.split_once(" stretch ") else {
            continue;
        };
        let (words, outputs) = words.split_once(" | ").expect("a row");
        let words: Vec<i32> = words
            .split(' ')
            .map(|word| word.parse().expect("a word"))
            .collect();
        // The third differences act from the fourth sample on.
        if words[14] < 4 {
            continue;
        }
        // A direction on the way back waits for the end of the one before.
        let direction = (!inputs.starts_with('-')).then_some(15);
        for word in (1..14).step_by(2).chain([14]).chain(direction) {
            let mut other = words.clone();
            other[word] = match word {
                14 => words[word] - 1,
                // From 1 to −1, or back.
                15 => words[word] ^ 0xfe,
                _ => words[word] + 1,
            };
            let other: Vec<String> = other.iter().map(ToString::to_string).collect();
            let line = format!("{inputs} stretch {} | {outputs}", other.join(" "));
            assert!(replay(&with_line(text, place, &line)).is_err(), "{line}");
            noticed += 1;
        }
    }
    assert_eq!(noticed, 54 * 8 + 2);
}

/// Contrast: each number of an output, one off.
#[test]
fn another_output_is_noticed() {
    for (name, text) in stored() {
        let rows: Vec<(usize, &str)> = text
            .lines()
            .enumerate()
            .filter(|(_, line)| line.contains('|'))
            .collect();
        for &(place, line) in rows.iter().step_by(17) {
            let (inputs, outputs) = line.split_once(" | ").expect("a row");
            let columns: Vec<&str> = outputs.split(' ').collect();
            for (column, value) in columns.iter().enumerate() {
                let Ok(number) = value.parse::<i64>() else {
                    continue;
                };
                let mut other: Vec<String> = columns.iter().map(ToString::to_string).collect();
                other[column] = (number ^ 1).to_string();
                let text = with_line(&text, place, &format!("{inputs} | {}", other.join(" ")));
                let part = replay(&text).expect_err("another output");
                let outputs = matches!(part.what, What::Outputs(_));
                assert_eq!((part.line, outputs), (place + 1, true), "{name}");
            }
        }
    }
}
