//! The colours: series for every eye, scales for maps.

use schemars::JsonSchema;
use serde::Deserialize;

/// Text, and lines that are no series.
pub(super) const INK: &str = "#1c2024";
/// Axes, remarks.
pub(super) const MUTED: &str = "#5c646d";
/// Lines of the grid.
pub(super) const GRID: &str = "#dde1e5";
/// Limits; also what breaks one.
pub(super) const LIMIT: &str = "#b3201a";
/// Cells without a value.
pub(super) const NO_VALUE: &str = "#e4e7ea";

/// Okabe and Ito's colours without yellow, which white ground swallows; those
/// with a contrast of 3 to 1 against white come first.
pub(super) const SERIES: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00", "#56b4e9",
];
/// The same for dashes over lines of the colour: 0.6 of each.
const DARKER: [&str; 7] = [
    "#00446b", "#803800", "#005f45", "#7a4964", "#000000", "#8a5f00", "#346c8c",
];
/// Ten steps of the part of viridis that is dark enough for lines on white.
const ORDERED: [&str; 10] = [
    "#440154", "#482173", "#433e85", "#38588c", "#2d708e", "#25858e", "#1e9b8a", "#2ab07f",
    "#52c569", "#86d549",
];
/// The same, darker.
const ORDERED_DARKER: [&str; 10] = [
    "#290132", "#2b1445", "#282550", "#223554", "#1b4355", "#165055", "#125d53", "#196a4c",
    "#31763f", "#50802c",
];

/// Blue and vermillion: what keeps a limit and what does not.
pub(super) const PASS: &str = SERIES[0];
/// See [`PASS`].
pub(super) const FAIL: &str = SERIES[1];

/// More ordered series than this take their colours from a scale, in order.
const MOST_NAMED: usize = 5;

/// Colours of so many series and of their theory; `ordered` where the series are
/// numbers.
pub(super) fn series(count: usize, ordered: bool) -> [Vec<&'static str>; 2] {
    let places = 0..count;
    if ordered && count > MOST_NAMED {
        let last = count.saturating_sub(1).max(1);
        let at = |at: usize| (at * (ORDERED.len() - 1) + last / 2) / last;
        let colours = |of: [&'static str; 10]| places.clone().map(|place| of[at(place)]).collect();
        return [ORDERED, ORDERED_DARKER].map(colours);
    }
    [SERIES, DARKER].map(|of| places.clone().map(|at| of[at % of.len()]).collect())
}

/// Colours of a map. Both scales rise evenly in lightness, so that they can be
/// read in grey, and by readers with colour vision deficiency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ColourScale {
    /// From violet over green to yellow (Smith and van der Walt 2015).
    #[default]
    Viridis,
    /// From blue over grey to yellow (Nuñez, Anderton and Renslow 2018).
    Cividis,
}

impl ColourScale {
    /// Its name, which is Vega's.
    pub(super) fn name(self) -> &'static str {
        ["viridis", "cividis"][self as usize]
    }
}
