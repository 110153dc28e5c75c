//! The page of a tune: the report of before and after, with what was found and what all the
//! settings seen tell together.

use std::collections::BTreeMap;

use hil_core::figures::{self, Figure};
use hil_core::report::Report;
use hil_core::tune::outcome::{Point, TuneOutcome};
use minijinja::value::Serde;
use minijinja::{Value, context};
use serde_json::json;

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
    let aims = outcome.aims.iter().map(|aim| aim.figure);
    let requirements = outcome.requirements.iter().map(|row| row.figure);
    let tolerances = outcome
        .tolerance
        .iter()
        .flat_map(|tolerance| &tolerance.each);
    let figures = aims.clone().chain(requirements);
    let figures = figures.chain(tolerances.map(|row| row.figure));
    let words: BTreeMap<&str, Value> = figures
        .filter_map(|key| Some((key, words(figures::find(key)?))))
        .collect();
    let sets = |point: &Point| -> Vec<String> {
        // A page has the profile in itself.
        let needed = outcome
            .needed
            .iter()
            .filter(|row| row.key != "motion.profile");
        let needed = needed.map(|row| (&row.key, &row.value));
        let keys = outcome.keys.iter().map(|row| &row.key);
        let all = needed.chain(keys.zip(&point.values));
        all.map(|(key, value)| format!("{key}={value}")).collect()
    };
    let front = json!({
        "front": outcome.front,
        // What a click on each opens in the simulator.
        "sets": live.map(|_| outcome.front.iter().map(sets).collect::<Vec<_>>()),
        "after": outcome.aims.iter().map(|aim| aim.after).collect::<Vec<_>>(),
        "labels": aims.filter_map(figures::find).map(|figure| {
            json!({ "key": figure.key, "label": figure.label, "unit": figure.unit })
        }).collect::<Vec<_>>(),
    });
    let more = context! {
        tune => Value::from(Serde(outcome)),
        words,
        sentences => Value::from(Serde(sentences)),
        front_data => Value::from_safe_string(in_script(&front)?),
    };
    render_extended(report, PAGE, more, live)
}

fn words(figure: &Figure) -> Value {
    context! { label => figure.label, unit => figure.unit }
}
