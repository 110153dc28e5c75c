//! Mistakes of a study file and of a table are sentences.

use super::keys::{HISTOGRAM, LINES, MAP, parsed};
use super::table::table;
use super::tables::{Rows, numbers, sample_times};
use hil_runner::study::picture::{Picture, Table, specify};
use serde::Deserialize;

const WHOLE: &str = include_str!("mistakes/whole.txt");

const OF_LINES: &str = include_str!("mistakes/of-lines.txt");

const OF_AN_ERROR: &str = include_str!("mistakes/of-an-error.txt");

const OF_A_MAP: &str = include_str!("mistakes/of-a-map.txt");

#[test]
fn mistakes_of_the_file_are_sentences() {
    let lines = format!("{LINES}y = \"peak_following_error_mm\"\n");
    for (start, cases) in [
        ("", WHOLE),
        (LINES, OF_LINES),
        (&lines, OF_AN_ERROR),
        (MAP, OF_A_MAP),
        (HISTOGRAM, "bins = 0 => bins = 0 must be from 1 to 200"),
    ] {
        for (rest, report) in table(cases) {
            let message = parsed(&format!("{start}{rest}")).unwrap_err();
            let report = format!("picture \"f\": {report}");
            assert!(message.starts_with(&report), "{message}, not {report}");
        }
    }
    let message = parsed(&MAP.replace("kd_s", "kp")).unwrap_err();
    let report = "picture \"f\": x and y are both \"controller.kp\"";
    assert!(message.starts_with(report), "{message}");
    for file in ["", "a/b", "a.svg", "..\\\\a"] {
        let text = format!("file = \"{file}\"\ntitle = \"T\"\n{lines}");
        let error = toml::from_str::<Picture>(&text).unwrap_err().to_string();
        let report = "file is the stem of a file's name";
        assert!(error.contains(report), "{error}");
    }
}

#[derive(Deserialize)]
struct OfTheTable {
    mistake: Vec<Mistake>,
}

#[derive(Deserialize)]
struct Mistake {
    table: Rows,
    report: String,
    keys: String,
}

#[track_caller]
fn refused(keys: &str, table: &Table, report: &str) {
    let picture = parsed(keys).unwrap();
    let message = specify(&picture, table, &[]).unwrap_err().to_string();
    let report = format!("picture \"f\": {report}");
    assert!(message.starts_with(&report), "{message}, not {report}");
}

#[test]
fn mistakes_of_the_table_are_sentences() {
    let of_the_table: OfTheTable =
        toml::from_str(include_str!("mistakes/of-the-table.toml")).unwrap();
    for mistake in of_the_table.mistake {
        refused(&mistake.keys, &mistake.table.table(), &mistake.report);
    }
    let keys = format!("{LINES}y = \"peak_following_error_mm\"\n");
    let mut short = sample_times(&[8.0], 1);
    short.columns[1] = numbers("drive.dac_bits", [8.0]);
    let report = "column \"drive.dac_bits\" has 1 rows where the first column has 9";
    refused(&keys, &short, report);
}

/// A random plan of 100,000 runs has 10¹⁰ cells: the map is refused before they
/// are formed.
#[test]
fn a_large_plan_that_is_no_grid_is_refused_at_once() {
    let share = |i: u32, step: f64| (f64::from(i) * step).fract();
    let column = |name: &str, step: f64| numbers(name, (0..100_000).map(|i| share(i, step)));
    let table = Table {
        columns: vec![
            column("a", 0.618_034),
            column("b", 0.414_214),
            column("c", 0.5),
        ],
    };
    let keys = "kind = \"map\"\nx = \"a\"\ny = \"b\"\nz = \"c\"";
    refused(keys, &table, "a map needs a regular grid");
}
