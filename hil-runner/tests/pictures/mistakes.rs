//! Mistakes of a study file and of a table are sentences.

use super::keys::{BARS, HISTOGRAM, LINES, MAP, SCATTER, parsed};
use super::table::table;
use super::tables::{laws, numbers, sample_times, spread};
use hil_runner::study::picture::{Picture, Table, draw};

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

#[test]
fn mistakes_of_the_table_are_sentences() {
    let lines = |more: &str| format!("{LINES}y = \"peak_following_error_mm\"\n{more}");
    let times = || sample_times(&[8.0], 1);
    let mut short = times();
    short.columns[1] = numbers("drive.dac_bits", [8.0]);
    let spread_lines = "kind = \"lines\"\nx = \"final_error_um\"\ny = \"pass\"\n";
    for (keys, table, report) in [
        (
            format!("{LINES}y = \"nix_mm\""),
            times(),
            "the results have no column \"nix_mm\"",
        ),
        (
            format!("{LINES}y = \"margin_closed\""),
            times(),
            "margin_closed is now modulus_margin_contact",
        ),
        (
            lines("where.nix = 1"),
            times(),
            "the results have no column \"nix\"",
        ),
        (
            lines("theory = \"peak_abs_acc_mps2\""),
            times(),
            "\"peak_following_error_mm\" is in mm and \"peak_abs_acc_mps2\" in m/s²: they cannot \
             share an axis",
        ),
        (
            lines("y_unit = \"ms\""),
            times(),
            "\"Peak following error\" is in mm and \"ms\" in ms: they cannot share an axis",
        ),
        (
            lines(""),
            short,
            "column \"drive.dac_bits\" has 1 rows where the first column has 9",
        ),
        (
            BARS.replace("rms_acc_error_mps2", "controller.law"),
            laws(),
            "column \"controller.law\" has words, and this needs numbers",
        ),
        (
            SCATTER.replace("scatter", "map") + "z = \"pass\"",
            spread(),
            "a map needs a regular grid, but 500 values along x and",
        ),
        (
            "kind = \"bars\"\ncategory = \"final_error_um\"\ny = \"pass\"".into(),
            spread(),
            "500 bars are more than a picture can show; kind \"histogram\" or \"lines\" can",
        ),
        (
            format!("{spread_lines}series = \"final_error_um\""),
            spread(),
            "column \"final_error_um\" has 500 different values, more series than a legend can",
        ),
    ] {
        let picture = parsed(&keys).unwrap();
        let message = draw(&picture, &table, &[]).unwrap_err().to_string();
        let report = format!("picture \"f\": {report}");
        assert!(message.starts_with(&report), "{message}, not {report}");
    }
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
    let picture = parsed("kind = \"map\"\nx = \"a\"\ny = \"b\"\nz = \"c\"").unwrap();
    let message = draw(&picture, &table, &[]).unwrap_err().to_string();
    assert!(message.contains("a map needs a regular grid"), "{message}");
}
