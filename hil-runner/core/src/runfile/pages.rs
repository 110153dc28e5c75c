//! Pages that are made from the table of keys: the JSON schema of the run file,
//! the key reference in Markdown, and the lines of a commented run file.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::key_path::header;
use super::keys::{Acts, Key, Kind, LONGEST_TIME_S, Need, Range, Section, Way, either};
use super::table::{self, LISTS, SECTIONS, list_instead_of};
use super::values;
use crate::number::seconds;

/// The JSON schema of the run file (draft 2020-12), for editors.
///
/// It says everything about single keys and about which keys must stand
/// together. Checks between values (the delay against the sample time, an
/// acceleration without deceleration, whole nanoseconds) are beyond it.
///
/// ```
/// let schema = hil_core::runfile::schema();
/// let inertia = &schema["properties"]["motor"]["properties"]["inertia_kg_m2"];
/// assert_eq!(inertia["exclusiveMinimum"], 0);
/// ```
pub fn schema() -> Value {
    let mut properties = Map::new();
    let (mut required, mut rules) = (Vec::new(), Vec::new());
    for section in SECTIONS {
        if section.name.is_empty() {
            properties.extend(keys(section));
        } else {
            properties.insert(section.name.to_owned(), section_schema(section));
        }
        match list_instead_of(section) {
            _ if !section.is_required() => {}
            None => required.push(section.name),
            Some(list) => rules.push(json!({"oneOf": [
                {"required": [section.name]},
                {"required": [list.row.name]},
            ]})),
        }
    }
    for list in LISTS {
        let rows = json!({"type": "array", "minItems": 1, "items": section_schema(&list.row)});
        properties.insert(list.row.name.to_owned(), rows);
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Run file of the servo bench",
        "description": "One run: controller firmware and simulated servo axis in lockstep.",
        "type": "object",
        "properties": properties,
        "required": required,
        "allOf": rules,
        "additionalProperties": false,
    })
}

fn keys(section: &Section) -> Map<String, Value> {
    let schema = |key: &Key| (key.name.to_owned(), key_schema(key));
    section.keys.iter().map(schema).collect()
}

fn section_schema(section: &Section) -> Value {
    let is_needed = |need: Need| section.keys.iter().any(|key| key.need == need);
    let always = needed(section, Need::Always);
    let mut rules: Vec<Value> = always["allOf"].as_array().cloned().unwrap_or_default();
    for key in section.keys {
        if let Need::OnlyWith(partner) = key.need {
            rules.push(json!({"dependentRequired": {key.name: [partner]}}));
        }
    }
    if is_needed(Need::ElasticJoint) {
        let rigid = json!({"properties": {"joint": {"const": "rigid"}}, "required": ["joint"]});
        rules.push(json!({"if": rigid, "else": needed(section, Need::ElasticJoint)}));
    }
    if is_needed(Need::SampledLaw) {
        let continuous = json!({"properties": {"law": {"const": "continuous"}}});
        rules.push(json!({"if": continuous, "else": needed(section, Need::SampledLaw)}));
    }
    if is_needed(Need::CurrentDrive) {
        let current = json!({"properties": {"kind": {"const": "current"}}, "required": ["kind"]});
        let mut then = needed(section, Need::CurrentDrive);
        then["properties"] = json!({"amplifier_gain": false});
        let of_current = ["amplifier_gain_a_per_v", "current_bandwidth_hz"];
        let of_current = of_current.map(|key| (key.to_owned(), Value::Bool(false)));
        let other = json!({"properties": Map::from_iter(of_current)});
        rules.push(json!({"if": current, "then": then, "else": other}));
        let ideal = json!({"allOf": [current, {"properties": {"current_bandwidth_hz": false}}]});
        rules.push(json!({"if": ideal, "else": needed(section, Need::VoltageAtLimit)}));
    }
    let mut schema = json!({
        "description": section.meaning,
        "type": "object",
        "properties": keys(section),
        "required": always["required"],
        "additionalProperties": false,
    });
    if !rules.is_empty() {
        schema["allOf"] = Value::Array(rules);
    }
    schema
}

