//! Memory that an axis keeps, part by part: the table of
//! `docs/CONTROLLER.md`.

use firmware::axis::AxisState;
use firmware::law::LawState;
use firmware::monitor::{EncoderLossState, FollowingErrorState, SaturationState, TickState};
use firmware::{
    BacklashCompensationState, BacklashMeasurementRun, FaultLatch, MotionState, PositionState,
};

const PAGE: &str = include_str!("../../docs/CONTROLLER.md");

/// Every row of the page's table.
const PARTS: [(&str, usize); 11] = [
    ("law", size_of::<LawState>()),
    ("position, two encoders", 2 * size_of::<PositionState>()),
    (
        "backlash compensation",
        size_of::<BacklashCompensationState>(),
    ),
    ("latched fault", size_of::<FaultLatch>()),
    ("missed ticks", size_of::<TickState>()),
    ("following error", size_of::<FollowingErrorState>()),
    ("encoder loss", size_of::<EncoderLossState>()),
    ("saturation", size_of::<SaturationState>()),
    ("**the axis**", size_of::<AxisState>()),
    ("motion generator, beside it", size_of::<MotionState>()),
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
    let wrong = PAGE.replace("| law | 40 |", "| law | 41 |");
    assert_eq!(missing(&wrong), ["| law | 40 |"]);
}
