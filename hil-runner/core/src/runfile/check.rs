//! Holds a tree against the table of keys: unknown and missing keys, types and
//! ranges. What is right comes out as values, each with its place for messages
//! that concern several of them, which `consistency` has.

use super::errors::{Findings, Place, Problem, one_line};
use super::key_path::{self, Hint};
use super::keys::{
    Key, Kind, LARGEST_MAGNITUDE, LONGEST_TIME_S, Need, Range, SMALLEST_MAGNITUDE, Section, path,
};
use super::table::{self, SECTIONS};
use super::tree::{Node, Number, Table, Toml, nanoseconds};
use super::values::{Setting, Value, show_number};
use crate::case::Law;

/// Checks every key of the table and every key of the tree.
pub(super) fn check(tree: &Table, findings: &mut Findings) -> Values {
    let mut values = Values::default();
    let meant = report_unknown(tree, findings);
    for section in SECTIONS {
        let node = tree.get(section.name);
        let table = tree.section(section.name);
        match node {
            Some(node) if table.is_none() => {
                let because = format!("{0} is a section; write [{0}]", section.name);
                not_allowed(findings, node, section.name, because);
                continue;
            }
            None if table.is_none()
                && section.is_required()
                && !meant.contains(&("", section.name)) =>
            {
                findings.push_missing(None, lacks_section(section));
            }
            _ => {}
        }
        for key in section.keys {
            let entry = if let Some(node) = table.and_then(|table| table.get(key.name)) {
                let checked = check_value(key, node).map_err(|because| {
                    not_allowed(findings, node, &path(section.name, key.name), because);
                });
                Some(Entry {
                    place: Some(node.place.clone()),
                    text: node.text.clone(),
                    value: checked.ok(),
                })
            } else {
                let excused = meant.contains(&(section.name, key.name));
                if let Some(table) = table.filter(|_| !excused)
                    && let Some(words) = missing_words(key, section, table, tree)
                {
                    let place = node.map(|node| &node.place);
                    let line = match place {
                        Some(Place::Line(line)) => format!(" (line {line})"),
                        _ => String::new(),
                    };
                    let sentence = format!("[{}]{line} lacks {words}", section.name);
                    findings.push_missing(place, sentence);
                }
                key.default().map(|value| Entry {
                    place: None,
                    text: value.to_toml(),
                    value: Some(value),
                })
            };
            let entry = entry.map(|entry| (section.name, key, entry));
            values.entries.extend(entry);
        }
    }
    values
}

/// A key as a message shows it: in quotes if TOML would need them.
fn show_key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        one_line(name, 60)
    } else {
        one_line(&format!("{name:?}"), 60)
    }
}

fn not_allowed(findings: &mut Findings, node: &Node, key: &str, because: String) {
    let problem = Problem::NotAllowed {
        key: key.to_owned(),
        text: node.text.clone(),
        because,
    };
    findings.push(node.place.clone(), problem);
}

/// Reports what is not in the table; returns the keys (with their section) and
/// sections (with an empty one) that were probably meant. Those are not
/// reported as missing on top.
fn report_unknown(tree: &Table, findings: &mut Findings) -> Vec<(&'static str, &'static str)> {
    let mut meant = Vec::new();
    let mut tell = |section: &'static str, what: String, node: &Node, hint: Hint| {
        findings.push(node.place.clone(), hint.problem(what));
        meant.extend(hint.meant.into_iter().map(|name| (section, name)));
    };
    let of_top = |name: &str| table::find("").is_some_and(|top| top.key(name).is_some());
    for (name, node) in &tree.entries {
        let section = table::find(name).filter(|_| !name.is_empty());
        match (section, &node.value) {
            (Some(section), Toml::Table(table)) => {
                let unknown = |(name, _): &&(String, Node)| section.key(name).is_none();
                for (name, node) in table.entries.iter().filter(unknown) {
                    let what = format!("key {}.{}", section.name, show_key(name));
                    tell(section.name, what, node, key_path::key(section.name, name));
                }
            }
            (Some(_), _) => {}
            (None, _) if of_top(name) => {}
            (None, Toml::Table(_) | Toml::Array(_)) => {
                let what = format!("section [{}]", show_key(name));
                tell("", what, node, key_path::section(name));
            }
            (None, _) => {
                let what = format!("key {}", show_key(name));
                tell("", what, node, key_path::key("", name));
            }
        }
    }
    meant
}

