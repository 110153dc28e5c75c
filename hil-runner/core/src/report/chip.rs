//! A chip's part of a report: what it is, and what its steps and its image
//! cost.

use super::parameters::{text, value};
use super::{FigureRow, Parameter};
use crate::chip_cost::{ChipReport, StateCost};
use crate::figures::CHIP_FIGURES;
use crate::summary::Summary;

/// What the chip says of itself.
pub(crate) fn parameters(chip: &ChipReport) -> Vec<Parameter> {
    vec![
        text("Target", &chip.target, ""),
        text("CRC-32 of the image", &chip.image_hash, ""),
        value("Steps over the link", chip.link_steps as f64, ""),
        value("Clock of the core", chip.clock_hz as f64 / 1e6, "MHz"),
    ]
}

/// The figures of the chip, or those that a budget names in vain; nothing for a
/// run that has to do with no chip.
pub(crate) fn figures(summary: &Summary) -> Vec<FigureRow> {
    let named = |key: &str| summary.verdicts.iter().any(|verdict| verdict.figure == key);
    let of_chip = CHIP_FIGURES
        .iter()
        .filter(|figure| summary.chip.is_some() || named(figure.key))
        .map(|figure| FigureRow {
            key: figure.key.to_owned(),
            label: figure.label.to_owned(),
            unit: figure.unit.to_owned(),
            value: summary.figure(figure.key),
            digits: None,
        });
    let states = summary.chip.iter().flat_map(|chip| {
        let counted = match chip.instructions_per_step_max {
            Some(_) => "instructions",
            None => "cycles",
        };
        let rows = chip.states.iter();
        rows.flat_map(move |state| of_state(state, counted))
    });
    of_chip.chain(states).collect()
}

/// What the steps that end in a state cost.
fn of_state(cost: &StateCost, counted: &str) -> [FigureRow; 2] {
    let row = |what: &str, words: &str, value: u64| FigureRow {
        key: format!("states.{}.{what}", cost.state),
        label: format!("{words} {counted} of a step, {}", cost.state),
        unit: String::new(),
        value: Some(value as f64),
        digits: None,
    };
    [
        row("max", "Most", cost.max),
        row("median", "Median", cost.median),
    ]
}
