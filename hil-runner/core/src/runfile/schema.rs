//! The JSON schema of the run file, for editors; made from the key table.
//!
//! It says everything about single keys and about which keys must stand
//! together. Checks between values (the delay against the sample time, an
//! acceleration without deceleration, whole nanoseconds) are beyond it.

use serde_json::{Map, Value, json};

use super::key_table::SECTIONS;
use super::keys::{Acts, DefaultValue, Key, Kind, LONGEST_TIME_S, Need, Range, Section};

/// The schema (draft 2020-12).
///
/// ```
/// let schema = hil_core::runfile::schema();
/// let inertia = &schema["properties"]["motor"]["properties"]["inertia_kg_m2"];
/// assert_eq!(inertia["exclusiveMinimum"], 0);
/// ```
pub fn schema() -> Value {
    let mut properties = Map::new();
    let mut required = Vec::new();
    for section in SECTIONS {
        if section.name.is_empty() {
            properties.extend(keys(section));
        } else {
            properties.insert(section.name.to_owned(), section_schema(section));
        }
        if section.is_required() {
            required.push(section.name);
        }
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Run file of the servo bench",
        "description": "One run: controller firmware and simulated servo axis in lockstep.",
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

fn keys(section: &Section) -> Map<String, Value> {
    let schema = |key: &Key| (key.name.to_owned(), key_schema(key));
    section.keys.iter().map(schema).collect()
}

fn section_schema(section: &Section) -> Value {
    let named = |need: Need| -> Vec<&str> {
        let keys = section.keys.iter().filter(|key| key.need == need);
        keys.map(|key| key.name).collect()
    };
    let mut rules = Vec::new();
    for key in section.keys {
        if let Need::OneOf(partner) = key.need
            && key.name < partner
        {
            let either = [
                json!({"required": [key.name]}),
                json!({"required": [partner]}),
            ];
            rules.push(json!({ "oneOf": either }));
        }
        if let Need::NotWith(partner) = key.need
            && key.name < partner
        {
            rules.push(json!({"not": {"required": [key.name, partner]}}));
        }
        if let Need::OnlyWith(partner) = key.need {
            rules.push(json!({"dependentRequired": {key.name: [partner]}}));
        }
    }
    let elastic = named(Need::ElasticJoint);
    if !elastic.is_empty() {
        let rigid = json!({"properties": {"joint": {"const": "rigid"}}, "required": ["joint"]});
        rules.push(json!({"if": rigid, "else": {"required": elastic}}));
    }
    let sampled = named(Need::SampledLaw);
    if !sampled.is_empty() {
        let continuous = json!({"properties": {"law": {"const": "continuous"}}});
        rules.push(json!({"if": continuous, "else": {"required": sampled}}));
    }
    let mut schema = json!({
        "description": section.meaning,
        "type": "object",
        "properties": keys(section),
        "required": named(Need::Always),
        "additionalProperties": false,
    });
    if !rules.is_empty() {
        schema["allOf"] = Value::Array(rules);
    }
    schema
}

fn key_schema(key: &Key) -> Value {
    let mut schema = match key.kind {
        Kind::Text => json!({"type": "string", "minLength": 1}),
        Kind::Flag => json!({"type": "boolean"}),
        Kind::Choice(choices) => json!({"enum": choices}),
        Kind::Number(range) => number_schema(range),
        Kind::Whole(low, high) => json!({"type": "integer", "minimum": low, "maximum": high}),
        Kind::Time(range) => time_schema(range),
        Kind::TimeOrWord(range, word) => json!({"anyOf": [time_schema(range), {"const": word}]}),
        Kind::Intervals => json!({
            "type": "array",
            "items": number_schema(Range::NotNegative),
            "minItems": 7,
            "maxItems": 7,
        }),
    };
    let acts = match key.acts {
        Acts::Everywhere => String::new(),
        acts => format!("; acts on {}", acts.words()),
    };
    schema["description"] = Value::String(key.description() + &acts);
    if let Need::Default(default) = key.need {
        schema["default"] = match default {
            DefaultValue::Flag(flag) => json!(flag),
            DefaultValue::Choice(choice) => json!(choice),
            DefaultValue::Number(number) => json!(number),
            DefaultValue::Whole(whole) => json!(whole),
            DefaultValue::Nanoseconds(ns) => json!(ns as f64 / 1e9),
        };
    }
    schema
}

fn time_schema(range: Range) -> Value {
    let mut schema = number_schema(range);
    schema["maximum"] = json!(LONGEST_TIME_S);
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
