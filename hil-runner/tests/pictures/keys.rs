//! The keys of `[[picture]]`: every one acts.

use super::samples::{Sample, draw_sample};
use super::tables::{gains, laws, numbers, sample_times, spread, table};
use hil_runner::study::picture::{Picture, Table};

pub(super) const LINES: &str = "kind = \"lines\"\nx = \"controller.sample_time_s\"\n";
pub(super) const MAP: &str = "kind = \"map\"\nx = \"controller.kp\"\ny = \"controller.kd_s\"\n\
                   z = \"peak_following_error_mm\"\n";
pub(super) const BARS: &str =
    "kind = \"bars\"\ncategory = \"controller.law\"\ny = \"rms_acc_error_mps2\"\n";
pub(super) const HISTOGRAM: &str = "kind = \"histogram\"\nx = \"transmission.backlash_half_deg\"\n";
pub(super) const SCATTER: &str = "kind = \"scatter\"\nx = \"transmission.backlash_half_deg\"\n\
                       y = \"peak_following_error_mm\"\n";

/// The table with one column under another name.
fn renamed(mut table: Table, from: &str) -> Table {
    for column in &mut table.columns {
        if column.name == from {
            column.name = "renamed".into();
        }
    }
    table
}

/// Columns with units that have prefixes, on a grid.
fn lengths() -> Table {
    table([
        numbers("x_s", [1.0, 2.0, 1.0, 2.0]),
        numbers("y_mm", [1.0, 1.0, 2.0, 2.0]),
        numbers("z", [1.0, 2.0, 3.0, 4.0]),
    ])
}

/// Every key that may be left out changes the picture.
#[test]
fn every_key_acts() {
    let error = format!("{LINES}y = \"peak_following_error_mm\"\n");
    let limit = format!("{error}limit.value = 0.5\n");
    let theory = format!("{error}theory = \"theory.following_error_mm\"\n");
    let contours = format!("{MAP}contours = [0.5]\n");
    let groups: Vec<(&str, Table, &str)> = vec![
        (
            &error,
            sample_times(&[8.0, 12.0], 3),
            "x_scale = \"log\"; x_label = \"T\"; x_unit = \"us\"; x_range = [0, 1]; \
                series = \"drive.dac_bits\"; theory = \"theory.following_error_mm\"; \
                y_scale = \"log\"; y_label = \"E\"; y_unit = \"um\"; y_range = [0, 1]; \
                limit = 0.5; caption = \"C\"; where.drive.dac_bits = 8",
        ),
        (&limit, sample_times(&[8.0], 1), r#"limit.label = "L""#),
        (
            &theory,
            sample_times(&[8.0], 1),
            r#"marks = "M"; dashes = "D""#,
        ),
        (
            MAP,
            gains(9, 7),
            "x_scale = \"log\"; x_label = \"X\"; x_range = [0, 1]; y_scale = \"log\"; \
                y_label = \"Y\"; y_range = [0, 1]; z_scale = \"log\"; z_label = \"Z\"; \
                z_unit = \"um\"; z_range = [0, 1]; colours = \"cividis\"; \
                contours = [0.5]",
        ),
        (MAP, renamed(gains(9, 7), "pass"), r#"pass = "renamed""#),
        (MAP, renamed(gains(9, 7), "status"), r#"status = "renamed""#),
        (
            &contours,
            gains(9, 7),
            r#"contours_of = "theory.modulus_margin""#,
        ),
        (
            "kind = \"map\"\nx = \"x_s\"\ny = \"y_mm\"\nz = \"z\"\n",
            lengths(),
            r#"x_unit = "ms"; y_unit = "um""#,
        ),
        (
            BARS,
            laws(),
            "category_label = \"C\"; series = \"drive.dac_bits\"; y_scale = \"log\"; \
                y_label = \"Y\"; y_range = [0, 100]; limit = 30",
        ),
        (
            "kind = \"bars\"\ncategory = \"z\"\ny = \"y_mm\"\n",
            lengths(),
            r#"y_unit = "um""#,
        ),
        (
            HISTOGRAM,
            spread(),
            "x_scale = \"log\"; x_label = \"X\"; x_range = [0, 0.5]; bins = 4; \
                limit = 0.3",
        ),
        (
            "kind = \"histogram\"\nx = \"y_mm\"\n",
            lengths(),
            r#"x_unit = "um""#,
        ),
        (
            SCATTER,
            spread(),
            "x_scale = \"log\"; x_label = \"X\"; x_range = [0, 0.5]; y_scale = \"log\"; \
                y_label = \"Y\"; y_range = [0, 1]; y_unit = \"um\"; limit = 0.55",
        ),
        (SCATTER, renamed(spread(), "pass"), r#"pass = "renamed""#),
        (
            "kind = \"scatter\"\nx = \"x_s\"\ny = \"y_mm\"\n",
            lengths(),
            r#"x_unit = "ms""#,
        ),
    ];
    for (keys, table, further) in groups {
        let draw = |keys: &str| draw_sample(&Sample::of("p", keys, table.clone()));
        for key in further.split("; ") {
            let acts = draw(keys) != draw(&format!("{keys}{key}"));
            assert!(acts, "{key} does nothing in\n{keys}");
        }
    }
}

pub(super) fn parsed(keys: &str) -> Result<Picture, String> {
    let text = format!("file = \"f\"\ntitle = \"T\"\n{keys}");
    let picture: Result<Picture, toml::de::Error> = toml::from_str(&text);
    picture.map_err(|error| error.message().to_owned())
}

/// A picture names its columns, so that a study can refuse it before it runs.
#[test]
fn pictures_name_their_columns() {
    let keys = format!("{LINES}y = [\"a\", \"b\"]\ntheory = \"c\"\nseries = \"d\"\nwhere.e.f = 1");
    let columns = ["a", "b", "c", "controller.sample_time_s", "d", "e.f"];
    assert_eq!(parsed(&keys).unwrap().columns(), columns);
    let keys = format!("{MAP}pass = \"a\"\nstatus = \"b\"\ncontours = [1]\ncontours_of = \"c\"");
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

fn page() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/PICTURES.md");
    std::fs::read_to_string(path).unwrap()
}

/// Every key of a kind stands in its part of `docs/PICTURES.md`, in code.
#[test]
fn every_key_is_on_the_page() {
    let page = page();
    let part = |kind: &str| {
        let (_, rest) = page.split_once(&format!("\n## `{kind}`")).unwrap();
        rest.split("\n## ").next().unwrap().to_owned()
    };
    for kind in ["lines", "map", "bars", "histogram", "scatter"] {
        let message = parsed(&format!("kind = \"{kind}\"\nnix = 1")).unwrap_err();
        let (_, names) = message.split_once("expected one of ").unwrap();
        let names: Vec<&str> = names.split('`').skip(1).step_by(2).collect();
        assert!(names.len() > 5, "{message}");
        for name in names {
            let of_axis = match name.split_once('_') {
                Some((axis @ ("x" | "y" | "z"), _)) => Some(axis),
                _ => None,
            };
            let found = match of_axis {
                // Keys of axes are told once, the axes by kind.
                Some(axis) => {
                    let part = part(kind);
                    let (_, axes) = part.split_once("with the keys of the ax").unwrap();
                    let sentence = axes.split('.').next().unwrap();
                    let key = name.replacen(axis, "x", 1);
                    page.contains(&format!("`{key}`")) && sentence.contains(&format!(" {axis}"))
                }
                None => part(kind).contains(&format!("`{name}`")),
            };
            assert!(found, "{kind}: {name}");
        }
    }
}
