//! `--set section.key=value`: values of the command line, put into the tree
//! of the file before anything is checked.

use super::errors::{Findings, Place, Problem, RunFileErrors, one_line};
use super::keys::Section;
use super::table;
use super::tree::{Node, Table, Toml, parse_document, parse_value};

/// Longest override that a message repeats \[characters\].
const ECHO: usize = 80;

/// The tree of a text with its overrides, and what is wrong with these.
///
/// They are applied in their order: the last one of a key wins. One that gives
/// a quantity in another way than the file, such as `lines` where that has
/// `counts_per_rad`, takes the place of all that the file says in its way; the rest
/// of the new way must come by overrides too. Overrides of two ways stay, and are
/// refused further on.
///
/// # Errors
/// The text is no TOML.
pub(super) fn document(
    source_name: &str,
    text: &str,
    sets: &[String],
) -> Result<(Table, Findings), RunFileErrors> {
    let parsed = parse_document(text);
    let mut tree =
        parsed.map_err(|(place, problem)| RunFileErrors::one(source_name, place, problem))?;
    let mut findings = Findings::new(source_name);
    for set in sets {
        let place = Place::Set(one_line(set, ECHO));
        if let Err(why) = apply_one(&mut tree, set, &place) {
            findings.push(place, Problem::Override(why));
        }
    }
    Ok((tree, findings))
}

fn apply_one(tree: &mut Table, set: &str, place: &Place) -> Result<(), String> {
    let parts = set.split_once('=');
    let (path, text) = parts.ok_or("there is no =; write --set section.key=value")?;
    let path: Vec<&str> = path.split('.').map(str::trim).collect();
    if path.iter().any(|part| part.is_empty()) {
        return Err("the key is incomplete; write --set section.key=value".to_owned());
    }
    let text = text.trim();
    if text.is_empty() {
        return Err("there is no value after the =".to_owned());
    }
    let node = read_value(text, place)?;
    let list = path.first().and_then(|name| table::find_list(name));
    match (path.as_slice(), list) {
        ([name], _) => set_top(tree, name, node),
        ([list, row], Some(_)) if row.parse::<usize>().is_ok() => Err(format!(
            "{list}.{row} is a row; write {list}.{row}.key=value for a key of it"
        )),
        ([list, key], Some(_)) => Err(format!(
            "{list} has rows; write {list}.1.{key} for that of the first"
        )),
        ([section, key], None) => {
            set_in_section(tree, section, key, node);
            Ok(())
        }
        ([_, row, key], Some(list)) => set_in_row(tree, &list.row, row, (key, node)),
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
        (Some(section), Toml::Flag(_) | Toml::Number(..) | Toml::Text(_) | Toml::Date) => {
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
        set_key(table, table::find(section), key, node);
    }
}

/// Sets a key of a row that the file has; rows are counted from 1.
fn set_in_row(
    tree: &mut Table,
    known: &Section,
    row: &str,
    (key, node): (&str, Node),
) -> Result<(), String> {
    let list = known.name;
    let rows = match tree.get_mut(list).map(|node| &mut node.value) {
        Some(Toml::Array(rows)) => rows.as_mut_slice(),
        _ => &mut [],
    };
    let count = rows.len();
    let number = row.parse::<usize>().ok();
    let found = number.and_then(|number| rows.get_mut(number.checked_sub(1)?));
    match found.map(|node| &mut node.value) {
        Some(Toml::Table(table)) => {
            set_key(table, Some(known), key, node);
            Ok(())
        }
        _ => Err(format!(
            "there is no row {row}: the file has {count} [[{list}]]"
        )),
    }
}

/// Sets a key, and removes from the file what gives the same in another way.
fn set_key(table: &mut Table, known: Option<&Section>, key: &str, node: Node) {
    table.set(key, node);
    let is_other = |name: &str| known.is_some_and(|known| known.excludes(key, name));
    let entries = &mut table.entries;
    entries.retain(|(name, node)| !is_other(name) || !matches!(node.place, Place::Line(_)));
}
