//! The JSON schema of study files agrees with what reads them.

use std::collections::BTreeSet;

use hil_runner::study::{Changes, Study, ready, schema};
use serde_json::Value;

use crate::bad_input::mistakes;
use crate::support::STUDY;

fn to_json(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
}

fn parsed(text: &str) -> Result<Study, String> {
    Study::parse("small.toml", text, &Changes::default()).map_err(|error| error.to_string())
}

#[test]
fn the_schema_is_one() {
    jsonschema::meta::validate(&schema()).unwrap();
    // Nothing of the structures in Rust is left in it.
    let text = schema().to_string();
    for left in ["\"null\"", "\"format\"", "$ref", "_*", "\\\\["] {
        assert!(!text.contains(left), "{left}");
    }
}

/// The ready studies, whatever the base, and those of tests, docs and benches.
#[test]
fn every_study_validates() {
    let validator = jsonschema::validator_for(&schema()).unwrap();
    let docs = [
        include_str!("../../../docs/STUDIES.md"),
        include_str!("../../../docs/PICTURES.md"),
    ];
    let of_docs = docs.map(|page| page.split("```toml\n").nth(1).unwrap());
    let of_docs = of_docs.map(|rest| rest.split("```").next().unwrap().to_owned());
    let others = [
        STUDY,
        include_str!("studies/every-rung.toml"),
        include_str!("studies/loop-gain.toml"),
        include_str!("studies/scatter.toml"),
        include_str!("../../../benches/million.toml"),
    ];
    let mut texts: Vec<String> = of_docs
        .into_iter()
        .chain(others.map(str::to_owned))
        .collect();
    for base in ["paper-1", "paper-2-12bit"] {
        let changes = Changes {
            base: Some(base.to_owned()),
            ..Changes::default()
        };
        texts.extend(ready::names().map(|name| Study::text(name, &changes).unwrap()));
    }
    assert_eq!(texts.len(), 2 + 5 + 2 * 7);
    for text in texts {
        let text = text.replace("LOOP_GAIN", "constant");
        let told = validator
            .validate(&to_json(&text))
            .map_err(|error| error.to_string());
        assert!(told.is_ok(), "{told:?}\n{text}");
    }
}

/// What the program refuses for the sake of one key, an editor refuses too; what is
/// left are matters of several keys, of numbers and texts as such, and of the base.
#[test]
fn mistakes_are_refused_by_both() {
    const BEYOND: &str = include_str!("mistakes/beyond-the-schema.txt");
    let validator = jsonschema::validator_for(&schema()).unwrap();
    let is_valid =
        |text: &str| text.parse::<toml::Table>().is_ok() && validator.is_valid(&to_json(text));
    let (mut left, mut refused) = (String::new(), 0);
    for (text, words) in mistakes() {
        match is_valid(&text) {
            true => left += &format!("{words}\n"),
            false => refused += 1,
        }
    }
    assert_eq!(left, BEYOND);
    assert!(refused > 25, "{refused}");
}

/// Schema and structures have the same keys.
#[test]
fn every_key_is_in_the_schema() {
    let schema = schema();
    let told = |text: &str| parsed(text).unwrap_err();
    let expected = |message: &str| -> BTreeSet<String> {
        let (_, names) = message.split_once("expected one of ").unwrap();
        names
            .split('`')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .collect()
    };
    let keys = |schema: &Value| -> BTreeSet<String> {
        schema["properties"]
            .as_object()
            .unwrap()
            .keys()
            .cloned()
            .collect()
    };
    assert_eq!(keys(&schema), expected(&told("nix = 1")));
    let axis = &schema["properties"]["axis"]["items"];
    let axis_told = told("base = \"paper-2\"\n[[axis]]\nnix = 1\n");
    assert_eq!(keys(axis), expected(&axis_told));
    let kinds = schema["properties"]["picture"]["items"]["oneOf"]
        .as_array()
        .unwrap();
    assert_eq!(kinds.len(), 5);
    for kind in kinds {
        let name = kind["properties"]["kind"]["const"].as_str().unwrap();
        let told = told(&format!(
            "base = \"paper-2\"\n[[picture]]\nkind = \"{name}\"\nfile = \"f\"\ntitle = \"T\"\nnix = 1\n"
        ));
        let mut found = keys(kind);
        for common in ["kind", "file", "title", "caption", "where"] {
            assert!(found.remove(common), "{name}: {common}");
        }
        assert_eq!(found, expected(&told), "{name}");
    }
}
