//! The keys of `[[picture]]`: every one acts, and mistakes are sentences.

use super::samples::{Sample, draw_sample, gains, laws, sample_times, spread};
use hil_runner::study::picture::{Picture, Table, draw};

const LINES: &str = "kind = \"lines\"\nx = \"controller.sample_time_s\"\n";
const MAP: &str = "kind = \"map\"\nx = \"controller.kp\"\ny = \"controller.kd_s\"\n\
                   z = \"peak_following_error_mm\"\n";
const BARS: &str = "kind = \"bars\"\ncategory = \"controller.law\"\ny = \"rms_acc_error_mps2\"\n";
const HISTOGRAM: &str = "kind = \"histogram\"\nx = \"transmission.backlash_half_deg\"\n";
const SCATTER: &str = "kind = \"scatter\"\nx = \"transmission.backlash_half_deg\"\n\
                       y = \"peak_following_error_mm\"\n";

/// Every key that may be left out changes the picture.
#[test]
fn every_key_acts() {
    let times = || sample_times(&[8.0, 12.0], 3);
    let error = "y = \"peak_following_error_mm\"\n";
    let renamed = |mut table: Table, from: &str, to: &str| {
        for column in &mut table.columns {
            if column.name == from {
                column.name = to.into();
            }
        }
        table
    };
    let verdicts = || renamed(gains(9, 7), "pass", "verdict");
    let states = || renamed(gains(9, 7), "state", "what");
    let judged = || renamed(spread(), "pass", "verdict");
    let cases: Vec<(String, &str, Table)> = vec![
        (format!("{LINES}{error}"), "x_scale = \"log\"", times()),
        (format!("{LINES}{error}"), "x_label = \"T\"", times()),
        (format!("{LINES}{error}"), "x_unit = \"us\"", times()),
        (format!("{LINES}{error}"), "x_range = [0, 1]", times()),
        (
            format!("{LINES}{error}"),
            "series = \"drive.dac_bits\"",
            times(),
        ),
        (
            format!("{LINES}{error}"),
            "theory = \"theory.following_error_mm\"",
            times(),
        ),
        (format!("{LINES}{error}"), "y_scale = \"log\"", times()),
        (format!("{LINES}{error}"), "y_label = \"E\"", times()),
        (format!("{LINES}{error}"), "y_unit = \"um\"", times()),
        (format!("{LINES}{error}"), "y_range = [0, 1]", times()),
        (format!("{LINES}{error}"), "limit = 0.5", times()),
        (
            format!("{LINES}{error}limit.value = 0.5\n"),
            "limit.label = \"L\"",
            times(),
        ),
        (format!("{LINES}{error}"), "caption = \"C\"", times()),
        (
            format!("{LINES}{error}"),
            "where.drive.dac_bits = 8",
            times(),
        ),
        (MAP.into(), "x_scale = \"log\"", gains(9, 7)),
        (MAP.into(), "x_label = \"X\"", gains(9, 7)),
        (MAP.into(), "x_range = [0, 1]", gains(9, 7)),
        (MAP.into(), "y_scale = \"log\"", gains(9, 7)),
        (MAP.into(), "y_label = \"Y\"", gains(9, 7)),
        (MAP.into(), "y_range = [0, 1]", gains(9, 7)),
        (MAP.into(), "z_scale = \"log\"", gains(9, 7)),
        (MAP.into(), "z_label = \"Z\"", gains(9, 7)),
        (MAP.into(), "z_unit = \"um\"", gains(9, 7)),
        (MAP.into(), "z_range = [0, 1]", gains(9, 7)),
        (MAP.into(), "colours = \"cividis\"", gains(9, 7)),
        (MAP.into(), "pass = \"verdict\"", verdicts()),
        (MAP.into(), "state = \"what\"", states()),
        (MAP.into(), "contours = [0.5]", gains(9, 7)),
        (
            format!("{MAP}contours = [0.5]\n"),
            "contours_of = \"theory.modulus_margin\"",
            gains(9, 7),
        ),
        (BARS.into(), "category_label = \"C\"", laws()),
        (BARS.into(), "series = \"drive.dac_bits\"", laws()),
        (BARS.into(), "y_scale = \"log\"", laws()),
        (BARS.into(), "y_label = \"Y\"", laws()),
        (BARS.into(), "y_range = [0, 100]", laws()),
        (BARS.into(), "limit = 30", laws()),
        (HISTOGRAM.into(), "x_scale = \"log\"", spread()),
        (HISTOGRAM.into(), "x_label = \"X\"", spread()),
        (HISTOGRAM.into(), "x_range = [0, 0.5]", spread()),
        (HISTOGRAM.into(), "bins = 4", spread()),
        (HISTOGRAM.into(), "limit = 0.3", spread()),
        (SCATTER.into(), "x_scale = \"log\"", spread()),
        (SCATTER.into(), "x_label = \"X\"", spread()),
        (SCATTER.into(), "x_range = [0, 0.5]", spread()),
        (SCATTER.into(), "y_scale = \"log\"", spread()),
        (SCATTER.into(), "y_label = \"Y\"", spread()),
        (SCATTER.into(), "y_unit = \"um\"", spread()),
        (SCATTER.into(), "y_range = [0, 1]", spread()),
        (SCATTER.into(), "pass = \"verdict\"", judged()),
        (SCATTER.into(), "limit = 0.55", spread()),
    ];
    for (keys, key, table) in cases {
        let before = draw_sample(&Sample::of("p", &keys, table.clone()));
        let after = draw_sample(&Sample::of("p", &format!("{keys}{key}"), table));
        assert_ne!(before, after, "{key} does nothing in\n{keys}");
    }
}

