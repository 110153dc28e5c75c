//! `--set section.key=value`: values of the command line, put into the tree
//! of the file before anything is checked.

use super::errors::{Findings, Place, Problem, one_line};
use super::key_path::KeyPath;
use super::table;
use super::tree::{Node, Table, Toml, parse_value};

/// Longest override that a message repeats \[characters\].
const ECHO: usize = 80;

/// Applies the overrides in their order: the last one of a key wins. One of a
/// pair, such as `lines` where the file has `counts_per_rad`, takes the place of
/// the file's; both of a pair stay, and are refused further on.
pub(super) fn apply(tree: &mut Table, sets: &[String], findings: &mut Findings) {
    for set in sets {
        let place = Place::Set(one_line(set, ECHO));
        if let Err(why) = apply_one(tree, set, &place) {
            findings.push(place, Problem::Override(why));
        }
    }
}

fn apply_one(tree: &mut Table, set: &str, place: &Place) -> Result<(), String> {
    let Some((path, text)) = set.split_once('=') else {
        return Err("there is no =; write --set section.key=value".to_owned());
    };
    let path: Vec<&str> = path.split('.').map(str::trim).collect();
    if path.iter().any(|part| part.is_empty()) {
        return Err("the key is incomplete; write --set section.key=value".to_owned());
    }
    let text = text.trim();
    if text.is_empty() {
        return Err("there is no value after the =".to_owned());
    }
    let node = read_value(text, place)?;
    match path.as_slice() {
        [name] => set_top(tree, name, node),
        [section, key] => {
            set_in_section(tree, section, key, node);
            remove_partner(tree, section, key);
            Ok(())
        }
        _ => Err("the key is too deep; write --set section.key=value".to_owned()),
    }
}

/// The value as TOML; a bare word is a string.
fn read_value(text: &str, place: &Place) -> Result<Node, String> {
    match parse_value(text, place) {
        Ok(node) => Ok(node),
        // What opens a quote or bracket means to be TOML; as a string it
        // would only lead to a second, misleading message.
        Err(why) if text.starts_with(['"', '\'', '[', '{']) => {
            Err(format!("the value is not TOML: {why}"))
        }
        Err(_) => Ok(Node {
            place: place.clone(),
            text: one_line(text, ECHO),
            value: Toml::Text(text.to_owned()),
        }),
    }
}

fn set_top(tree: &mut Table, name: &str, node: Node) -> Result<(), String> {
    let section = table::find(name);
    match (section, &node.value) {
        (Some(section), Toml::Flag(_) | Toml::Number(_) | Toml::Text(_) | Toml::Date) => {
            let example = section.keys.first().map_or("key", |key| key.name);
            Err(format!(
                "{name} is a section; set one of its keys, such as {name}.{example}"
            ))
        }
        _ => {
            tree.set(name, node);
            Ok(())
        }
    }
}

fn set_in_section(tree: &mut Table, section: &str, key: &str, node: Node) {
    if tree.get(section).is_none() {
        let table = Node {
            place: node.place.clone(),
            text: String::new(),
            value: Toml::Table(Table::default()),
        };
        tree.set(section, table);
    }
    // A file that has `section = 3` keeps it: that is reported on its own.
    if let Some(Toml::Table(table)) = tree.get_mut(section).map(|node| &mut node.value) {
        table.set(key, node);
    }
}

/// Removes from the file what says the same as a key in another way.
fn remove_partner(tree: &mut Table, section: &str, key: &str) {
    let known = KeyPath::find(&format!("{section}.{key}"));
    let Some(partner) = known.ok().and_then(|key| key.partner()) else {
        return;
    };
    if let Some(Toml::Table(table)) = tree.get_mut(section).map(|node| &mut node.value) {
        table.entries.retain(|(name, node)| {
            name != partner.key.name || !matches!(node.place, Place::Line(_))
        });
    }
}
