//! Memory that an axis keeps, part by part: the table of
//! `docs/CONTROLLER.md`.

use firmware::axis::AxisState;
use firmware::law::LawState;
use firmware::{BacklashMeasurementRun, Fault, Stretch};

const PAGE: &str = include_str!("../../docs/CONTROLLER.md");

/// Every row of the page's table.
const PARTS: [(&str, usize); 5] = [
    ("law", size_of::<LawState>()),
    ("stretch of the command", size_of::<Stretch>()),
    ("latched fault", size_of::<Fault>()),
    ("**the axis** with its settings", size_of::<AxisState>()),
    (
        "backlash measurement, beside it",
        size_of::<BacklashMeasurementRun>(),
    ),
];

/// The rows that a page does not have as they are.
fn missing(page: &str) -> Vec<String> {
    let rows = PARTS.map(|(name, bytes)| format!("| {name} | {bytes} |"));
    let missing = rows.into_iter().filter(|row| !page.contains(row.as_str()));
    missing.collect()
}

#[test]
fn the_page_has_the_sizes() {
    for (name, bytes) in PARTS {
        println!("{name}: {bytes} bytes");
    }
    assert_eq!(missing(PAGE), Vec::<String>::new());
}

/// The contrast: a size that is not the program's is noticed.
#[test]
fn a_wrong_size_is_noticed() {
    let wrong = PAGE.replace("| law | 48 |", "| law | 49 |");
    assert_eq!(missing(&wrong), ["| law | 48 |"]);
}
