//! Holds a tree against the table of keys: unknown and missing keys, types and
//! ranges. What is right comes out as values, each with its place for messages
//! that concern several of them, which `consistency` has.

use super::errors::{Findings, Place, Problem, one_line};
use super::key_path::{self, Hint};
use super::keys::{
    Key, Kind, LARGEST_MAGNITUDE, LONGEST_TIME_S, List, Need, Range, SMALLEST_MAGNITUDE, Section,
    Way, path,
};
use super::table::{self, LISTS, SECTIONS};
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
        let list = table::list_instead_of(section).filter(|list| tree.get(list.row.name).is_some());
        match node {
            Some(node) if table.is_none() => {
                let because = format!("{0} is a section; write [{0}]", section.name);
                not_allowed(findings, node, section.name, because);
                continue;
            }
            None if table.is_none()
                && section.is_required()
                && list.is_none()
                && !meant.contains(&("", section.name)) =>
            {
                findings.push_missing(None, lacks_section(section));
            }
            Some(node) if let Some(list) = list => {
                let because = match &node.place {
                    Place::Line(line) => format!("[{}] (line {line})", section.name),
                    Place::Set(set) => format!("--set {set}"),
                    _ => format!("[{}]", section.name),
                };
                let because = format!("{because} is there too; a file has one of them");
                if let Some(rows) = tree.get(list.row.name) {
                    not_allowed(findings, rows, list.row.name, because);
                }
            }
            _ => {}
        }
        let found = check_keys(section, (section.name, node, table), tree, &meant, findings);
        let named = |(key, entry)| (section.name, key, entry);
        values.entries.extend(found.into_iter().map(named));
    }
    for list in LISTS {
        let name = list.row.name;
        let Some(node) = tree.get(name) else { continue };
        let items = match &node.value {
            Toml::Array(items) => items.as_slice(),
            _ => &[],
        };
        let tables = items.iter().filter_map(|item| match &item.value {
            Toml::Table(table) => Some((item, table)),
            _ => None,
        });
        let tables: Vec<_> = tables.collect();
        if tables.len() != items.len() || items.is_empty() {
            let because = format!("{name} is a list of sections; write [[{name}]] for each");
            not_allowed(findings, node, name, because);
            continue;
        }
        for (index, (node, table)) in tables.into_iter().enumerate() {
            let path = format!("{name}.{}", index + 1);
            let at = (path.as_str(), Some(node), Some(table));
            let found = check_keys(&list.row, at, tree, &meant, findings);
            values.rows.push((list, found));
        }
    }
    values
}

/// Checks the keys of one section of a tree that is no run file.
pub(super) fn section(tree: &Table, name: &str, findings: &mut Findings) -> Values {
    let mut values = Values::default();
    if let (Some(section), Some(table)) = (table::find(name), tree.section(name)) {
        for (key, node) in &table.entries {
            if section.key(key).is_none() {
                let problem = key_path::key(name, key).problem(format!("key {}", path(name, key)));
                findings.push(node.place.clone(), problem);
            }
        }
        let at = (name, tree.get(name), Some(table));
        let found = check_keys(section, at, tree, &[], findings);
        let entries = found
            .into_iter()
            .map(|(key, entry)| (section.name, key, entry));
        values.entries.extend(entries);
    }
    values
}

