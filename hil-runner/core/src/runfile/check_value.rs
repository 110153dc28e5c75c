//! Type and range of one value.

use super::keys::show_number;
use super::keys::{Key, Kind, LARGEST_MAGNITUDE, LONGEST_TIME_S, Range, SMALLEST_MAGNITUDE};
use super::nanoseconds::from_decimal_seconds;
use super::tree::{Node, Number, Value};
use super::values::Checked;

/// The value if it is what the key allows.
///
/// # Errors
/// The sentence that says what is allowed.
pub(super) fn check_value(key: &Key, node: &Node) -> Result<Checked, String> {
    let must = |words: &str| Err(format!("the {} must be {words}", key.subject()));
    let wrong_type = |noun: &str| {
        let is = node.value.type_words();
        must(&format!("{noun}{}, not {is}", key.allowed()))
    };
    match (key.kind, &node.value) {
        (Kind::Text, Value::Text(text)) => {
            if text.trim().is_empty() || text.chars().any(char::is_control) {
                return must("a string in one line that is not empty");
            }
            Ok(Checked::Text(text.clone()))
        }
        (Kind::Flag, Value::Flag(flag)) => Ok(Checked::Flag(*flag)),
        (Kind::Choice(choices), Value::Text(text)) => {
            match choices.iter().find(|choice| *choice == text) {
                Some(choice) => Ok(Checked::Choice(choice)),
                None => must(&key.allowed()),
            }
        }
        (Kind::Number(range), Value::Number(number)) => {
            match check_number(number.value, range, key) {
                Ok(value) => Ok(Checked::Number(value)),
                Err(words) => must(&words),
            }
        }
        (Kind::Whole(low, high), Value::Number(Number { value, .. })) => {
            // Exact: the limits of the table are far below 2^53.
            let inside = (low as f64..=high as f64).contains(value);
            if !inside || value.fract() != 0.0 {
                return must(&key.allowed());
            }
            Ok(Checked::Whole(*value as i64))
        }
        (Kind::Time(range), Value::Number(number)) => match check_time(number, range, key) {
            Ok(ns) => Ok(Checked::Nanoseconds(ns)),
            Err(words) => must(&words),
        },
        (Kind::TimeOrWord(_, word), Value::Text(text)) if text == word => Ok(Checked::Choice(word)),
        (Kind::TimeOrWord(range, _), Value::Number(number)) => {
            match check_time(number, range, key) {
                Ok(ns) => Ok(Checked::Nanoseconds(ns)),
                Err(words) => must(&words),
            }
        }
        (Kind::Intervals, Value::Array(items)) => check_intervals(items, key),
        (Kind::Number(Range::Any) | Kind::Whole(..) | Kind::Text | Kind::Intervals, _) => {
            wrong_type("")
        }
        (Kind::Number(_) | Kind::Time(_), _) => wrong_type("a number, "),
        // A string may be the right type and the wrong word.
        (Kind::TimeOrWord(..), _) => must(&format!("a number, {}", key.allowed())),
        (Kind::Flag | Kind::Choice(_), _) => must(&key.allowed()),
    }
}

/// # Errors
/// What the number must be.
pub(super) fn check_number(value: f64, range: Range, key: &Key) -> Result<f64, String> {
    let inside = match range {
        Range::Any => true,
        Range::Positive => value > 0.0,
        Range::NotNegative => value >= 0.0,
        Range::Between(low, high) => (low..=high).contains(&value),
    };
    if !value.is_finite() {
        let words = key.allowed();
        return Err(match range {
            Range::Any => words,
            _ => format!("a finite number, {words}"),
        });
    }
    if !inside {
        return Err(key.allowed());
    }
    if value != 0.0 && !(SMALLEST_MAGNITUDE..=LARGEST_MAGNITUDE).contains(&value.abs()) {
        return Err(format!(
            "from {} to {} in magnitude, so that what is derived from it can be computed",
            show_number(SMALLEST_MAGNITUDE),
            show_number(LARGEST_MAGNITUDE)
        ));
    }
    Ok(value)
}

/// # Errors
/// What the time must be.
fn check_time(number: &Number, range: Range, key: &Key) -> Result<u64, String> {
    let value = check_number(number.value, range, key)?;
    if value > LONGEST_TIME_S {
        return Err(format!("at most {} s", show_number(LONGEST_TIME_S)));
    }
    match from_decimal_seconds(&number.decimal) {
        Some(ns) if ns > 0 || range != Range::Positive => Ok(ns),
        _ => Err("a whole number of nanoseconds".to_owned()),
    }
}

/// # Errors
/// The sentence that says what is allowed.
fn check_intervals(items: &[Node], key: &Key) -> Result<Checked, String> {
    let mut intervals = [0.0; 7];
    if items.len() != intervals.len() {
        let (meaning, allowed, count) = (key.subject(), key.allowed(), items.len());
        return Err(format!("the {meaning} must be {allowed}, not {count}"));
    }
    let mut wrong = Vec::new();
    for (index, (slot, item)) in intervals.iter_mut().zip(items).enumerate() {
        match item.value {
            Value::Number(Number { value, .. }) if (0.0..=LARGEST_MAGNITUDE).contains(&value) => {
                // What is this short is no interval; see `LARGEST_MAGNITUDE`.
                *slot = if value < SMALLEST_MAGNITUDE {
                    0.0
                } else {
                    value
                };
            }
            _ => wrong.push(format!("t{} is {}", index + 1, item.text)),
        }
    }
    if wrong.is_empty() {
        return Ok(Checked::Intervals(intervals));
    }
    Err(format!(
        "{}; every interval must be a number of seconds from 0 to {}",
        wrong.join(", "),
        show_number(LARGEST_MAGNITUDE)
    ))
}
