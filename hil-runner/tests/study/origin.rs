//! The origin of results lies beside them, and is known to be theirs.

use std::fs;
use std::path::Path;

use crate::support::{STUDY, assert_same, contents, folder_with, made, ran, study};

/// A file that is missing, longer, shorter or has another digit; resuming,
/// merging and making a row each say which one, and change nothing.
#[test]
fn a_damaged_or_missing_file_is_told_by_name() {
    let folder = folder_with(&STUDY.replace("runs = 1500", "runs = 100"));
    let out = folder.path().join("out");
    made(&folder, "small.toml --set controller.ki_per_s=6", "good");
    let good = contents(&folder.path().join("good"));
    let commands = [
        "small.toml --set controller.ki_per_s=6 --out out",
        "merge merged out",
        "out --row 0",
    ];
    let restore = || {
        let _ = fs::remove_dir_all(&out);
        for (name, bytes) in &good {
            let path = out.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    };
    type Damage = fn(&str) -> Option<String>;
    let missing: Damage = |_| None;
    let longer: Damage = |text| Some(text.to_owned() + "\n");
    let shorter: Damage = |text| Some(text[..text.len() / 2].to_owned());
    let empty: Damage = |_| Some(String::new());
    // Its last digit is another one.
    let digit: Damage = |text| {
        let at = text.rfind(|c: char| c.is_ascii_digit())?;
        let other = if &text[at..=at] == "1" { "2" } else { "1" };
        Some(text[..at].to_owned() + other + &text[at + 1..])
    };
    let sets: Damage = |text| Some(text.replace("ki_per_s=6", "ki_per_s=5"));
    for name in ["study.toml", "base.toml", "study.json"] {
        let mut damages = vec![missing, longer, shorter, empty, digit];
        if name == "study.json" {
            damages.push(sets);
        }
        for (number, damage) in damages.into_iter().enumerate() {
            restore();
            let path = out.join(name);
            let text = fs::read_to_string(&path).unwrap();
            match damage(&text) {
                None => fs::remove_file(&path).unwrap(),
                Some(damaged) => {
                    assert_ne!(damaged, text, "{name} {number}");
                    fs::write(&path, damaged).unwrap();
                }
            }
            let before = contents(&out);
            for command in commands {
                let told = ran(&folder, command, 2);
                assert!(told.contains(name), "{name} {number} {command:?}: {told}");
                let what = ["is missing", "is not what was written"][number.min(1)];
                assert!(told.contains(what), "{name} {number} {command:?}: {told}");
                assert_eq!(told.lines().count(), 1, "{told}");
                assert!(before == contents(&out), "{name} {number} {command:?}");
                assert!(!folder.path().join("merged").exists());
            }
        }
    }
    // The contrast: what is whole is taken by all three.
    restore();
    for command in commands {
        let output = study(&folder, command);
        assert!(output.status.code().unwrap() < 2, "{command}: {output:?}");
    }
}

/// Results of another version are not taken for damaged ones.
#[test]
fn another_version_is_named() {
    let folder = folder_with(&STUDY.replace("runs = 1500", "runs = 10"));
    made(&folder, "small.toml", "old");
    let path = folder.path().join("old/study.json");
    fs::write(
        &path,
        r#"{"study": "small", "format": 1, "version": "0.0.9", "rows": 20}"#,
    )
    .unwrap();
    for command in ["small.toml --out old", "merge merged old", "old --row 0"] {
        let told = ran(&folder, command, 2);
        let words = "old holds results of version 0.0.9, format 1, not of";
        assert!(told.contains(words), "{told}");
    }
}

/// Shards are put together where neither the study file nor its base is any
/// more, and another axis stands under the base's name.
#[test]
fn a_merge_needs_the_folders_alone() {
    let text = STUDY
        .replace("base = \"paper-2\"", "base = \"axis.toml\"")
        .replace("runs = 1500", "runs = 300");
    let folder = folder_with(&text);
    let at = |name: &str| folder.path().join(name);
    let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/paper-2.toml");
    let base = fs::read_to_string(base).unwrap();
    fs::write(at("axis.toml"), &base).unwrap();
    let whole = made(&folder, "small.toml", "whole");
    for shard in ["1/2", "2/2"] {
        let name = shard.replace('/', "-of-");
        made(&folder, &format!("small.toml --shard {shard}"), &name);
    }
    let other = base.replace("mass_kg = 50.0", "mass_kg = 80.0");
    assert_ne!(base, other);
    fs::write(at("axis.toml"), &other).unwrap();
    let changed = made(&folder, "small.toml", "changed");
    let found = fs::read(changed.join("results.csv")).unwrap();
    assert_ne!(found, fs::read(whole.join("results.csv")).unwrap());
    for files in [&["small.toml", "axis.toml"][..], &[]] {
        ran(&folder, "merge out 2-of-2 1-of-2", 0);
        assert_same(&whole, &at("out"));
        fs::remove_dir_all(at("out")).unwrap();
        for file in files {
            fs::remove_file(at(file)).unwrap();
        }
    }
    // Nor does it matter where they lay while a shard was made.
    fs::create_dir(at("other")).unwrap();
    fs::write(at("other/small.toml"), &text).unwrap();
    fs::write(at("other/axis.toml"), &base).unwrap();
    made(&folder, "other/small.toml --shard 2/2", "elsewhere");
    ran(&folder, "merge out 1-of-2 elsewhere", 0);
    assert_same(&whole, &at("out"));
    fs::remove_dir_all(at("out")).unwrap();
    // Of a base that was changed in between, shards are not of one study.
    fs::write(at("small.toml"), &text).unwrap();
    fs::write(at("axis.toml"), &other).unwrap();
    made(&folder, "small.toml --shard 2/2", "changed-2");
    let told = ran(&folder, "merge out 1-of-2 changed-2", 2);
    assert!(told.contains("are not shards of the same study"), "{told}");
    assert!(!at("out").exists());
}
