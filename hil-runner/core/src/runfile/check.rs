//! Holds a tree against the table of keys: unknown and missing keys, types and
//! ranges. What is right comes out as values, each with its place for messages
//! that concern several of them, which `consistency` has.

use super::errors::{Findings, Place, one_line};
use super::key_path::{self, KeyPath, Unknown};
use super::keys::{
    Key, Kind, LARGEST_MAGNITUDE, LONGEST_TIME_S, List, Need, Range, SMALLEST_MAGNITUDE, Section,
    Way, path,
};
use super::table::{self, LISTS, SECTIONS};
use super::tree::{Node, Table, Toml, nanoseconds};
use super::values::{Setting, Value, show_number};
use crate::case::Law;

/// Checks every key of the table and every key of the tree.
pub(super) fn check(tree: &Table, findings: &mut Findings) -> Values {
    let mut values = Values::default();
    let meant = report_unknown(tree, findings);
    for section in SECTIONS {
        let node = tree.get(section.name);
        let table = tree.section(section.name);
        let list = table::list_instead_of(section);
        let rows = list.and_then(|list| Some((list.row.name, tree.get(list.row.name)?)));
        match (node, rows) {
            (Some(node), _) if table.is_none() => {
                let because = format!("{0} is a section; write [{0}]", section.name);
                findings.refuse(node, section.name, because);
                continue;
            }
            (Some(node), Some((name, rows))) => {
                let because = match &node.place {
                    Place::Line(line) => format!("[{}] (line {line})", section.name),
                    Place::Set(set) => format!("--set {set}"),
                    Place::File => format!("[{}]", section.name),
                };
                let because = format!("{because} is there too; a file has one of them");
                findings.refuse(rows, name, because);
            }
            // The top of the file, which is always there, is not required.
            (None, None) if section.is_required() && !meant.contains(&("", section.name)) => {
                findings.push_missing(None, lacks_section(section));
            }
            _ => {}
        }
        let part = Part::new(section, section.name.to_owned());
        let part = part.check(node, table, tree, &meant, findings);
        values.parts.push(part);
    }
    for list in LISTS {
        let name = list.row.name;
        let Some(node) = tree.get(name) else { continue };
        let rows = node.value.rows();
        if rows.is_empty() || rows.iter().any(|(_, table)| table.is_none()) {
            let because = format!("{name} is a list of sections; write [[{name}]] for each");
            findings.refuse(node, name, because);
            continue;
        }
        for (number, (node, table)) in (1..).zip(rows) {
            let part = Part {
                list: Some(list),
                ..Part::new(&list.row, format!("{name}.{number}"))
            };
            let checked = part.check(Some(node), table, tree, &meant, findings);
            values.parts.push(checked);
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
                let what = format!("key {}", path(name, key));
                findings.push(node.place.clone(), key_path::key(what, name, key).0);
            }
        }
        let part = Part::new(section, name.to_owned());
        let checked = part.check(tree.get(name), Some(table), tree, &[], findings);
        values.parts.push(checked);
    }
    values
}

/// What a file says in a section, or in a row of a list.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// How messages and [`Values::entry`] call it: `load.1` for the first row.
    pub(super) name: String,
    pub(super) section: &'static Section,
    /// The list of which it is a row.
    pub(super) list: Option<&'static List>,
    /// The keys that are given or have a default.
    pub(super) entries: Vec<(&'static Key, Entry)>,
}

impl Part {
    fn new(section: &'static Section, name: String) -> Self {
        Self {
            name,
            section,
            list: None,
            entries: Vec::new(),
        }
    }