fn parsed(keys: &str) -> Result<Picture, String> {
    let text = format!("file = \"f\"\ntitle = \"T\"\n{keys}");
    let picture: Result<Picture, toml::de::Error> = toml::from_str(&text);
    picture.map_err(|error| error.message().to_owned())
}

#[test]
fn mistakes_of_the_file_are_sentences() {
    let error = "y = \"peak_following_error_mm\"\n";
    for (keys, report) in [
        (
            "kind = \"pie\"".to_owned(),
            "picture \"f\": there is no kind \"pie\"; the kinds are lines, map, bars, histogram and scatter",
        ),
        (String::new(), "picture \"f\": it lacks kind"),
        (
            LINES.into(),
            "picture \"f\": y or theory must name at least one column",
        ),
        (
            format!("{LINES}{error}z = 1"),
            "picture \"f\": unknown field `z`",
        ),
        (
            format!("{LINES}{error}[[panel]]\ny = \"a\""),
            "picture \"f\": with [[picture.panel]] the keys of y, theory and limit belong into the panels",
        ),
        (
            format!("{LINES}{error}x_range = [2, 1]"),
            "picture \"f\": x_range = [2, 1] must rise from a number to a larger one",
        ),
        (
            format!("{LINES}{error}y_range = [0, 1]\ny_scale = \"log\""),
            "picture \"f\": y_range = [0, 1] must be above 0 on a logarithmic axis",
        ),
        (
            format!("{LINES}{error}limit = -1"),
            "picture \"f\": limit = -1 must be a number of at least 0: it holds for the magnitude",
        ),
        (
            format!("{LINES}{error}limit = \"a\""),
            "picture \"f\": limit must be a number or { value = …, label = \"…\" }",
        ),
        (
            format!("{LINES}{error}where.a = []"),
            "picture \"f\": where.a must be a number, a text, true or false, or a list of these",
        ),
        (
            format!("{LINES}{error}where = 3"),
            "picture \"f\": where is a table of columns and values",
        ),
        (
            format!("{LINES}y = 3"),
            "picture \"f\": a column or a list of columns",
        ),
        (
            format!("{LINES}{error}caption = 3"),
            "picture \"f\": it has a caption that is no text",
        ),
        (
            format!("{MAP}contours_of = \"a\""),
            "picture \"f\": contours_of needs levels: contours = […]",
        ),
        (
            format!("{MAP}contours = [inf]"),
            "picture \"f\": contours has inf, which is no level",
        ),
        (
            MAP.replace("kd_s", "kp"),
            "picture \"f\": x and y are both \"controller.kp\"",
        ),
        (
            format!("{HISTOGRAM}bins = 0"),
            "picture \"f\": bins = 0 must be from 1 to 200",
        ),
    ] {
        let message = parsed(&keys).unwrap_err();
        assert!(
            message.starts_with(report),
            "{message}\ninstead of\n{report}"
        );
    }
    for file in ["", "a/b", "a.svg", "..\\\\a"] {
        let text = format!("file = \"{file}\"\ntitle = \"T\"\n{LINES}{error}");
        let error = toml::from_str::<Picture>(&text).unwrap_err().to_string();
        assert!(
            error.contains("file is the stem of a file's name"),
            "{error}"
        );
    }
}

