//! The JSON schema agrees with the parser.

use hil_core::runfile::{Kind, builtin_names, builtin_text, schema};
use serde_json::Value;

use super::document::{Document, all_keys};
use super::{BASE, messages};

fn to_json(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
}

#[test]
fn the_schema_is_one() {
    jsonschema::meta::validate(&schema()).unwrap();
}

#[test]
fn every_built_in_case_validates() {
    let validator = jsonschema::validator_for(&schema()).unwrap();
    for name in builtin_names() {
        let json = to_json(builtin_text(name).unwrap());
        assert!(validator.is_valid(&json), "{name}");
    }
    assert!(validator.is_valid(&to_json(BASE)));
}

/// Editor and program say the same if only one key is concerned.
#[test]
fn schema_and_parser_agree_on_single_keys() {
    let validator = jsonschema::validator_for(&schema()).unwrap();
    let mut refused = 0;
    let mut agree = |text: &str| {
        let valid = validator.is_valid(&to_json(text));
        let parsed = messages(text, &[]);
        assert_eq!(valid, parsed.is_empty(), "{text}\n{parsed:?}");
        refused += usize::from(!valid);
    };
    agree(&Document::full().text());
    for (section, key) in all_keys() {
        agree(&Document::full().without(section, key).text());
        for value in [
            "1", "0.5", "true", "\"\"", "\"x\"", "{}", "[]", "-0.5", "25.0",
        ] {
            // These are a matter of several keys.
            let across = key.name == "emergency_stop_s"
                || value == "-0.5" && key.name.starts_with("resistance_")
                || value == "1" && key.name == "computation_delay_s"
                || value == "0.5" && key.name == "computation_delay_s"
                || value == "25.0" && key.name == "computation_delay_s";
            let full = Document::full();
            if key.name == "duration_s" {
                // A window of rest must lie within it.
                let full = full.without(section, section.key("rest_window_s").unwrap());
                agree(&full.with(section, key, value).text());
            } else if !across {
                agree(&full.with(section, key, value).text());
            }
        }
        if matches!(key.kind, Kind::Intervals) {
            agree(
                &Document::full()
                    .with(section, key, "[1, 0, 1, 0, 1, 0, -1]")
                    .text(),
            );
            agree(
                &Document::full()
                    .with(section, key, "[1, 0, 1, 0, 1, 0]")
                    .text(),
            );
        }
    }
    for (from, to) in [
        ("[motor]", "colour = 1\n[motor]"),
        ("[motor]", "[motor]\ncolour = 1"),
        ("[run]", "[paint]\n[run]"),
        (
            "dac_lsb_v = 0.00488",
            "dac_lsb_v = 0.00488\ndac_range_v = 20",
        ),
        ("counts_per_rad = 636.0", "lines = 1000"),
        ("stiffness_nm_per_rad = 350\n", ""),
        ("stiffness_nm_per_rad = 350\n", "joint = \"rigid\"\n"),
        ("stiffness_nm_per_rad = 350\n", "joint = \"elastic\"\n"),
        ("law = \"sampled\"\n", ""),
        ("[run]", "[load_encoder]\n[limits]\n[inject]\n[run]"),
        ("[run]", "[load_encoder]\ncounts_per_mm = 100\n[run]"),
        (
            "[run]",
            "[load_encoder]\ncounts_per_mm = 100\ncounts_per_rad = 80\n[run]",
        ),
        ("[run]", "[gain_change]\nkp = 1\n[run]"),
        ("[run]", "[gain_change]\nat_s = 1\nkp = 1\n[run]"),
        ("[run]", "[inject]\nencoder_glitch_s = 1\n[run]"),
        ("[run]", "[inject]\nencoder_glitch_counts = 1\n[run]"),
        ("[run]", "[sequence]\nemergency_stop_release_s = 1\n[run]"),
        ("[run]", "[limits]\nfollowing_error_per_speed_s = 1\n[run]"),
    ] {
        agree(&super::base_with(from, to));
    }
    for law in ["continuous", "sampled", "quantised", "firmware"] {
        agree(&super::base_with("\"sampled\"", &format!("\"{law}\"")));
        let without = BASE.replace("sample_time_s = 0.001\n", "");
        agree(&without.replace("\"sampled\"", &format!("\"{law}\"")));
    }
    assert!(refused > 200, "{refused}");
}
