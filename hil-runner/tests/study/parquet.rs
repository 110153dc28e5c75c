//! The Parquet copy: whole numbers are integers, and it says what made it.

use std::fs::{self, File};
use std::path::Path;

use hil_core::figures::SUMMARY_FIGURES;
use parquet::basic::Type;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

use crate::support::{STUDY, folder_with, made, ran};

/// Axes over whole numbers and others, rows that are refused, one whose whole
/// number no integer holds.
const AXES: &str = include_str!("studies/mixed.toml");

/// Every value of every row, as the CSV writes it, by column.
fn columns(folder: &Path) -> Vec<(String, Type, Vec<String>)> {
    let part = File::open(folder.join("results.parquet")).unwrap();
    let reader = SerializedFileReader::new(part).unwrap();
    let schema = reader.metadata().file_metadata().schema_descr();
    let mut columns: Vec<(String, Type, Vec<String>)> = schema
        .columns()
        .iter()
        .map(|column| (column.name().to_owned(), column.physical_type(), Vec::new()))
        .collect();
    for row in reader.get_row_iter(None).unwrap() {
        for ((_, field), column) in row.unwrap().get_column_iter().zip(&mut columns) {
            column.2.push(match field {
                Field::Null => String::new(),
                Field::Bool(flag) => flag.to_string(),
                Field::Long(whole) => whole.to_string(),
                Field::Double(number) => number.to_string(),
                Field::Str(text) => text.clone(),
                other => panic!("{other:?}"),
            });
        }
    }
    columns
}

fn metadata(folder: &Path) -> Vec<(String, String)> {
    let part = File::open(folder.join("results.parquet")).unwrap();
    let reader = SerializedFileReader::new(part).unwrap();
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    let pairs = pairs.unwrap().iter();
    pairs
        .map(|pair| (pair.key.clone(), pair.value.clone().unwrap()))
        .collect()
}

#[test]
fn whole_numbers_are_integers_and_all_values_those_of_the_csv() {
    let folder = folder_with(AXES);
    let base = concat!(env!("CARGO_MANIFEST_DIR"), "/../cases/paper-2.toml");
    fs::copy(base, folder.path().join("axis.toml")).unwrap();
    let out = made(&folder, "small.toml", "made");
    let mut reader = csv::Reader::from_path(out.join("results.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let columns = columns(&out);
    assert_eq!(columns.len(), header.len());
    let mut whole = vec!["row", "drive.dac_bits"];
    let figures = SUMMARY_FIGURES.iter().filter(|figure| figure.whole);
    whole.extend(figures.map(|figure| figure.key));
    assert_eq!(whole.len(), 2 + 7);
    for (place, (name, kind, values)) in columns.iter().enumerate() {
        assert_eq!(name, &header[place]);
        let expected = match name.as_str() {
            "pass" => Type::BOOLEAN,
            "rung" | "status" | "reason" | "failed_limits" | "run.solver"
            | "limit_cycle_fed_by" => Type::BYTE_ARRAY,
            name if whole.contains(&name) => Type::INT64,
            _ => Type::DOUBLE,
        };
        assert_eq!(*kind, expected, "{name}");
        assert_eq!(values.len(), rows.len());
        for (value, row) in values.iter().zip(&rows) {
            let csv = &row[place];
            if csv == "1e300" {
                assert!(value.is_empty() && row.iter().any(|cell| cell == "refused"));
            } else if *kind == Type::DOUBLE && !csv.is_empty() {
                let parse = |text: &str| text.parse::<f64>().unwrap();
                assert!(parse(value) == parse(csv), "{name}: {value} {csv}");
            } else {
                assert_eq!(value, csv, "{name}");
            }
        }
    }
    // Both kinds of rows were there.
    let statuses: Vec<&str> = rows.iter().map(|row| &row[5]).collect();
    assert!(statuses.contains(&"ok") && statuses.contains(&"refused"));
}

#[test]
fn every_part_says_what_made_it() {
    let folder = folder_with(STUDY);
    let line = "small.toml --set controller.ki_per_s=6";
    let out = made(&folder, line, "made");
    let base = fs::read_to_string(out.join("base.toml")).unwrap();
    let again = "hil-runner study small.toml --set 'controller.ki_per_s=6' --out out";
    let expected = [
        ("study", "small"),
        ("program", concat!("hil-runner ", env!("CARGO_PKG_VERSION"))),
        ("command_line", again),
        ("sets", r#"["controller.ki_per_s=6"]"#),
        ("study.toml", STUDY),
        ("base.toml", &base),
    ];
    let expected = expected.map(|(key, value)| (key.to_owned(), value.to_owned()));
    assert_eq!(metadata(&out), expected);
    let paper_2 = hil_core::runfile::builtin_text("paper-2").unwrap();
    assert_eq!(base, paper_2);
    // A shard says which one it is; merged, the metadata are those of the whole.
    for shard in ["1/2", "2/2"] {
        let name = shard.replace('/', "-of-");
        let part = made(&folder, &format!("{line} --shard {shard}"), &name);
        let line = metadata(&part)[2].1.clone();
        let end = format!("--shard {shard} --out out");
        assert!(line.ends_with(&end), "{line}");
    }
    ran(&folder, "merge out 1-of-2 2-of-2", 0);
    assert_eq!(metadata(&folder.path().join("out")), metadata(&out));
}
