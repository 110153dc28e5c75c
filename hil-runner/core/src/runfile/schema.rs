//! The JSON schema of the run file, made from the table of keys.

use serde_json::{Map, Value, json};

use super::keys::{Acts, Key, Kind, LONGEST_TIME_S, Need, Range, Section, Way};
use super::table::{LISTS, SECTIONS, list_instead_of};
use super::values;

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