/// The keys with this need that must be there, and of what can be given in several
/// ways the keys of one.
fn needed(section: &Section, need: Need) -> Value {
    let names = section.keys.iter().map(|key| key.name);
    let counts = |name: &&str| section.key(name).is_some_and(|key| key.need == need);
    let alone = names.filter(|name| section.ways_with(name).is_empty());
    let required: Vec<&str> = alone.filter(counts).collect();
    let mut rule = json!({"required": required});
    let concerned = |ways: &&&[Way]| {
        let mut names = ways.iter().copied().flatten();
        need == Need::Always || names.any(counts)
    };
    let of_ways = section.ways.iter().filter(concerned).map(|ways| {
        let of_way = |way: &Way| {
            let required: Vec<&str> = way.iter().copied().filter(|name| counts(name)).collect();
            let all = ways.iter().copied().flatten();
            let others = all.filter(|name| !way.contains(name));
            let others = others.map(|name| ((*name).to_owned(), Value::Bool(false)));
            json!({"required": required, "properties": others.collect::<Map<_, _>>()})
        };
        json!({"anyOf": ways.iter().map(of_way).collect::<Vec<_>>()})
    });
    let of_ways: Vec<Value> = of_ways.collect();
    if !of_ways.is_empty() {
        rule["allOf"] = Value::Array(of_ways);
    }
    rule
}

fn key_schema(key: &Key) -> Value {
    let mut schema = match key.kind {
        Kind::Text => json!({"type": "string", "minLength": 1}),
        Kind::Flag => json!({"type": "boolean"}),
        Kind::Choice(choices) => json!({"enum": choices}),
        Kind::Number(range) | Kind::Time(range) => number_schema(range),
        Kind::Whole(low, high) => json!({"type": "integer", "minimum": low, "maximum": high}),
        Kind::Strings => json!({"type": "array", "items": {"type": "string"}}),
        Kind::Table => json!({"type": "object"}),
        Kind::Intervals => json!({
            "type": "array",
            "items": number_schema(Range::NotNegative),
            "minItems": 7,
            "maxItems": 7,
        }),
    };
    if matches!(key.kind, Kind::Time(_)) {
        schema["maximum"] = json!(LONGEST_TIME_S);
    }
    if let Some(word) = key.word {
        schema = json!({"anyOf": [schema, {"const": word}]});
    }
    let acts = match key.acts {
        Acts::Everywhere => String::new(),
        acts => format!("; acts on {}", acts.words()),
    };
    schema["description"] = Value::String(key.description() + &acts);
    if let Some(default) = key.default() {
        schema["default"] = match default {
            values::Value::Flag(flag) => json!(flag),
            values::Value::Choice(choice) => json!(choice),
            values::Value::Whole(whole) => json!(whole),
            other => json!(other.number()),
        };
    }
    schema
}

fn number_schema(range: Range) -> Value {
    match range {
        Range::Any => json!({"type": "number"}),
        Range::Positive => json!({"type": "number", "exclusiveMinimum": 0}),
        Range::NotNegative => json!({"type": "number", "minimum": 0}),
        Range::Between(low, high) => json!({"type": "number", "minimum": low, "maximum": high}),
    }
}

/// All keys of the run file in Markdown: one table a section.
///
/// ```
/// let page = hil_core::runfile::key_reference();
/// assert!(page.contains("| `mass_kg` | kg | greater than 0 | required | every rung |"));
/// ```
pub fn key_reference() -> String {
    let mut page = String::from(
        "# Keys of the run file\n\n\
         TOML, one file a run. Integers serve for numbers; `nan` and `inf` are refused. Numbers\n\
         other than 0 lie between 1e-50 and 1e50 in magnitude. Times of the run (marked \"ns\") are\n\
         whole nanoseconds and at most 1e9 s. `hil-runner schema` prints the same as a JSON schema.\n",
    );
    for section in table::all() {
        let title = match section.name {
            "" => "Top of the file".to_owned(),
            name => format!("`{}`", header(name)),
        };
        page.push_str(&format!("\n## {title}\n\n{}\n\n", section.meaning));
        page.push_str("| key | unit | allowed | if left out | acts on | meaning |\n");
        page.push_str("| --- | --- | --- | --- | --- | --- |\n");
        for key in section.keys {
            page.push_str(&row(section, key));
        }
        let several = |ways: &&&[Way]| ways.iter().any(|way| way.len() > 1);
        for ways in section.ways.iter().filter(several) {
            page.push_str(&format!("\nOne way of {}.\n", section.ways_words(ways)));
        }
    }
    page
}

