//! The studies that are part of the program.

use std::io::Read;
use std::path::Path;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::read::GzDecoder;
use hil_core::number::significant;
use hil_runner::study::picture::Kind;
use hil_runner::study::{Changes, Study, ready};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::check::{false_marks, lost, wrong};
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

/// The specification that a picture of the docs says it was drawn from, by its hash.
fn source(svg: &str) -> Option<&str> {
    let (_, rest) = svg.split_once(", SHA-256 ")?;
    rest.split_once(" -->").map(|(hash, _)| hash)
}

/// The pictures of the docs are drawn from what the command writes, byte for byte, on
/// any machine.
#[test]
fn the_pictures_of_the_docs_are_those_of_the_command() {
    let folder = tempfile::TempDir::new().unwrap();
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/studies");
    for name in ready::names() {
        ran(&folder, &format!("{name} --out {name}"), 0);
        for picture in &Study::load(name, &Changes::default()).unwrap().pictures {
            let file = &picture.file;
            let written = folder.path().join(name).join(format!("{file}.vl.json"));
            let written = std::fs::read(written).unwrap();
            let kept = std::fs::read_to_string(docs.join(format!("{file}.svg"))).unwrap();
            let hash = |bytes: &[u8]| -> String {
                let digest = Sha256::digest(bytes);
                digest.iter().map(|byte| format!("{byte:02x}")).collect()
            };
            let what = format!("docs/studies/{file}.svg is stale: scripts/pictures draws it anew");
            assert_eq!(source(&kept), Some(hash(&written).as_str()), "{what}");
            // The contrast: a specification that differs by a blank.
            assert_ne!(
                source(&kept),
                Some(hash(&[&written[..], b" "].concat()).as_str())
            );
        }
        let out = folder.path().join(name);
        let rows = Rows::read(&out);
        specifications_are_right(name, &out, &rows);
        page_carries_the_rows(name, &out, &rows);
    }
}

/// The results of a study, as others read them.
struct Rows {
    heads: Vec<String>,
    records: Vec<csv::StringRecord>,
}

impl Rows {
    fn read(out: &Path) -> Self {
        let mut reader = csv::Reader::from_path(out.join("results.csv")).unwrap();
        let heads = reader.headers().unwrap().iter().map(str::to_owned);
        let heads = heads.collect();
        let records = reader.records().map(Result::unwrap).collect();
        Self { heads, records }
    }

    fn cell(&self, column: &str, row: usize) -> &str {
        let place = self.heads.iter().position(|head| head == column).unwrap();
        &self.records[row][place]
    }
}

/// Grammar, every row shown or counted, and values, of all pictures of a study.
fn specifications_are_right(name: &str, out: &Path, rows: &Rows) {
    for picture in &Study::load(name, &Changes::default()).unwrap().pictures {
        let file = &picture.file;
        let text = std::fs::read(out.join(format!("{file}.vl.json"))).unwrap();
        let spec: Value = serde_json::from_slice(&text).unwrap();
        assert_eq!(wrong(&spec), [""; 0], "{file}");
        assert_eq!(lost(picture, rows.records.len(), &spec), 0, "{file}");
        let value = |column: &str, row: usize| rows.cell(column, row).parse().ok();
        let other = |column: &str, row: usize| value(column, row).map(|value: f64| 1.01 * value);
        assert!(false_marks(picture, value, &spec).is_empty(), "{file}");
        let is_told = !matches!(picture.kind, Kind::Histogram(_));
        assert_eq!(
            !false_marks(picture, other, &spec).is_empty(),
            is_told,
            "{file}"
        );
    }
}

/// What the page carries packed.
fn unpacked(page: &str, name: &str) -> String {
    let start = format!("data-packed=\"{name}\">");
    let (_, rest) = page.split_once(&start).unwrap();
    let bytes = BASE64_STANDARD
        .decode(rest.split_once('<').unwrap().0)
        .unwrap();
    let mut text = String::new();
    GzDecoder::new(bytes.as_slice())
        .read_to_string(&mut text)
        .unwrap();
    text
}

/// Every row with what its run sets, to the last bit, and its figures to the digits
/// that the page says; the page runs nothing that its policy does not name.
fn page_carries_the_rows(name: &str, out: &Path, rows: &Rows) {
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    let study = Study::load(name, &Changes::default()).unwrap();
    let data: Value = serde_json::from_str(&unpacked(&page, "data")).unwrap();
    let carried = &data["rows"];
    let count = rows.records.len();
    assert_eq!(carried["rows"], count);
    let digits = carried["digits"].as_u64().unwrap() as usize;
    for row in [0, count / 3, count - 1] {
        let planned = study.planned_row(row as u64);
        for set in study.row_sets(&planned.point, planned.rung) {
            let (key, value) = set.split_once('=').unwrap();
            let mut sets = carried["sets"].as_array().unwrap().iter();
            let found = value_of(sets.find(|set| set["key"] == key).unwrap(), row, count);
            let number = |text: &str| text.parse::<f64>().ok().map(f64::to_bits);
            let same =
                found == value || number(&found).is_some_and(|bits| number(value) == Some(bits));
            assert!(same, "{name} row {row}: {key} = {value}, not {found}");
        }
        for column in carried["columns"].as_array().unwrap() {
            let head = column["name"].as_str().unwrap();
            // An axis whose set says it.
            if column["value"].is_null() && column["values"].is_null() {
                continue;
            }
            let (found, cell) = (value_of(column, row, count), rows.cell(head, row));
            let same = match cell.parse::<f64>() {
                Ok(number) => found.parse() == Ok(significant(number, digits)),
                Err(_) => found == cell,
            };
            assert!(same, "{name} row {row}: {head} is {cell}, not {found}");
        }
    }
    let libraries = Sha256::digest(unpacked(&page, "libraries"));
    let hash = |digest: &[u8]| format!("'sha256-{}'", BASE64_STANDARD.encode(digest));
    let (_, policy) = page.split_once("Policy\" content=\"").unwrap();
    let policy = policy.split_once("\">").unwrap().0;
    assert!(policy.contains(&hash(&libraries)), "{policy}");
    assert!(!policy.contains(&hash(&Sha256::digest("alert(1)"))));
    assert!(!policy.contains("unsafe-eval"));
}

/// A row of a column as text, empty where there is none.
fn value_of(column: &Value, row: usize, rows: usize) -> String {
    if let Some(planes) = column["planes"].as_str() {
        let planes = BASE64_STANDARD.decode(planes).unwrap();
        let bytes: [u8; 8] = std::array::from_fn(|plane| planes[plane * rows + row]);
        return f64::from_le_bytes(bytes).to_string();
    }
    let value = match &column["values"] {
        Value::Array(values) => &values[row],
        _ => &column["value"],
    };
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
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
        let of_picture =
            |entry: &std::fs::DirEntry| entry.path().to_string_lossy().ends_with(".vl.json");
        assert_eq!(
            drawn.flatten().filter(of_picture).count(),
            pictures,
            "{file}"
        );
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
