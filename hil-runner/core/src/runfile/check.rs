//! Holds a tree against the key table: unknown and missing keys. Types and
//! ranges are in `check_value`, what concerns several keys in `consistency`.

use std::path::Path;

use super::check_value::check_value;
use super::errors::{Findings, Place, Problem, one_line};
use super::key_table::SECTIONS;
use super::keys::path;
use super::keys::{Key, Need, Section};
use super::suggest;
use super::tree::{Node, Table, Value};
use super::values::{Checked, Entry, Values};

/// Checks every key of the table and every key of the tree.
pub(super) fn check(tree: &Table, findings: &mut Findings) -> Values {
    let mut values = Values::default();
    let meant = report_unknown(tree, findings);
    for section in SECTIONS {
        let node = tree.get(section.name);
        let Some(table) = tree.section(section.name) else {
            if let Some(node) = node {
                let because = format!("{0} is a section; write [{0}]", section.name);
                not_allowed(findings, node, section.name, because);
            } else if section.is_required() && !meant.contains(&("", section.name)) {
                findings.push_missing(None, lacks_section(section));
            }
            if node.is_none() {
                fill_in(section, findings.source_name(), &mut values);
            }
            continue;
        };
        for key in section.keys {
            let entry = match table.get(key.name) {
                Some(node) => match check_value(key, node) {
                    Ok(checked) => Entry::given(node, checked),
                    Err(because) => {
                        let path = path(section.name, key.name);
                        not_allowed(findings, node, &path, because);
                        Entry::refused(node)
                    }
                },
                None => {
                    let excused = meant.contains(&(section.name, key.name));
                    if !excused && let Some(words) = missing_words(key, section, table, tree) {
                        let place = node.map(|node| &node.place);
                        findings.push_missing(place, lacks(section, place, &words));
                    }
                    match default(key, findings.source_name()) {
                        Some(entry) => entry,
                        None => continue,
                    }
                }
            };
            values.insert(section.name, key, entry);
        }
    }
    values
}

/// Defaults of a section that is not there.
fn fill_in(section: &'static Section, source_name: &str, values: &mut Values) {
    for key in section.keys {
        if let Some(entry) = default(key, source_name) {
            values.insert(section.name, key, entry);
        }
    }
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
    for (name, node) in &tree.entries {
        let shown = show_key(name);
        if let Some(section) = SECTIONS
            .iter()
            .find(|s| !s.name.is_empty() && s.name == name)
        {
            let Value::Table(table) = &node.value else {
                continue;
            };
            for (name, node) in &table.entries {
                if section.key(name).is_none() {
                    let hint = suggest::key(section.name, name);
                    let what = format!("key {}.{}", section.name, show_key(name));
                    let text = hint.text;
                    findings.push(node.place.clone(), Problem::Unknown { what, hint: text });
                    meant.extend(hint.meant.into_iter().map(|key| (section.name, key)));
                }
            }
        } else if SECTIONS
            .iter()
            .any(|s| s.name.is_empty() && s.key(name).is_some())
        {
            // A key at the top of the file.
        } else {
            let is_table = matches!(node.value, Value::Table(_) | Value::Array(_));
            let (what, hint) = if is_table {
                (format!("section [{shown}]"), suggest::section(name))
            } else {
                (format!("key {shown}"), suggest::key("", name))
            };
            let text = hint.text;
            findings.push(node.place.clone(), Problem::Unknown { what, hint: text });
            meant.extend(hint.meant.into_iter().map(|name| ("", name)));
        }
    }
    meant
}

/// Which key is missing if this one is not there, with its description.
fn missing_words(key: &Key, section: &Section, table: &Table, tree: &Table) -> Option<String> {
    let told = |section: &str, key: &str| match tree.section(section)?.get(key)?.value {
        Value::Text(ref text) => Some(text.as_str()),
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
            let first = section
                .keys
                .iter()
                .find(|k| k.name == key.name || k.name == partner);
            if table.get(partner).is_some() || first.is_none_or(|first| first.name != key.name) {
                return None;
            }
            let description = section
                .key(partner)
                .map(Key::description)
                .unwrap_or_default();
            let (name, own) = (key.name, key.description());
            return Some(format!("{name} or {partner}: {own}; or {description}"));
        }
        Need::NotWith(_)
        | Need::Optional
        | Need::OnlyWith(_)
        | Need::Limit
        | Need::FileStem
        | Need::Default(_) => false,
    };
    missing.then(|| format!("{}: {}", key.name, key.description()))
}

fn lacks(section: &Section, place: Option<&Place>, words: &str) -> String {
    match place {
        Some(Place::Line(line)) => format!("[{}] (line {line}) lacks {words}", section.name),
        _ => format!("[{}] lacks {words}", section.name),
    }
}

fn lacks_section(section: &Section) -> String {
    let mut keys = Vec::new();
    for key in section.keys {
        match key.need {
            // The pair is named with its first key.
            Need::OneOf(partner) if keys.iter().any(|k: &String| k.starts_with(partner)) => {}
            Need::OneOf(partner) => keys.push(format!("{} or {partner}", key.name)),
            Need::Always | Need::ElasticJoint | Need::SampledLaw => keys.push(key.name.to_owned()),
            Need::NotWith(_)
            | Need::Optional
            | Need::OnlyWith(_)
            | Need::Limit
            | Need::FileStem
            | Need::Default(_) => {}
        }
    }
    let name = section.name;
    format!("lacks the section [{name}] with {}", keys.join(", "))
}

fn default(key: &Key, source_name: &str) -> Option<Entry> {
    match key.need {
        Need::FileStem => {
            let stem = Path::new(source_name).file_stem();
            let name = stem.map_or("run".into(), |stem| stem.to_string_lossy());
            Some(Entry::default_value(
                Checked::Text(name.into_owned()),
                String::new(),
            ))
        }
        Need::Default(value) => Some(Entry::default_value(value.into(), value.to_toml())),
        _ => None,
    }
}