    /// The part with its keys, from the table at a node.
    fn check(
        mut self,
        node: Option<&Node>,
        table: Option<&Table>,
        tree: &Table,
        meant: &[(&'static str, &'static str)],
        findings: &mut Findings,
    ) -> Self {
        let (section, nothing) = (self.section, Table::default());
        let (is_there, table) = (table.is_some(), table.unwrap_or(&nothing));
        for key in section.keys {
            let entry = if let Some(node) = table.get(key.name) {
                let checked = check_value(key, node).map_err(|because| {
                    findings.refuse(node, &path(&self.name, key.name), because);
                });
                Some(Entry {
                    place: Some(node.place.clone()),
                    text: node.text.clone(),
                    value: checked.ok(),
                })
            } else {
                let has =
                    |name: &str| meant.contains(&(section.name, name)) || table.get(name).is_some();
                if is_there
                    && !has(key.name)
                    && let Some(words) = missing_words(key, section, &has, tree)
                {
                    let place = node.map(|node| &node.place);
                    let line = match place {
                        Some(Place::Line(line)) => format!(" (line {line})"),
                        _ => String::new(),
                    };
                    let sentence = format!("[{}]{line} lacks {words}", self.name);
                    findings.push_missing(place, sentence);
                }
                // Another way than that of the default is taken.
                let excludes = |(name, _): &(String, _)| section.excludes(key.name, name);
                let default = key.default();
                let default = default.filter(|_| !table.entries.iter().any(excludes));
                default.map(|value| Entry {
                    place: None,
                    text: value.to_toml(),
                    value: Some(value),
                })
            };
            self.entries.extend(entry.map(|entry| (key, entry)));
        }
        self
    }
}

/// A key as a message shows it: in quotes if TOML would need them.
fn show_key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match !name.is_empty() && name.chars().all(bare) {
        true => one_line(name, 60),
        false => one_line(&format!("{name:?}"), 60),
    }
}

/// Reports what is not in the table; returns the keys (with their section) and
/// sections (with an empty one) that were probably meant. Those are not
/// reported as missing on top.
fn report_unknown(tree: &Table, findings: &mut Findings) -> Vec<(&'static str, &'static str)> {
    let mut meant = Vec::new();
    let mut tell = |section: &'static str, node: &Node, (problem, names): Unknown| {
        findings.push(node.place.clone(), problem);
        meant.extend(names.into_iter().map(|name| (section, name)));
    };
    let of_top = |name: &str| table::find("").is_some_and(|top| top.key(name).is_some());
    for (name, node) in &tree.entries {
        let section = table::find(name).filter(|_| !name.is_empty());
        let (known, tables): (_, Vec<&Table>) = if let Some(section) = section {
            (section, node.value.table().into_iter().collect())
        } else if of_top(name) {
            continue;
        } else if let Some(list) = table::find_list(name) {
            let rows = node.value.rows().into_iter();
            (&list.row, rows.filter_map(|(_, table)| table).collect())
        } else {
            let shown = show_key(name);
            let unknown = match node.value {
                Toml::Table(_) | Toml::Array(_) => {
                    key_path::section(format!("section [{shown}]"), name)
                }
                _ => key_path::key(format!("key {shown}"), "", name),
            };
            tell("", node, unknown);
            continue;
        };
        let entries = tables.into_iter().flat_map(|table| &table.entries);
        for (name, node) in entries.filter(|(name, _)| known.key(name).is_none()) {
            let what = format!("key {}.{}", known.name, show_key(name));
            tell(known.name, node, key_path::key(what, known.name, name));
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
    let told = |section: &str, key: &str| tree.section(section)?.get(key)?.value.text();
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
    let is_open = |way: &Way| given.iter().all(|name| way.contains(name));
    let open: Vec<Way> = ways.iter().copied().filter(is_open).collect();
    let missing = |way: &Way| -> Vec<&'static Key> {
        let absent = way.iter().filter(|name| !is_there(name));
        let keys = absent.filter_map(|name| section.key(name));
        keys.filter(|key| lacks(key)).collect()
    };
    let missing: Vec<Vec<&Key>> = open.iter().map(missing).collect();
    let has = |keys: &[&Key], name: &str| keys.iter().any(|key| key.name == name);
    if missing.iter().any(Vec::is_empty) || missing.is_empty() {
        return None;
    }
    if missing.iter().all(|keys| has(keys, key.name)) {
        // What --set has begun, --set must bring to its end.
        let nodes = given.iter();
        let mut nodes = nodes.filter_map(|name| tree.section(section.name)?.get(name));
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
            let (required, _) = section.parts(first);
            let leads = required.first().is_some_and(|first| first.name == key.name);
            leads.then(|| section.ways_words(ways))
        }
    };
    let keys: Vec<String> = section.keys.iter().filter_map(name_of).collect();
    let list = table::list_instead_of(section);
    let rows = list.map_or(String::new(), |list| format!(", or [[{}]]", list.row.name));
    let (name, keys) = (section.name, keys.join(", "));
    format!("lacks the section [{name}] with {keys}{rows}")
}

