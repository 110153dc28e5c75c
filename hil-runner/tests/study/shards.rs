//! Shards, and what becomes of them.

use std::fs;

use crate::support::{STUDY, assert_same, contents, folder_with, made, ran};

#[test]
fn merged_shards_are_the_study() {
    let folder = folder_with(STUDY);
    let whole = made(&folder, "small.toml", "whole");
    for number in 1..=5 {
        let shard = format!("{number}/5");
        made(
            &folder,
            &format!("small.toml --shard {shard}"),
            &number.to_string(),
        );
    }
    let out = folder.path().join("out");
    ran(&folder, "merge out 3 1 5 2 4", 0);
    assert_same(&whole, &out);
    // A merge that was ended goes on, and one that is complete stays so.
    let journal = out.join("results.journal");
    let text = fs::read_to_string(&journal).unwrap();
    let kept: Vec<&str> = text.lines().take(12).collect();
    fs::write(&journal, kept.join("\n") + "\n").unwrap();
    for _ in 0..2 {
        ran(&folder, "merge out 1 2 3 4 5", 0);
        assert_same(&whole, &out);
    }
}

#[test]
fn shards_that_do_not_belong_together_are_refused() {
    let folder = folder_with(STUDY);
    let make = |shard: &str, out: &str| {
        let line = format!("small.toml --shard {shard} --out {out}");
        ran(&folder, &line, 0);
    };
    make("1/2", "one");
    make("2/2", "two");
    make("2/3", "third");
    // A shard that was ended.
    let journal = folder.path().join("two/results.journal");
    let text = fs::read_to_string(&journal).unwrap();
    for (shards, words) in [
        ("one", "shards are missing: 2/2"),
        ("one one two", "shard 1/2 is given twice"),
        ("one third", "are not shards of the same study"),
        ("one nowhere", "nowhere/study.json"),
    ] {
        let told = ran(&folder, &format!("merge merged {shards}"), 2);
        assert!(told.contains(words), "{told}");
        assert!(!folder.path().join("merged").exists(), "{words}");
    }
    let kept: Vec<&str> = text.lines().take(5).collect();
    fs::write(&journal, kept.join("\n") + "\n").unwrap();
    let told = ran(&folder, "merge merged one two", 2);
    assert!(told.contains("shard 2/2 is not complete"), "{told}");
    // A merge reads shards and nothing more, from anywhere.
    fs::write(&journal, text).unwrap();
    let before = contents(&folder.path().join("two"));
    fs::remove_file(folder.path().join("small.toml")).unwrap();
    ran(&folder, "merge merged one two", 0);
    assert!(before == contents(&folder.path().join("two")));
}
