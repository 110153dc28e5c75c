//! The studies that are part of the program.

use std::path::Path;

use hil_runner::study::{Changes, Study, ready};

use crate::support::{folder_with, messages, ran, said, study};

/// Each is listed, printed, read, and has what its pictures need.
#[test]
fn every_ready_study_is_right() {
    let folder = tempfile::TempDir::new().unwrap();
    let listed = study(&folder, "--list");
    messages(&listed, 0);
    let listed = said(&listed);
    let names: Vec<&str> = ready::names().collect();
    assert_eq!(names.len(), 7);
    for name in names {
        assert!(listed.contains(name), "{listed}");
        let printed = said(&study(&folder, &format!("--print {name}")));
        let text = Study::text(name, &Changes::default()).unwrap();
        let line = printed.strip_suffix(&text).unwrap();
        assert!(line.starts_with("#:schema ./study.schema.json\n"), "{line}");
        let read = Study::load(name, &Changes::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(read.name, name);
        assert!(!read.pictures.is_empty(), "{name} has no picture");
        // The page in the docs, with each picture.
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/studies");
        let page = std::fs::read_to_string(docs.join(format!("{name}.md"))).unwrap();
        assert!(page.contains(&format!("hil-runner study {name}")), "{name}");
        for picture in &read.pictures {
            let shown = format!("({}.svg)", picture.file);
            assert!(page.contains(&shown), "{name}: {shown}");
        }
    }
}

/// The pictures of the docs are what the command draws, byte for byte, on any
/// machine.
#[test]
fn the_pictures_of_the_docs_are_those_of_the_command() {
    let folder = tempfile::TempDir::new().unwrap();
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/studies");
    for name in ready::names() {
        ran(&folder, &format!("{name} --out {name}"), 0);
        for picture in &Study::load(name, &Changes::default()).unwrap().pictures {
            let file = format!("{}.svg", picture.file);
            let drawn = std::fs::read(folder.path().join(name).join(&file)).unwrap();
            let kept = std::fs::read(docs.join(&file)).unwrap();
            let what = format!("docs/studies/{file} is not what `hil-runner study {name}` draws");
            assert!(drawn == kept, "{what}");
        }
        assert!(folder.path().join(name).join("report.html").exists());
    }
}

/// Commands that a reader copies work as they stand.
#[test]
fn the_examples_of_the_docs_are_made() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    for (file, pictures) in [("STUDIES.md", 0), ("PICTURES.md", 2)] {
        let page = std::fs::read_to_string(docs.join(file)).unwrap();
        let example = page.split("```toml\n").nth(1).unwrap();
        let example = example.split("```").next().unwrap();
        let folder = folder_with(example);
        let output = study(&folder, "small.toml --out out");
        assert!(messages(&output, 0).is_empty(), "{file}");
        let rate = String::from_utf8_lossy(&output.stderr);
        assert!(rate.ends_with(" runs/s\n"), "{rate}");
        let drawn = std::fs::read_dir(folder.path().join("out")).unwrap();
        let svg = |entry: &std::fs::DirEntry| entry.path().extension() == Some("svg".as_ref());
        assert_eq!(drawn.flatten().filter(svg).count(), pictures, "{file}");
    }
}

/// The study that docs/PLANT.md measures.
#[test]
fn the_million_can_be_made() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../benches/million.toml");
    for law in ["quantised", "firmware"] {
        let changes = Changes {
            sets: vec![format!("controller.law={law}")],
            ..Changes::default()
        };
        let read = Study::load(file, &changes).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((read.rows(), read.name.as_str()), (1_000_000, "million"));
        let case = read.case(&read.point(999_999), 0).unwrap();
        assert_eq!(case.controller.law.name(), law);
    }
}
