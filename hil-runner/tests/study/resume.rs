//! A study that is killed and started again is the study that was not.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use crate::support::{STUDY, assert_same, folder_with, made, program, ran, refused};

/// The number of threads changes no byte.
#[test]
fn threads_change_nothing() {
    let folder = folder_with(STUDY);
    for threads in ["1", "2", "7"] {
        made(&folder, &format!("small.toml --threads {threads}"), threads);
    }
    for threads in ["2", "7"] {
        assert_same(&folder.path().join("1"), &folder.path().join(threads));
    }
    // What other rows are is told from these.
    let other = STUDY.replace("seed = 3", "seed = 4");
    fs::write(folder.path().join("small.toml"), other).unwrap();
    made(&folder, "small.toml", "other");
    let csv = |out: &str| fs::read(folder.path().join(out).join("results.csv")).unwrap();
    assert_ne!(csv("1"), csv("other"));
}

/// Contents of the folder of a study that was killed.
#[derive(Debug, Clone, Copy)]
enum Moment {
    /// This file, be it complete or not.
    File(&'static str),
    /// So many bytes of the CSV.
    Bytes(u64),
    /// So many lines of the journal more than its first one.
    Entries(usize),
}

impl Moment {
    fn has_come(self, out: &Path) -> bool {
        match self {
            Self::File(name) => out.join(name).exists(),
            Self::Bytes(bytes) => {
                fs::metadata(out.join("results.csv")).is_ok_and(|file| file.len() >= bytes)
            }
            Self::Entries(entries) => journal_lines(out) > entries,
        }
    }
}

fn journal_lines(out: &Path) -> usize {
    let journal = fs::read_to_string(out.join("results.journal"));
    journal.unwrap_or_default().lines().count()
}

/// Killed (SIGKILL) as soon as this or that is there, and started again until it
/// is complete.
#[test]
fn a_killed_study_goes_on_to_the_same_bytes() {
    let long = STUDY.replace("runs = 1500", "runs = 36000");
    let folder = folder_with(&long);
    let whole = made(&folder, "small.toml", "whole");
    let out = folder.path().join("out");
    for moment in [
        Moment::File("study.toml"),
        Moment::File("base.toml"),
        Moment::File("study.json"),
        Moment::File("results.journal"),
        Moment::File("results.parquet.part"),
        Moment::Bytes(1),
        Moment::Bytes(100_000),
        Moment::Entries(1),
        Moment::Entries(2),
        Moment::Entries(20),
    ] {
        // On one thread it takes long enough for none to come too late.
        let mut child = program(&folder, "small.toml --threads 1 --out out");
        let mut child = child.spawn().unwrap();
        while !moment.has_come(&out) {
            let ended = child.try_wait().unwrap();
            assert!(ended.is_none(), "the study ended before {moment:?}");
            sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!out.join("results.parquet").exists(), "{moment:?}");
        let complete = contents_equal(&whole, &out, "results.csv");
        assert!(!complete, "{moment:?}: the kill came after the last row");
        if let Moment::Entries(_) = moment {
            assert!(journal_lines(&out) < journal_lines(&whole));
        }
        let done = made(&folder, "small.toml", "done");
        assert_same(&whole, &done);
        fs::remove_dir_all(&done).unwrap();
    }
}

fn contents_equal(one: &Path, other: &Path, file: &str) -> bool {
    fs::read(one.join(file)).ok() == fs::read(other.join(file)).ok()
}

/// Whatever of the last writes has reached the disk: every state between two
/// blocks, and torn lines in CSV and journal.
#[test]
fn what_was_being_written_is_written_again() {
    let folder = folder_with(STUDY);
    let whole = made(&folder, "small.toml", "whole");
    let csv = fs::read(whole.join("results.csv")).unwrap();
    let journal = fs::read_to_string(whole.join("results.journal")).unwrap();
    let lines: Vec<&str> = journal.lines().collect();
    let end = |line: usize| -> usize { lines[line].split(',').nth(1).unwrap().parse().unwrap() };
    // Lines of the journal that are there, bytes of the CSV after them, and
    // what stands after the last whole line.
    for (number, (kept, bytes_more, torn)) in [
        (0, 0, ""),
        (0, 5, "block,en"),
        (1, 0, ""),
        (1, 700, "0,1"),
        (2, 0, "1"),
        (9, 1, "8,99"),
        (20, 90_000, ""),
    ]
    .into_iter()
    .enumerate()
    {
        let out = folder.path().join("out");
        fs::create_dir(&out).unwrap();
        for file in ["study.json", "study.toml", "base.toml"] {
            fs::copy(whole.join(file), out.join(file)).unwrap();
        }
        let text: String = lines[..kept]
            .iter()
            .map(|line| format!("{line}\n"))
            .collect();
        fs::write(out.join("results.journal"), text + torn).unwrap();
        let bytes = match kept {
            0 => bytes_more,
            1 => csv.iter().position(|byte| *byte == b'\n').unwrap() + 1 + bytes_more,
            _ => end(kept - 1) + bytes_more,
        };
        fs::write(out.join("results.csv"), &csv[..bytes.min(csv.len())]).unwrap();
        let done = made(&folder, "small.toml", &format!("torn-{number}"));
        assert_same(&whole, &done);
    }
}

/// Files that are not as they were written are named, and stay as they are.
#[test]
fn damage_is_told_and_nothing_is_changed() {
    let folder = folder_with(STUDY);
    let out = folder.path().join("out");
    ran(&folder, "small.toml --out out", 0);
    let [csv, journal] = ["results.csv", "results.journal"].map(|name| out.join(name));
    let (good_csv, good_journal) = (fs::read(&csv).unwrap(), fs::read(&journal).unwrap());
    let damage = |file: &Path, bytes: &[u8], words: &str| {
        fs::write(file, bytes).unwrap();
        let told = ran(&folder, "small.toml --out out", 2);
        assert!(told.contains(words), "{told}");
        assert!(told.contains("nothing was changed"), "{told}");
        assert_eq!(told.lines().count(), 1, "{told}");
        let now = fs::read(file).unwrap();
        assert!(now == bytes, "{} was changed", file.display());
        fs::write(&csv, &good_csv).unwrap();
        fs::write(&journal, &good_journal).unwrap();
        let mut names = crate::support::contents(&out).into_iter();
        assert!(names.all(|(name, _)| name != Path::new("results.parquet.part")));
    };
    let mut flipped = good_csv.clone();
    flipped[good_csv.len() / 2] ^= 1;
    damage(&csv, &flipped, "are not what was written");
    damage(&csv, &good_csv[..good_csv.len() / 2], "ends before byte");
    damage(&csv, b"", "ends before byte");
    damage(&csv, b"a,b\n1,2\n", "ends before byte");
    let mut longer = good_csv.clone();
    longer.extend(b"1,2,3\n");
    damage(&csv, &longer, "goes on after its last row");
    let text = String::from_utf8(good_journal.clone()).unwrap();
    damage(
        &journal,
        text.replacen("\n3,", "\n4,", 1).as_bytes(),
        "stands where block 3 should",
    );
    damage(
        &journal,
        text.replacen("\n3,", "\n3;", 1).as_bytes(),
        "results.journal:5: this is no line of a journal",
    );
    damage(&journal, b"hello\n", "this is no journal of results");
    damage(&journal, b"", "is there without");
    fs::remove_file(&journal).unwrap();
    let told = ran(&folder, "small.toml --out out", 2);
    assert!(told.contains("is there without"), "{told}");
    fs::write(&journal, &good_journal).unwrap();
    fs::remove_file(&csv).unwrap();
    let told = ran(&folder, "small.toml --out out", 2);
    assert!(told.contains("results.journal is there without"), "{told}");
    assert!(!csv.exists());
    fs::write(&csv, &good_csv).unwrap();
    // And whole again it is complete.
    ran(&folder, "small.toml --out out", 0);
}

/// Two at once would write into each other.
#[test]
fn a_folder_belongs_to_one_process() {
    let long = STUDY.replace("runs = 1500", "runs = 400000");
    let folder = folder_with(&long);
    let mut child = program(&folder, "small.toml --out out").spawn().unwrap();
    let csv = folder.path().join("out/results.csv");
    while fs::metadata(&csv).map_or(0, |meta| meta.len()) < 10_000 {
        sleep(Duration::from_millis(5));
    }
    let told = ran(&folder, "small.toml --out out", 2);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(told.contains("another process is at work"), "{told}");
}

#[test]
fn another_study_or_another_folder_is_refused() {
    let folder = folder_with(STUDY);
    ran(&folder, "small.toml --out out", 0);
    let before = crate::support::contents(&folder.path().join("out"));
    let cases = "
small.toml --out out --set controller.ki_per_s=6 => another study small
small.toml --out out --base paper-1 => another study small
small.toml --out out --shard 1/2 => shard 1/1, not 1/2
backlash --out out => study small, not backlash
small.toml --out . => holds
small.toml --out small.toml => small.toml
";
    for told in refused(&folder, cases) {
        assert_eq!(told.lines().count(), 1, "{told}");
    }
    assert!(before == crate::support::contents(&folder.path().join("out")));
    // A file that was appended to is none of ours.
    let other = folder.path().join("mine");
    fs::create_dir(&other).unwrap();
    fs::write(other.join("results.csv"), b"1,2\n").unwrap();
    let told = ran(&folder, "small.toml --out mine", 2);
    let words = "holds results.csv and no results of a study";
    assert!(told.contains(words), "{told}");
    assert_eq!(fs::read(other.join("results.csv")).unwrap(), b"1,2\n");
    // Nor is a study file that is not the one to be run.
    let draft = folder.path().join("draft");
    fs::create_dir(&draft).unwrap();
    fs::write(draft.join("study.toml"), "# my draft\n").unwrap();
    let told = ran(&folder, "small.toml --out draft", 2);
    assert!(told.contains("holds study.toml and no results"), "{told}");
    let kept = fs::read_to_string(draft.join("study.toml")).unwrap();
    assert_eq!(kept, "# my draft\n");
}
