//! The JSON schema of study files, for editors: from the structures that read them,
//! and from the table of the run file's keys.

use hil_core::case::Law;
use hil_core::runfile::{self, LISTS};
use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use super::file::StudyFile;

/// The JSON schema of a study file (draft 2020-12).
///
/// It says everything about single keys. Checks between keys, and of names of columns,
/// are beyond it.
///
/// ```
/// let schema = hil_runner::study::schema();
/// assert_eq!(schema["properties"]["plan"]["oneOf"][0]["const"], "grid");
/// ```
pub fn schema() -> Value {
    let settings = SchemaSettings::draft2020_12();
    let settings = settings.with(|settings| settings.inline_subschemas = true);
    let generator = settings.into_generator();
    let mut schema = generator.into_root_schema_for::<StudyFile>().to_value();
    tidy(&mut schema);
    schema["title"] = json!("Study file of the servo bench");
    let sections = runfile::schema()["properties"].clone();
    let properties = &mut schema["properties"];
    properties["rungs"]["items"] = json!({"enum": Law::ALL.map(Law::name)});
    properties["rungs"]["uniqueItems"] = json!(true);
    properties["budget"] = sections["budget"].clone();
    let paths = paths(&sections);
    let axis = &mut properties["axis"]["items"]["properties"];
    for key in ["key", "times"] {
        axis[key]["enum"] = json!(paths);
    }
    properties["set"] = set(sections);
    schema
}

/// The keys that an axis may be over.
fn paths(sections: &Value) -> Vec<String> {
    let sections = sections.as_object().into_iter().flatten();
    let sections = sections.filter(|(name, _)| !matches!(name.as_str(), "budget" | "target"));
    let keys = sections.flat_map(|(name, section)| {
        let keys = section["properties"].as_object().into_iter().flatten();
        keys.map(move |(key, _)| format!("{name}.{key}"))
    });
    keys.filter(|path| path != "controller.law").collect()
}

/// The sections of a run file of which none and no key must be there; without its lists,
/// whose rows `[set]` does not reach.
fn set(mut sections: Value) -> Value {
    if let Some(sections) = sections.as_object_mut() {
        sections.retain(|name, _| LISTS.iter().all(|list| list.row.name != name));
        for section in sections.values_mut().filter_map(Value::as_object_mut) {
            section.retain(|key, _| !matches!(key.as_str(), "required" | "allOf"));
        }
    }
    json!({
        "description": "Keys that differ from the base in every run",
        "type": "object",
        "properties": sections,
        "additionalProperties": false,
    })
}

/// What the structures have for Rust alone, taken out of a schema and of all that it
/// contains: values that are null, which TOML has not, formats of numbers, brackets
/// of documentation. The keys of an axis of a picture, `x_*`, take their names.
fn tidy(value: &mut Value) {
    match value {
        Value::Array(values) => values.iter_mut().for_each(tidy),
        Value::Object(object) => {
            object.values_mut().for_each(tidy);
            object.retain(|key, value| key != "format" && !(key == "default" && value.is_null()));
            if let Some(kinds) = object.get_mut("type").and_then(Value::as_array_mut) {
                kinds.retain(|kind| kind != "null");
                if let [kind] = kinds.as_slice() {
                    object["type"] = kind.clone();
                }
            }
            if let Some(ways) = object.get_mut("anyOf").and_then(Value::as_array_mut) {
                ways.retain(|way| way["type"] != "null");
                if let [Value::Object(way)] = ways.as_mut_slice() {
                    let way = std::mem::take(way);
                    object.remove("anyOf");
                    way.into_iter().for_each(|(key, value)| {
                        object.entry(key).or_insert(value);
                    });
                }
            }
            if let Some(Value::String(words)) = object.get_mut("description") {
                *words = words.replace("\\[", "[").replace("\\]", "]");
            }
            if let Some(Value::Object(properties)) = object.get_mut("properties") {
                let keys = std::mem::take(properties).into_iter();
                *properties = keys.flat_map(named).collect();
            }
        }
        _ => {}
    }
}

/// A key, or those of the axis that it stands for.
fn named((key, schema): (String, Value)) -> Vec<(String, Value)> {
    let Some(axis) = key.strip_suffix('*') else {
        return vec![(key, schema)];
    };
    let keys = schema["properties"].as_object().into_iter().flatten();
    let named = |(key, schema): (&String, &Value)| (format!("{axis}{key}"), schema.clone());
    keys.map(named).collect()
}