#[test]
fn mistakes_of_the_table_are_sentences() {
    let error = "y = \"peak_following_error_mm\"\n";
    let times = || sample_times(&[8.0], 1);
    let mut short = times();
    short.columns[1] = super::samples::numbers("drive.dac_bits", [8.0]);
    for (keys, table, report) in [
        (format!("{LINES}y = \"nix_mm\""), times(), "picture \"f\": the results have no column \"nix_mm\""),
        (format!("{LINES}{error}where.nix = 1"), times(), "picture \"f\": the results have no column \"nix\""),
        (format!("{LINES}y = [\"peak_following_error_mm\", \"peak_abs_acc_mps2\"]"), times(), "picture \"f\": \"peak_following_error_mm\" is in mm and \"peak_abs_acc_mps2\" in m/s²: they cannot share an axis"),
        (format!("{LINES}{error}y_unit = \"ms\""), times(), "picture \"f\": \"Peak following error\" is in mm and \"ms\" in ms: they cannot share an axis"),
        (format!("{LINES}{error}"), short, "picture \"f\": column \"drive.dac_bits\" has 1 rows where the first column has 9"),
        (BARS.replace("rms_acc_error_mps2", "controller.law"), laws(), "picture \"f\": column \"controller.law\" has words, and this needs numbers"),
        ("kind = \"map\"\nx = \"transmission.backlash_half_deg\"\ny = \"final_error_um\"\nz = \"pass\"".into(), spread(), "picture \"f\": a map needs a regular grid, but 500 values along x and"),
        ("kind = \"bars\"\ncategory = \"final_error_um\"\ny = \"pass\"".into(), spread(), "picture \"f\": 500 bars are more than a picture can show; kind \"histogram\" or \"lines\" can"),
    ] {
        let picture = parsed(&keys).unwrap();
        let message = draw(&picture, &table, &[]).unwrap_err().to_string();
        assert!(message.starts_with(report), "{message}\ninstead of\n{report}");
    }
}

/// A picture names its columns, so that a study can refuse it before it runs.
#[test]
fn pictures_name_their_columns() {
    let keys = format!("{LINES}y = [\"a\", \"b\"]\ntheory = \"c\"\nseries = \"d\"\nwhere.e.f = 1");
    let columns = ["a", "b", "c", "controller.sample_time_s", "d", "e.f"];
    assert_eq!(parsed(&keys).unwrap().columns(), columns);
    let keys = format!("{MAP}pass = \"a\"\nstate = \"b\"\ncontours = [1]\ncontours_of = \"c\"");
    let columns = [
        "a",
        "b",
        "c",
        "controller.kd_s",
        "controller.kp",
        "peak_following_error_mm",
    ];
    assert_eq!(parsed(&keys).unwrap().columns(), columns);
}