/// The keys of a section, or of a row, that are given or have a default; `named` is how
/// messages call it.
fn check_keys(
    section: &'static Section,
    (named, node, table): (&str, Option<&Node>, Option<&Table>),
    tree: &Table,
    meant: &[(&'static str, &'static str)],
    findings: &mut Findings,
) -> Vec<(&'static Key, Entry)> {
    let mut entries = Vec::new();
    for key in section.keys {
        let entry = if let Some(node) = table.and_then(|table| table.get(key.name)) {
            let checked = check_value(key, node).map_err(|because| {
                not_allowed(findings, node, &path(named, key.name), because);
            });
            Some(Entry {
                place: Some(node.place.clone()),
                text: node.text.clone(),
                value: checked.ok(),
            })
        } else {
            let is_there = |name: &str| {
                meant.contains(&(section.name, name))
                    || table.is_some_and(|table| table.get(name).is_some())
            };
            if table.is_some()
                && !is_there(key.name)
                && let Some(words) = missing_words(key, section, &is_there, tree)
            {
                let place = node.map(|node| &node.place);
                let line = match place {
                    Some(Place::Line(line)) => format!(" (line {line})"),
                    _ => String::new(),
                };
                let sentence = format!("[{named}]{line} lacks {words}");
                findings.push_missing(place, sentence);
            }
            // Another way than that of the default is taken.
            let mut given = table.iter().flat_map(|table| &table.entries);
            let is_excluded = given.any(|(name, _)| section.excludes(key.name, name));
            let default = key.default().filter(|_| !is_excluded);
            default.map(|value| Entry {
                place: None,
                text: value.to_toml(),
                value: Some(value),
            })
        };
        entries.extend(entry.map(|entry| (key, entry)));
    }
    entries
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
            (None, value) if let Some(list) = table::find_list(name) => {
                let Toml::Array(items) = value else { continue };
                let tables = items.iter().filter_map(|item| match &item.value {
                    Toml::Table(table) => Some(table),
                    _ => None,
                });
                let entries = tables.flat_map(|table| &table.entries);
                for (name, node) in entries.filter(|(name, _)| list.row.key(name).is_none()) {
                    let what = format!("key {}.{}", list.row.name, show_key(name));
                    tell(
                        list.row.name,
                        what,
                        node,
                        key_path::key(list.row.name, name),
                    );
                }
            }
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

/// The words for what is missing if this key is not there: the key with its
/// description, or with the first of the keys of which one way would do, all the ways.
fn missing_words(
    key: &Key,
    section: &Section,
    is_there: &impl Fn(&str) -> bool,
    tree: &Table,
) -> Option<String> {
    let told = |section: &str, key: &str| match tree.section(section)?.get(key)?.value {
        Toml::Text(ref text) => Some(text.as_str()),
        _ => None,
    };
    let lacks = |key: &Key| match key.need {
        Need::Always => true,
        Need::ElasticJoint => told("transmission", "joint") != Some("rigid"),
        // An unknown law is reported as such; what it needs is not known.
        Need::SampledLaw => matches!(
            told("controller", "law"),
            Some("sampled" | "quantised" | "firmware")
        ),
        Need::CurrentDrive => told("drive", "kind") == Some("current"),
        Need::VoltageAtLimit => {
            told("drive", "kind") != Some("current") || is_there("current_bandwidth_hz")
        }
        _ => false,
    };
    let own = || format!("{}: {}", key.name, key.description());
    let ways = section.ways_with(key.name);
    if ways.is_empty() {
        return lacks(key).then(own);
    }
    // The ways that what is there leaves open, each with what it lacks. Without any
    // there are keys of two ways, which is told on its own.
    let names = ways.iter().copied().flatten().copied();
    let given: Vec<&str> = names.filter(|name| is_there(name)).collect();
    let open: Vec<Way> = (ways.iter().copied())
        .filter(|way| given.iter().all(|name| way.contains(name)))
        .collect();
    let missing = |way: &Way| -> Vec<&'static Key> {
        let keys = way.iter().filter(|name| !is_there(name));
        keys.filter_map(|name| section.key(name))
            .filter(|key| lacks(key))
            .collect()
    };
    let missing: Vec<Vec<&Key>> = open.iter().map(missing).collect();
    let has = |keys: &[&Key], name: &str| keys.iter().any(|key| key.name == name);
    if missing.iter().any(Vec::is_empty) || missing.is_empty() {
        return None;
    }
    if missing.iter().all(|keys| has(keys, key.name)) {
        // What --set has begun, --set must bring to its end.
        let mut nodes = given
            .iter()
            .filter_map(|name| tree.section(section.name)?.get(name));
        let set = nodes.find_map(|node| match &node.place {
            Place::Set(text) => Some(format!("; with --set {text} it must come by --set too")),
            _ => None,
        });
        return Some(own() + &set.unwrap_or_default());
    }
    let first = missing.first().and_then(|keys| keys.first())?;
    (first.name == key.name).then(|| {
        let leading = missing.iter().filter_map(|keys| keys.first());
        let described: Vec<String> = leading.map(|key| key.description()).collect();
        format!("{}: {}", section.ways_words(&open), described.join("; or "))
    })
}