/// The key that is missing if this one is not there, with its description.
fn missing_words(key: &Key, section: &Section, table: &Table, tree: &Table) -> Option<String> {
    let told = |section: &str, key: &str| match tree.section(section)?.get(key)?.value {
        Toml::Text(ref text) => Some(text.as_str()),
        _ => None,
    };
    let missing = match key.need {
        Need::Always => true,
        Need::ElasticJoint => told("transmission", "joint") != Some("rigid"),
        // An unknown law is reported as such; what it needs is not known.
        Need::SampledLaw => matches!(
            told("controller", "law"),
            Some("sampled" | "quantised" | "firmware")
        ),
        Need::OneOf(partner) => {
            if table.get(partner).is_some() || !section.leads(key) {
                return None;
            }
            let description = section.key(partner).map(Key::description);
            let description = description.unwrap_or_default();
            let (name, own) = (key.name, key.description());
            return Some(format!("{name} or {partner}: {own}; or {description}"));
        }
        _ => false,
    };
    missing.then(|| format!("{}: {}", key.name, key.description()))
}

fn lacks_section(section: &Section) -> String {
    let name_of = |key: &Key| match key.need {
        // The pair is named with its first key.
        Need::OneOf(partner) => section
            .leads(key)
            .then(|| format!("{} or {partner}", key.name)),
        Need::Always | Need::ElasticJoint | Need::SampledLaw => Some(key.name.to_owned()),
        _ => None,
    };
    let keys: Vec<String> = section.keys.iter().filter_map(name_of).collect();
    let name = section.name;
    format!("lacks the section [{name}] with {}", keys.join(", "))
}

