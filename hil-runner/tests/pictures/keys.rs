//! The keys of `[[picture]]`: every one acts.

use super::samples::{Sample, specified};
use super::tables::Rows;
use hil_runner::study::picture::{Picture, Table};
use serde::Deserialize;

pub(super) const LINES: &str = "kind = \"lines\"\nx = \"controller.sample_time_s\"\n";
pub(super) const MAP: &str = "kind = \"map\"\nx = \"controller.kp\"\ny = \"controller.kd_s\"\n\
                   z = \"peak_following_error_mm\"\n";
pub(super) const HISTOGRAM: &str = "kind = \"histogram\"\nx = \"transmission.backlash_half_deg\"\n";

/// The table with one column under another name.
fn renamed(mut table: Table, from: &str) -> Table {
    for column in &mut table.columns {
        if column.name == from {
            column.name = "renamed".into();
        }
    }
    table
}

/// Every key that may be left out changes the picture.
#[test]
fn every_key_acts() {
    #[derive(Deserialize)]
    struct Groups {
        group: Vec<Group>,
    }
    #[derive(Deserialize)]
    struct Group {
        table: Rows,
        renamed: Option<String>,
        keys: String,
        further: String,
    }
    let groups: Groups = toml::from_str(include_str!("keys.toml")).unwrap();
    for group in groups.group {
        let (table, keys) = (group.table.table(), group.keys);
        let table = match &group.renamed {
            Some(from) => renamed(table, from),
            None => table,
        };
        let specify = |keys: &str| specified(&Sample::of("p", keys, table.clone()));
        for key in group.further.lines() {
            let acts = specify(&keys) != specify(&format!("{keys}{key}"));
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