fn lacks_section(section: &Section) -> String {
    let name_of = |key: &Key| match section.ways_with(key.name) {
        [] => key.need.is_required().then(|| key.name.to_owned()),
        // All ways stand where the first key of the first one would.
        ways @ [first, ..] => {
            let leads = section
                .parts(first)
                .0
                .first()
                .is_some_and(|k| k.name == key.name);
            leads.then(|| section.ways_words(ways))
        }
    };
    let keys: Vec<String> = section.keys.iter().filter_map(name_of).collect();
    let name = section.name;
    let rows = match table::list_instead_of(section) {
        Some(list) => format!(", or [[{}]]", list.row.name),
        None => String::new(),
    };
    format!("lacks the section [{name}] with {}{rows}", keys.join(", "))
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
        (Kind::NumberOrWord(_, word) | Kind::TimeOrWord(_, word), Toml::Text(text))
            if text == word =>
        {
            Ok(Value::Choice(word))
        }
        (Kind::Number(range) | Kind::NumberOrWord(range, _), Toml::Number(number)) => {
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
        (Kind::Time(range) | Kind::TimeOrWord(range, _), Toml::Number(number)) => {
            let time = check_time(number, range, key);
            time.map(Value::Nanoseconds).or_else(|words| must(&words))
        }
        (Kind::Intervals, Toml::Array(items)) => check_intervals(items, key),
        (Kind::Strings, Toml::Array(_)) | (Kind::Table, Toml::Table(_)) => Ok(Value::Text),
        (
            Kind::Number(Range::Any)
            | Kind::Whole(..)
            | Kind::Text
            | Kind::Intervals
            | Kind::Strings
            | Kind::Table,
            _,
        ) => wrong_type(""),
        (Kind::Number(_) | Kind::Time(_), _) => wrong_type("a number, "),
        // A string may be the right type and the wrong word.
        (Kind::NumberOrWord(..) | Kind::TimeOrWord(..), _) => {
            must(&format!("a number, {}", key.allowed()))
        }
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
    /// The rows of lists, each in the order of the file.
    rows: Vec<(&'static List, Vec<(&'static Key, Entry)>)>,
}

impl Values {
    pub(super) fn entry(&self, key: &str) -> Option<&Entry> {
        let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
        if let Some((list, number)) = section.split_once('.') {
            let row = number.parse::<usize>().ok()?.checked_sub(1)?;
            let (_, keys) = self.rows_of(list).nth(row)?;
            return keys
                .iter()
                .find(|(key, _)| key.name == name)
                .map(|(_, entry)| entry);
        }
        self.entries
            .iter()
            .find(|(s, k, _)| *s == section && k.name == name)
            .map(|(_, _, entry)| entry)
    }