fn row(section: &Section, key: &Key) -> String {
    let unit = match key.kind {
        Kind::Time(_) => "s (ns)",
        _ => key.unit,
    };
    // Of each other way the first key that does not stand in one with this key.
    let other_of = |way: &Way| {
        let mut names = way.iter().filter(|name| section.excludes(key.name, name));
        names.next().map(|name| format!("`{name}`"))
    };
    let others = section.ways_with(key.name).iter().filter_map(other_of);
    let others = either(others.collect::<BTreeSet<_>>());
    let excuse = match key.need {
        Need::ElasticJoint => Some("the joint is rigid".to_owned()),
        Need::SampledLaw => Some("the law is \"continuous\"".to_owned()),
        Need::VoltageAtLimit => Some("the current loop is ideal".to_owned()),
        _ => None,
    };
    let given = (!others.is_empty()).then(|| format!("{others} is given"));
    let excuses = either(excuse.into_iter().chain(given));
    let mut absent = match key.need {
        need if need.is_required() && excuses.is_empty() => "required".to_owned(),
        Need::Always | Need::ElasticJoint | Need::SampledLaw | Need::VoltageAtLimit => {
            format!("required unless {excuses}")
        }
        Need::CurrentDrive => "required of a current drive".to_owned(),
        Need::Optional => "–".to_owned(),
        Need::OnlyWith(partner) => format!("–; only with `{partner}`"),
        Need::Limit => "no limit".to_owned(),
        Need::FileStem => "stem of the file's name".to_owned(),
        Need::Default(default) => format!("`{}`", default.to_toml()),
    };
    if !others.is_empty() {
        absent += &match key.need.is_required() {
            true => "; never both".to_owned(),
            false => format!("; never with {others}"),
        };
    }
    let (name, allowed) = (key.name, key.range_words());
    let acts = key.acts.words();
    let meaning = key.meaning.trim_end_matches(',');
    format!("| `{name}` | {unit} | {allowed} | {absent} | {acts} | {meaning} |\n")
}

/// Column in which the remarks of a commented file begin.
const REMARKS: usize = 40;

/// A run file in whose sections every key stands: what it does not give is
/// commented out, with its default or an example, and a remark. Such lines that
/// it has are written anew, missing ones follow the key above them in the table.
///
/// ```
/// use hil_core::runfile::{builtin_text, commented};
///
/// let text = builtin_text("paper-2").unwrap_or_default();
/// let (before, after) = text.split_once("# no_pull").unwrap_or_default();
/// let (_, after) = after.split_once('\n').unwrap_or_default();
/// assert_eq!(commented("paper-2", &format!("{before}{after}")), text);
/// ```
pub fn commented(name: &str, text: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for section in SECTIONS.iter().filter(|section| section.name != "budget") {
        let header = format!("[{}]", section.name);
        let header = lines.iter().position(|line| line.starts_with(&header));
        let start = match header {
            Some(line) => line + 1,
            None if section.name.is_empty() => 0,
            None => continue,
        };
        let mut at = start;
        for key in section.keys {
            let shows = |line: &&String| {
                let line = line.trim_start_matches("# ").strip_prefix(key.name);
                line.is_some_and(|rest| rest.starts_with(" = "))
            };
            let body = lines.iter().skip(start);
            let mut body = body.take_while(|line| !line.starts_with('['));
            let found = body.position(|line| shows(&line)).map(|line| start + line);
            let is_given = |line: usize| lines.get(line).is_some_and(|l| !l.starts_with('#'));
            if let Some(line) = found.filter(|line| is_given(*line)) {
                at = line + 1;
            } else if let Some(comment) = comment(key, name) {
                let from = found.unwrap_or(at);
                let more = |line: &&String| line.starts_with("#          ");
                let old = found.map_or(0, |line| {
                    1 + lines.iter().skip(line + 1).take_while(more).count()
                });
                at = from + comment.len();
                lines.splice(from..from + old, comment);
            }
        }
    }
    lines.join("\n") + "\n"
}

/// A key that is not given, in the lines that it takes; nothing for one that
/// must be given.
fn comment(key: &Key, name: &str) -> Option<Vec<String>> {
    let value = match (key.need, key.default()) {
        (Need::FileStem, _) => format!("\"{name}\""),
        (_, Some(values::Value::Number(number))) => format!("{number:?}"),
        (_, Some(values::Value::Nanoseconds(0))) => "0.0".to_owned(),
        (_, Some(values::Value::Nanoseconds(ns))) => seconds(ns).to_string(),
        (_, Some(default)) => default.to_toml(),
        (_, None) if key.example.is_empty() => return None,
        (_, None) => key.example.to_owned(),
    };
    let first = format!("# {} = {value}", key.name);
    let mut remarks: Vec<String> = key.note.iter().map(|&note| note.to_owned()).collect();
    if let (Kind::Choice([_, others @ ..]), []) = (key.kind, key.note) {
        let quoted: Vec<String> = others.iter().map(|c| format!("\"{c}\"")).collect();
        remarks.push(format!("or {}", quoted.join(", ")));
    }
    let beside = |text: &str, remark: &str| {
        let spaces = REMARKS.saturating_sub(text.chars().count()).max(3);
        format!("{text}{:spaces$}# {remark}", "")
    };
    let Some((remark, more)) = remarks.split_first() else {
        return Some(vec![first]);
    };
    let mut lines = vec![beside(&first, remark)];
    lines.extend(more.iter().map(|remark| beside("#", remark)));
    Some(lines)
}