/// The value if it is what the key allows.
///
/// # Errors
/// The sentence that says what is allowed.
pub(super) fn check_value(key: &Key, node: &Node) -> Result<Value, String> {
    let must = |words: &str| Err(format!("the {} must be {words}", key.subject()));
    let wrong_type = |noun: &str| {
        let is = node.value.type_words();
        must(&format!("{noun}{}, not {is}", key.allowed()))
    };
    match (key.kind, &node.value) {
        (Kind::Text, Toml::Text(text)) => {
            if text.trim().is_empty() || text.chars().any(char::is_control) {
                return must("a string in one line that is not empty");
            }
            Ok(Value::Text)
        }
        (Kind::Flag, Toml::Flag(flag)) => Ok(Value::Flag(*flag)),
        (Kind::Choice(choices), Toml::Text(text)) => {
            match choices.iter().find(|choice| *choice == text) {
                Some(choice) => Ok(Value::Choice(choice)),
                None => must(&key.allowed()),
            }
        }
        (Kind::Number(range), Toml::Number(number)) => {
            let checked = check_number(number.value, range, key);
            checked.map(Value::Number).or_else(|words| must(&words))
        }
        (Kind::Whole(low, high), Toml::Number(Number { value, .. })) => {
            // Exact: the limits of the table are far below 2^53.
            let inside = (low as f64..=high as f64).contains(value);
            if !inside || value.fract() != 0.0 {
                return must(&key.allowed());
            }
            Ok(Value::Whole(*value as i64))
        }
        (Kind::TimeOrWord(_, word), Toml::Text(text)) if text == word => Ok(Value::Choice(word)),
        (Kind::Time(range) | Kind::TimeOrWord(range, _), Toml::Number(number)) => {
            let time = check_time(number, range, key);
            time.map(Value::Nanoseconds).or_else(|words| must(&words))
        }
        (Kind::Intervals, Toml::Array(items)) => check_intervals(items, key),
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
/// Condition on the number.
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
/// Condition on the time.
fn check_time(number: &Number, range: Range, key: &Key) -> Result<u64, String> {
    let value = check_number(number.value, range, key)?;
    if value > LONGEST_TIME_S {
        return Err(format!("at most {} s", show_number(LONGEST_TIME_S)));
    }
    match nanoseconds(&number.decimal) {
        Some(ns) if ns > 0 || range != Range::Positive => Ok(ns),
        _ => Err("a whole number of nanoseconds".to_owned()),
    }
}

/// # Errors
/// The sentence that says what is allowed.
fn check_intervals(items: &[Node], key: &Key) -> Result<Value, String> {
    let mut intervals = [0.0; 7];
    if items.len() != intervals.len() {
        let (meaning, allowed, count) = (key.subject(), key.allowed(), items.len());
        return Err(format!("the {meaning} must be {allowed}, not {count}"));
    }
    let mut wrong = Vec::new();
    for (index, (slot, item)) in intervals.iter_mut().zip(items).enumerate() {
        match item.value {
            Toml::Number(Number { value, .. }) if (0.0..=LARGEST_MAGNITUDE).contains(&value) => {
                // What is this short is no interval; see `LARGEST_MAGNITUDE`.
                let counts = value >= SMALLEST_MAGNITUDE;
                *slot = if counts { value } else { 0.0 };
            }
            _ => wrong.push(format!("t{} is {}", index + 1, item.text)),
        }
    }
    if wrong.is_empty() {
        return Ok(Value::Intervals(intervals));
    }
    Err(format!(
        "{}; every interval must be a number of seconds from 0 to {}",
        wrong.join(", "),
        show_number(LARGEST_MAGNITUDE)
    ))
}

/// A key that is given or has a default.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    /// Place in the file; [`None`] for the default, the value that holds without the key.
    pub(super) place: Option<Place>,
    /// As it was written.
    pub(super) text: String,
    /// [`None`] if it was refused.
    value: Option<Value>,
}

/// All keys that are given or have a default.
#[derive(Debug, Clone, Default)]
pub(super) struct Values {
    entries: Vec<(&'static str, &'static Key, Entry)>,
}

impl Values {
    pub(super) fn entry(&self, key: &str) -> Option<&Entry> {
        let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
        self.entries
            .iter()
            .find(|(s, k, _)| *s == section && k.name == name)
            .map(|(_, _, entry)| entry)
    }

    /// True if the file or the command line says anything about the key, right
    /// or wrong.
    pub(super) fn is_given(&self, key: &str) -> bool {
        self.entry(key).is_some_and(|entry| entry.place.is_some())
    }

    /// Section, key and entry of what the file or the command line sets to
    /// another value than its default.
    pub(super) fn set(&self) -> impl Iterator<Item = (&'static str, &'static Key, &Entry)> {
        let entries = self.entries.iter();
        let other =
            |key: &Key, entry: &Entry| entry.value.is_none() || entry.value != key.default();
        entries
            .filter(move |(_, key, entry)| entry.place.is_some() && other(key, entry))
            .map(|(section, key, entry)| (*section, *key, entry))
    }

    /// Every key that has a value, in the order of the table.
    pub(super) fn valid(&self) -> impl Iterator<Item = (&'static Key, Value)> {
        self.entries
            .iter()
            .filter_map(|(_, key, entry)| Some((*key, entry.value?)))
    }

    /// `controller.sample_time_s = 0.001 (line 40)`, for a sentence about
    /// another key.
    pub(super) fn quote(&self, key: &str) -> String {
        let Some(entry) = self.entry(key) else {
            return key.to_owned();
        };
        let origin = match &entry.place {
            None => "the default".to_owned(),
            Some(Place::File) => "the file".to_owned(),
            Some(Place::Line(line)) => format!("line {line}"),
            Some(Place::Set(_)) => "by --set".to_owned(),
        };
        format!("{key} = {} ({origin})", entry.text)
    }

    /// The value of a key, unless it was refused.
    pub(super) fn value(&self, key: &str) -> Option<Value> {
        self.entry(key)?.value
    }

    /// The same as a setting of a case.
    pub(super) fn get<T: Setting>(&self, key: &str) -> Option<T> {
        T::of(self.value(key)?)
    }

    /// Paths of the keys beyond the paper's law that a rung leaves out.
    pub(super) fn without_effect(&self, law: Law) -> Vec<String> {
        self.set()
            .filter(|(_, key, _)| key.is_of_firmware() && law != Law::Firmware)
            .map(|(section, key, _)| path(section, key.name))
            .collect()
    }
}
