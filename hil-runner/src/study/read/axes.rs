//! From `[[axis]]` of a study file to axes.

use super::file::{AxisFile, Findings, StudyFile};
use crate::study::picture::is_text;
use crate::study::plan::axis::{Axis, AxisValue, Range, Scale, Spread};
use crate::study::plan::points::PlanKind;
use hil_core::runfile::KeyPath;

/// Most values of an axis: more are rather a slip of the keyboard.
const MOST_VALUES: u64 = 1_000_000_000;

pub(super) fn axes(file: &StudyFile, findings: &mut Findings<'_>) -> Vec<Axis> {
    let mut axes: Vec<Axis> = Vec::new();
    for described in &file.axis {
        let (span, path) = (described.key.span(), described.key.get_ref());
        let axis = KeyPath::find(path).map(|key| axis(described, key, &axes, file.plan));
        match axis {
            Ok(Ok(axis)) => axes.push(axis),
            Ok(Err(sentence)) => findings.push(span, format!("axis {path}: {sentence}")),
            Err(sentence) => findings.push(span, sentence),
        }
    }
    axes
}

/// An axis beside others.
///
/// # Errors
/// The sentence that says what is allowed.
fn axis(file: &AxisFile, key: KeyPath, others: &[Axis], plan: PlanKind) -> Result<Axis, String> {
    let path = key.path();
    if path == "controller.law" {
        return Err("give the rungs at the top: rungs = [\"sampled\", \"quantised\"]".to_owned());
    }
    if matches!(path.as_str(), "name" | "template") || matches!(key.section, "budget" | "target") {
        let words = "it changes nothing in the runs of a study; an axis is over a key that does";
        return Err(words.to_owned());
    }
    if others.iter().any(|other| other.key.path() == path) {
        return Err("there is an axis over this key already".to_owned());
    }
    if let Some(other) = others.iter().find(|other| key.excludes(&other.key)) {
        let other = other.key.path();
        return Err(format!(
            "the axis over {other} gives the same in another way"
        ));
    }
    let times = file.times.as_ref();
    let times = times.map(|times| KeyPath::find(times.get_ref()));
    let times = times.transpose()?;
    let spread = spread(file, &key, plan)?;
    Ok(Axis { key, spread, times })
}

/// The values of an axis.
///
/// # Errors
/// The sentence that says what is allowed.
fn spread(file: &AxisFile, key: &KeyPath, plan: PlanKind) -> Result<Spread, String> {
    if file.labels.is_some() && file.values.is_none() {
        return Err("labels are for a list of values".to_owned());
    }
    if file.labels.is_some() && file.times.is_some() {
        return Err("labels are for values, and not for factors of another key".to_owned());
    }
    let range =
        file.from.is_some() || file.to.is_some() || file.points.is_some() || file.scale.is_some();
    match (&file.values, range, &file.distribution) {
        (Some(values), false, None) => list(file, values.get_ref(), key),
        (None, true, None) => {
            let (Some(from), Some(to)) = (file.from, file.to) else {
                return Err("a range needs from and to".to_owned());
            };
            let scale = file.scale.unwrap_or_default();
            if !(to - from).is_finite() || (scale == Scale::Log && !(from > 0.0 && to > 0.0)) {
                return Err(format!(
                    "a range needs finite from and to and a finite distance, on a log scale both greater than 0, not {from} and {to}"
                ));
            }
            let points = match (file.points, plan) {
                (Some(points), PlanKind::Grid) => points,
                (None, PlanKind::Grid) => {
                    return Err("a range needs points, the number of its values".to_owned());
                }
                (Some(points), _) => {
                    return Err(format!(
                        "points = {points} is not allowed: plan = {:?} draws from the whole range, runs of them",
                        plan.name()
                    ));
                }
                (None, _) => 1,
            };
            if points == 0 || points > MOST_VALUES || (points > 1 && from == to) {
                return Err(format!(
                    "points = {points} is not allowed: from 1 to {MOST_VALUES}, and more than 1 only where from and to differ"
                ));
            }
            Ok(Spread::Range(Range {
                from,
                to,
                points,
                scale,
            }))
        }
        (None, false, Some(_)) if plan == PlanKind::Grid => Err(
            "a distribution needs a plan that draws: plan = \"latin-hypercube\", \"sobol\" or \"random\"; \
             on a grid give values or from, to and points"
                .to_owned(),
        ),
        (None, false, Some(distribution)) => {
            distribution.check()?;
            Ok(Spread::Random(*distribution))
        }
        (None, false, None) => Err(
            "it has no values; give values, or from, to and points, or a distribution".to_owned(),
        ),
        _ => Err("give one of values; from, to and points; distribution".to_owned()),
    }
}

fn list(file: &AxisFile, values: &[toml::Value], key: &KeyPath) -> Result<Spread, String> {
    let (labels, is_factor) = (file.labels.as_deref(), file.times.is_some());
    if values.is_empty() {
        return Err("the list of values is empty; an axis has at least one".to_owned());
    }
    if labels.is_some_and(|labels| labels.len() != values.len()) {
        let count = values.len();
        return Err(format!("labels must be as many as values, {count}"));
    }
    for (place, label) in labels.unwrap_or_default().iter().enumerate() {
        let known = labels.unwrap_or_default()[..place].contains(label);
        if label.trim().is_empty() || !is_text(label) || known {
            return Err(format!(
                "label {label:?} is not allowed: each once, with at least one character, all of them text"
            ));
        }
    }
    let one = |(place, value): (usize, &toml::Value)| {
        let whole = value.as_integer().map(|whole| whole as f64);
        let number = whole.or(value.as_float());
        if is_factor && number.is_none() {
            return Err(format!(
                "{value} is no number, and with times every value is one"
            ));
        }
        if number.is_some_and(|number| !number.is_finite()) {
            return Err(format!("{value} is no finite number"));
        }
        if let Some(number) = number
            && labels.is_none()
        {
            // What a range would round is refused in a list: it is meant so.
            let taken = key.value(number).number().unwrap_or(f64::NAN);
            if !is_factor && (taken - number).abs() > 1e-15_f64.max(1e-12 * number.abs()) {
                return Err(format!("{value} is not allowed: {}", key.key.allowed()));
            }
            return Ok(AxisValue::Number(number));
        }
        let toml = value.to_string();
        let text = value.as_str().unwrap_or(&toml);
        if !is_text(text) {
            return Err(format!("{text:?} has characters that are no text"));
        }
        let label = labels.and_then(|labels| labels.get(place));
        let label = label.map_or(text, String::as_str).to_owned();
        Ok(AxisValue::Other { toml, label })
    };
    let list: Result<Vec<_>, String> = values.iter().enumerate().map(one).collect();
    Ok(Spread::List(list?))
}