    fn rows_of(
        &self,
        list: &str,
    ) -> impl Iterator<Item = &(&'static List, Vec<(&'static Key, Entry)>)> {
        self.rows
            .iter()
            .filter(move |(row, _)| row.row.name == list)
    }

    /// How messages and [`Values::entry`] call the rows of a list: `load.1`.
    pub(super) fn row_names(&self, list: &str) -> Vec<String> {
        let count = self.rows_of(list).count();
        (1..=count)
            .map(|number| format!("{list}.{number}"))
            .collect()
    }

    /// The rows of all lists, each with its keys that have a value.
    pub(super) fn rows(
        &self,
    ) -> impl Iterator<Item = (&'static List, impl Iterator<Item = (&'static Key, Value)>)> {
        self.rows.iter().map(|(list, keys)| {
            let valid = keys
                .iter()
                .filter_map(|(key, entry)| Some((*key, entry.value?)));
            (*list, valid)
        })
    }

    /// True if the file or the command line says anything about the key, right
    /// or wrong.
    pub(super) fn is_given(&self, key: &str) -> bool {
        self.entry(key).is_some_and(|entry| entry.place.is_some())
    }

    /// Section, key and entry of what the file or the command line says.
    pub(super) fn given(&self) -> impl Iterator<Item = (&'static str, &'static Key, &Entry)> {
        let given = self
            .entries
            .iter()
            .filter(|(_, _, entry)| entry.place.is_some());
        given.map(|(section, key, entry)| (*section, *key, entry))
    }

    /// The same where it is another value than the default.
    pub(super) fn set(&self) -> impl Iterator<Item = (&'static str, &'static Key, &Entry)> {
        let other =
            |key: &Key, entry: &Entry| entry.value.is_none() || entry.value != key.default();
        self.given()
            .filter(move |(_, key, entry)| other(key, entry))
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

#[cfg(test)]
mod tests {
    use super::super::keys::{section, value};
    use super::super::tree::parse_document;
    use super::*;

    /// A quantity of which one key belongs to two of three ways, and some may be left out.
    const MOTION: &[Key] = &[
        value("travel_mm", Kind::Number(Range::Any), "mm").meaning("travel"),
        value("intervals_s", Kind::Intervals, "s").meaning("intervals"),
        value("total_time_s", Kind::Number(Range::Positive), "s").optional("1.0"),
        value("acceleration", Kind::Number(Range::Positive), "m/s²").meaning("acceleration"),
        value("jerk", Kind::Number(Range::Positive), "m/s³").optional("1.0"),
        value("profile", Kind::Text, "").meaning("profile"),
    ];

    const WAYS: &[Way] = &[
        &["travel_mm", "intervals_s", "total_time_s"],
        &["travel_mm", "acceleration", "jerk"],
        &["profile"],
    ];

    /// What is missing beside these keys, a sentence each.
    fn missing(given: &str) -> Vec<String> {
        let section = section("motion", MOTION).ways(&[WAYS]);
        let lines = given.split_whitespace().map(|name| format!("{name} = 1\n"));
        let tree = parse_document(&format!("[motion]\n{}", lines.collect::<String>())).unwrap();
        let is_there = |name: &str| given.split_whitespace().any(|given| given == name);
        let keys = MOTION.iter().filter(|key| !is_there(key.name));
        keys.filter_map(|key| missing_words(key, &section, &is_there, &tree))
            .collect()
    }

    #[test]
    fn what_is_missing_is_that_of_the_ways_still_open() {
        for complete in [
            "travel_mm intervals_s",
            "travel_mm intervals_s total_time_s",
            "travel_mm acceleration",
            "travel_mm acceleration jerk",
            "profile",
        ] {
            assert_eq!(missing(complete), [""; 0], "{complete}");
        }
        let any = "travel_mm + intervals_s (+ total_time_s), travel_mm + acceleration (+ jerk) or profile: \
                   travel, mm, a finite number; or travel, mm, a finite number; or profile, \
                   a string that is not empty";
        let two = "travel_mm + intervals_s (+ total_time_s) or travel_mm + acceleration (+ jerk): \
                   intervals, seven numbers of seconds t1 to t7, each at least 0; or \
                   acceleration, m/s², greater than 0";
        assert_eq!(missing(""), [any]);
        assert_eq!(missing("travel_mm"), [two]);
        assert_eq!(
            missing("intervals_s"),
            ["travel_mm: travel, mm, a finite number"]
        );
        assert_eq!(missing("jerk").len(), 2);
        // Two ways at once are told elsewhere.
        assert_eq!(missing("profile jerk"), [""; 0]);
    }

    #[test]
    fn keys_of_two_ways_exclude_each_other() {
        let section = section("motion", MOTION).ways(&[WAYS]);
        assert!(section.is_required());
        let excluded = |key: &str| -> Vec<&str> {
            let names = MOTION.iter().map(|key| key.name);
            names.filter(|other| section.excludes(key, other)).collect()
        };
        assert_eq!(excluded("travel_mm"), ["profile"]);
        assert_eq!(
            excluded("total_time_s"),
            ["acceleration", "jerk", "profile"]
        );
        assert_eq!(excluded("strange"), [""; 0]);
    }
}