/// The value if it is what the key allows.
///
/// # Errors
/// The sentence that says what is allowed.
pub(super) fn check_value(key: &Key, node: &Node) -> Result<Value, String> {
    if let Some(word) = key.word.filter(|word| node.value.text() == Some(*word)) {
        return Ok(Value::Choice(word));
    }
    let allowed = || key.allowed();
    let is = node.value.type_words();
    let read = match (key.kind, &node.value) {
        (Kind::Intervals, Toml::Array(items)) => return check_intervals(items, key),
        (Kind::Text, Toml::Text(text)) => {
            let is_line = !text.trim().is_empty() && !text.chars().any(char::is_control);
            let words = || "a string in one line that is not empty".to_owned();
            is_line.then_some(Value::Text).ok_or_else(words)
        }
        (Kind::Flag, Toml::Flag(flag)) => Ok(Value::Flag(*flag)),
        (Kind::Choice(choices), Toml::Text(text)) => {
            let known = choices.iter().find(|choice| *choice == text);
            let known = known.map(|choice| Value::Choice(choice));
            known.ok_or_else(allowed)
        }
        (Kind::Number(range), Toml::Number(value, _)) => {
            check_number(*value, range, key).map(Value::Number)
        }
        (Kind::Whole(low, high), Toml::Number(value, _)) => {
            // Exact: the limits of the table are far below 2^53.
            let fits = (low as f64..=high as f64).contains(value) && value.fract() == 0.0;
            let whole = Value::Whole(*value as i64);
            fits.then_some(whole).ok_or_else(allowed)
        }
        (Kind::Time(range), Toml::Number(value, decimal)) => {
            check_time(*value, decimal, range, key).map(Value::Nanoseconds)
        }
        (Kind::Strings, Toml::Array(_)) | (Kind::Table, Toml::Table(_)) => Ok(Value::Text),
        // A string may be the right type and the wrong word.
        _ if key.word.is_some() => Err(format!("a number, {}", allowed())),
        (Kind::Flag | Kind::Choice(_), _) => Err(allowed()),
        (Kind::Number(range) | Kind::Time(range), _) if range != Range::Any => {
            Err(format!("a number, {}, not {is}", allowed()))
        }
        _ => Err(format!("{}, not {is}", allowed())),
    };
    read.map_err(|words| format!("the {} must be {words}", key.subject()))
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
    if !value.is_finite() && range != Range::Any {
        return Err(format!("a finite number, {}", key.allowed()));
    }
    if !inside || !value.is_finite() {
        return Err(key.allowed());
    }
    if value != 0.0 && !(SMALLEST_MAGNITUDE..=LARGEST_MAGNITUDE).contains(&value.abs()) {
        let [low, high] = [SMALLEST_MAGNITUDE, LARGEST_MAGNITUDE].map(show_number);
        return Err(format!(
            "from {low} to {high} in magnitude, so that what is derived from it can be computed"
        ));
    }
    Ok(value)
}

