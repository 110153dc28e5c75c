//! The page of a tune: the report of before and after, with what was found and what all the
//! settings seen tell together.

use std::collections::BTreeMap;

use hil_core::figures::{self, CHIP_FIGURES, Figure, HOST_STEP_P99, SUMMARY_FIGURES};
use hil_core::report::Report;
use hil_core::tune::outcome::{Point, TuneOutcome};
use minijinja::value::Serde;
use minijinja::{Value, context};
use serde_json::{Value as Json, json};

use super::{ReportError, render_extended};
use crate::live::Live;
use crate::page::in_script;

const PAGE: &str = include_str!("../../assets/tune.html");

/// Renders the page: `report` is that of [`compared`](hil_core::report::compared), `sentences`
/// are those of the terminal.
///
/// # Errors
///
/// Only if the program's own template or data is at fault.
pub fn render_tune(
    report: &Report,
    outcome: &TuneOutcome,
    sentences: &[String],
    live: Option<&Live>,
) -> Result<String, ReportError> {
    let word =
        |figure: &Figure| json!({ "key": figure.key, "label": figure.label, "unit": figure.unit });
    let known = SUMMARY_FIGURES.iter().chain(&CHIP_FIGURES);
    let known = known.chain([&HOST_STEP_P99]);
    let words: BTreeMap<&str, Json> = known.map(|known| (known.key, word(known))).collect();
    let aims = outcome.aims.iter();
    let sets = |point: &Point| -> Vec<String> {
        let needed = outcome.needed.iter().map(|row| (&row.key, &row.value));
        let keys = outcome.keys.iter().map(|row| &row.key);
        // A page has the profile in itself.
        let all = needed.chain(keys.zip(&point.values));
        let all = all.filter(|(key, _)| *key != "motion.profile");
        all.map(|(key, value)| format!("{key}={value}")).collect()
    };
    let front = json!({
        "front": outcome.front,
        // What a click on each opens in the simulator.
        "sets": live.map(|_| outcome.front.iter().map(sets).collect::<Vec<_>>()),
        "after": aims.clone().map(|aim| aim.after).collect::<Vec<_>>(),
        "labels": aims.filter_map(|aim| figures::find(aim.figure)).map(word).collect::<Vec<_>>(),
    });
    let more = context! {
        tune => Value::from(Serde(outcome)),
        words => Value::from(Serde(words)),
        sentences => Value::from(Serde(sentences)),
        front_data => Value::from_safe_string(in_script(&front)?),
    };
    render_extended(report, PAGE, more, live)
}
