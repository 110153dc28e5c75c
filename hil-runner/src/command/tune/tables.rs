//! What a tune tells on the terminal.

use hil_core::tune::outcome::{AimRow, KeyRow, Point, RequirementRow, TuneOutcome};
use hil_core::{figures, number};

use crate::command::options::once_each;
use crate::command::terminal;

fn shown(value: Option<f64>) -> String {
    number::shown(value, None)
}

/// What a tune tells, in tables and sentences.
pub(super) fn tables(outcome: &TuneOutcome, sentences: &[String]) -> String {
    let mut text = starts_table(outcome) + &keys_table(outcome);
    for need in &outcome.needed {
        text += &format!("{} = {} is set: {}\n", need.key, need.value, need.because);
    }
    text += &aims_table(outcome);
    text += &requirements_table(outcome);
    for sentence in sentences {
        text += &format!("{sentence}\n");
    }
    if !outcome.front.is_empty() && outcome.aims.len() > 1 {
        text += &match outcome.front.len() {
            1 => "the front has one point\n".to_owned(),
            many => format!("{many} points of the front are in tune.json and on the page\n"),
        };
    }
    if let Some(tolerance) = &outcome.tolerance {
        let percent = tolerance.yield_percent;
        let [before, after] = percent.map(|part| number::rounded(part, 3));
        text += &format!(
            "of {} axes drawn from their tolerance {before} % keep all requirements and limits before, {after} % after\n",
            tolerance.axes
        );
    }
    text
}

/// What requirements cost, or which would have to give way, and optima that are nearly as good.
pub(super) fn sentences(outcome: &TuneOutcome) -> Vec<String> {
    let requirements = outcome.requirements.iter();
    let requirements = requirements.filter_map(|required| sentence(outcome, required));
    let others = outcome.others.iter().map(|other| {
        let (keys, aims) = (setting(outcome, other), aims_in_words(outcome, &other.aims));
        format!("another optimum is nearly as good: {keys}: {aims}")
    });
    let ends = outcome.keys.iter().filter_map(at_an_end);
    let mut all: Vec<String> = requirements.chain(ends).chain(others).collect();
    if !outcome.feasible {
        let none = "INFEASIBLE: no setting seen keeps all requirements; there is no tuned.toml";
        all.push(none.to_owned());
    }
    all
}

/// Part of a value within which it is at an end of its range.
const AT_AN_END: f64 = 0.01;

/// A key that would go on beyond its range.
fn at_an_end(row: &KeyRow) -> Option<String> {
    let after: f64 = row.after.parse().ok()?;
    let is_there = |end: &&String| {
        let end = end.parse::<f64>();
        end.is_ok_and(|end| (after - end).abs() <= AT_AN_END * end.abs())
    };
    let end = row.range.iter().find(is_there)?;
    Some(format!(
        "{} ends at the {end} of its range: [tune.range] can give it another one",
        row.key
    ))
}

/// The starts, a line each, and where they come from.
fn starts_table(outcome: &TuneOutcome) -> String {
    let figures = outcome.aims.iter().map(|aim| aim.figure);
    let figures = figures.chain(outcome.requirements.iter().map(|required| required.figure));
    let figures = figures.map(|figure| figure.replace('_', "\n"));
    let header = core::iter::once("start".to_owned()).chain(figures);
    let rows = outcome.starts.iter().filter_map(|start| {
        let point = start.point.as_ref()?;
        let values = point.aims.iter().chain(&point.requirements);
        let name = core::iter::once(start.name.clone());
        let cells = name.chain(values.map(|value| shown(*value)));
        Some(cells.collect::<Vec<_>>())
    });
    let mut text = terminal::table(header, 1, rows);
    for start in &outcome.starts {
        if let Some(why) = &start.none {
            text += &format!("{}: {why}\n", start.name);
        } else if !start.source.is_empty() {
            text += &format!("{}: {}\n", start.name, start.source);
        }
    }
    text
}