/// # Errors
/// Condition on the time.
fn check_time(value: f64, decimal: &str, range: Range, key: &Key) -> Result<u64, String> {
    let value = check_number(value, range, key)?;
    if value > LONGEST_TIME_S {
        return Err(format!("at most {} s", show_number(LONGEST_TIME_S)));
    }
    match nanoseconds(decimal) {
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
        match item.value.number() {
            Some(value) if (0.0..=LARGEST_MAGNITUDE).contains(&value) => {
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
    let (wrong, most) = (wrong.join(", "), show_number(LARGEST_MAGNITUDE));
    Err(format!(
        "{wrong}; every interval must be a number of seconds from 0 to {most}"
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
    pub(super) value: Option<Value>,
}

/// All keys that are given or have a default: the sections in the order of the table, then
/// the rows of lists, each in the order of the file.
#[derive(Debug, Clone, Default)]
pub(super) struct Values {
    pub(super) parts: Vec<Part>,
}

impl Values {
    pub(super) fn entry(&self, key: &str) -> Option<&Entry> {
        let (of, name) = key.rsplit_once('.').unwrap_or(("", key));
        let part = self.parts.iter().find(|part| part.name == of)?;
        let (_, entry) = part.entries.iter().find(|(key, _)| key.name == name)?;
        Some(entry)
    }

    /// How messages and [`Values::entry`] call the rows of a list: `load.1`.
    pub(super) fn row_names(&self, list: &str) -> impl Iterator<Item = &str> {
        let is_row = move |part: &&Part| part.list.is_some_and(|of| of.row.name == list);
        let rows = self.parts.iter().filter(is_row);
        rows.map(|part| part.name.as_str())
    }

    /// True if the file or the command line says anything about the key, right
    /// or wrong.
    pub(super) fn is_given(&self, key: &str) -> bool {
        self.entry(key).is_some_and(|entry| entry.place.is_some())
    }

    /// Path of the first key that says the same as another one in another way.
    pub(super) fn given_instead(&self, key: &KeyPath) -> Option<String> {
        let others = table::find(key.section)?.others(key.key.name);
        let mut paths = others.map(|other| path(key.section, other));
        paths.find(|path| self.is_given(path))
    }

    /// Section, key and entry of what the file or the command line says outside of lists.
    pub(super) fn given(&self) -> impl Iterator<Item = (&'static str, &'static Key, &Entry)> {
        let sections = self.parts.iter().filter(|part| part.list.is_none());
        let all = sections.flat_map(|part| {
            let entries = part.entries.iter();
            entries.map(|(key, entry)| (part.section.name, *key, entry))
        });
        all.filter(|(_, _, entry)| entry.place.is_some())
    }

    /// The same where it is another value than the default.
    pub(super) fn set(&self) -> impl Iterator<Item = (&'static str, &'static Key, &Entry)> {
        let given = self.given();
        given.filter(|(_, key, entry)| entry.value.is_none() || entry.value != key.default())
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
    use super::super::tree::parse_document;
    use super::*;

    /// A quantity of which one key belongs to two of three ways, and some may be left out.
    fn motion() -> &'static Section {
        table::find("motion").unwrap()
    }

    /// What is missing beside these keys, a sentence each.
    fn missing(given: &str) -> Vec<String> {
        let lines = given.split_whitespace().map(|name| format!("{name} = 1\n"));
        let tree = parse_document(&format!("[motion]\n{}", lines.collect::<String>())).unwrap();
        let is_there = |name: &str| given.split_whitespace().any(|given| given == name);
        let keys = motion().keys.iter().filter(|key| !is_there(key.name));
        keys.filter_map(|key| missing_words(key, motion(), &is_there, &tree))
            .collect()
    }

    #[test]
    fn what_is_missing_is_that_of_the_ways_still_open() {
        for complete in [
            "travel_mm intervals_s",
            "travel_mm intervals_s total_time_s",
            "travel_mm max_acceleration_mps2",
            "travel_mm max_acceleration_mps2 max_jerk_mps3",
            "profile",
        ] {
            assert_eq!(missing(complete), [""; 0], "{complete}");
        }
        let by_limits = "travel_mm + max_acceleration_mps2 (+ max_velocity_mps, max_jerk_mps3)";
        let travel = "travel h of the carriage, mm, a finite number";
        let any = format!(
            "travel_mm + intervals_s (+ total_time_s), {by_limits} or profile: {travel}; or {travel}; \
             or CSV file with the points of the command, relative to the run file, a string that is \
             not empty"
        );
        let two = format!(
            "travel_mm + intervals_s (+ total_time_s) or {by_limits}: list of the motion's intervals, \
             seven numbers of seconds t1 to t7, each at least 0; or largest acceleration of the \
             command, m/s², greater than 0"
        );
        assert_eq!(missing(""), [any]);
        assert_eq!(missing("travel_mm"), [two]);
        assert_eq!(missing("intervals_s"), [format!("travel_mm: {travel}")]);
        assert_eq!(missing("max_jerk_mps3").len(), 2);
        // Two ways at once are told elsewhere.
        assert_eq!(missing("profile max_jerk_mps3"), [""; 0]);
    }

    #[test]
    fn keys_of_two_ways_exclude_each_other() {
        assert!(motion().is_required());
        let excluded = |key: &str| -> Vec<&str> {
            let names = motion().keys.iter().map(|key| key.name);
            let excluded = names.filter(|other| motion().excludes(key, other));
            excluded.collect()
        };
        assert_eq!(excluded("travel_mm"), ["profile"]);
        assert_eq!(
            excluded("total_time_s"),
            [
                "max_acceleration_mps2",
                "max_velocity_mps",
                "max_jerk_mps3",
                "profile"
            ]
        );
        assert_eq!(excluded("strange"), [""; 0]);
    }
}