fn keys_table(outcome: &TuneOutcome) -> String {
    let header = ["key", "before", "after", "unit", "from", "to"];
    let rows = outcome.keys.iter().map(|row| {
        let [from, to] = row.range.clone();
        let (key, before, after) = (row.key.clone(), row.before.clone(), row.after.clone());
        [key, before, after, row.unit.to_owned(), from, to]
    });
    let mut text = terminal::table(header, 1, rows);
    let origins = outcome.keys.iter().filter(|row| !row.origin.is_empty());
    let origins = origins.map(|row| (row.key.clone(), row.origin.to_owned()));
    for (keys, origin) in once_each(origins) {
        text += &format!("range of {keys}: {origin}\n");
    }
    text
}

fn aims_table(outcome: &TuneOutcome) -> String {
    let header = ["aim", "weight", "before", "after", "unit"];
    let rows = outcome.aims.iter().map(|aim| {
        [
            aim.figure.to_owned(),
            number::table(aim.weight),
            shown(aim.before),
            shown(aim.after),
            figures::unit(aim.figure).to_owned(),
        ]
    });
    let of = match outcome.corners.len() {
        1 => String::new(),
        many => format!("the worst of {many} axes:\n"),
    };
    of + &terminal::table(header, 1, rows)
}

fn requirements_table(outcome: &TuneOutcome) -> String {
    let header = ["required", "", "before", "after", "unit", ""];
    let rows = outcome.requirements.iter().map(|required| {
        [
            required.figure.to_owned(),
            limit(required),
            shown(required.before),
            shown(required.after),
            unit(required).to_owned(),
            if required.kept { "kept" } else { "BROKEN" }.to_owned(),
        ]
    });
    terminal::table(header, 1, rows)
}

fn limit(required: &RequirementRow) -> String {
    let sign = if required.at_least { '≥' } else { '≤' };
    match required.of_before {
        true => format!("{sign} before"),
        false => format!("{sign} {}", number::table(required.limit)),
    }
}

fn unit(required: &RequirementRow) -> &'static str {
    match required.of_before {
        true => "× before",
        false => figures::unit(required.figure),
    }
}

/// What a requirement costs, or where it would have to give way.
fn sentence(outcome: &TuneOutcome, required: &RequirementRow) -> Option<String> {
    let figure = required.figure;
    if let Some(price) = &required.price {
        let percent = number::rounded(100.0 * price.relaxed_by, 2);
        let change = price.change.iter().zip(&outcome.aims);
        let change = change.filter_map(|(change, aim)| {
            let change = change.map(number::relative_error)?;
            Some(in_words(aim, &change))
        });
        let change = change.collect::<Vec<_>>().join(", ");
        let words = format!("{figure} binds: {percent} % of its limit would buy {change}");
        return Some(words);
    }
    let at = required.gives_way_at.filter(|_| !required.kept)?;
    Some(format!(
        "INFEASIBLE: {figure} {} would have to give way to {} for the other requirements to be kept",
        limit(required),
        format!("{} {}", number::table(at), unit(required)).trim_end()
    ))
}

fn setting(outcome: &TuneOutcome, point: &Point) -> String {
    let keys = outcome.keys.iter().zip(&point.values);
    let shown = |value: &String| value.parse().map_or_else(|_| value.clone(), number::table);
    let keys: Vec<String> = keys
        .map(|(key, value)| format!("{} = {}", key.key, shown(value)))
        .collect();
    keys.join(", ")
}

fn aims_in_words(outcome: &TuneOutcome, values: &[Option<f64>]) -> String {
    let aims = outcome.aims.iter().zip(values);
    let aims = aims.map(|(aim, value)| in_words(aim, &shown(*value)));
    aims.collect::<Vec<String>>().join(", ")
}

fn in_words(aim: &AimRow, value: &str) -> String {
    format!("{} {value} {}", aim.figure, figures::unit(aim.figure))
}
