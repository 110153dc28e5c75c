//! The settings of the controller, which stand once more on the way to a chip:
//! the table of keys and the fields of [`Axis`](firmware::axis::Axis), both ways.

use std::collections::BTreeMap;

use hil_core::controllers::{Setup, compensated};

use super::document::{all_keys, beside, samples};
use super::{BASE, parse};

/// Paths and values of all fields of the axis that a run on rung `firmware` with
/// these sets has, as `Debug` shows them.
fn fields(sets: &[&str]) -> BTreeMap<String, String> {
    let sets = [&["controller.law=firmware"], sets].concat();
    let case = parse(BASE, &sets).unwrap_or_else(|errors| panic!("{errors}"));
    let setup = Setup::of(&case, case.controller.sample_time_ns.unwrap()).unwrap();
    let axis = compensated(&setup, setup.law().unwrap().law).unwrap();
    let shown = format!("{axis:#?}");
    let mut fields = BTreeMap::new();
    let mut path: Vec<&str> = Vec::new();
    for line in shown.lines().skip(1).map(str::trim) {
        let (name, value) = line.split_once(": ").unwrap_or(("", line));
        if value.ends_with(['{', '(']) {
            path.push(name);
        } else if value.starts_with(['}', ')']) {
            path.pop();
        } else {
            let names = path.iter().chain([&name]).copied();
            let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
            let value = value.trim_end_matches(',').to_owned();
            fields.insert(names.join("."), value);
        }
    }
    fields
}

fn is_within(path: &str, field: &str) -> bool {
    path.strip_prefix(field)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

#[test]
fn a_key_that_names_a_field_decides_on_it() {
    for (section, key) in all_keys() {
        let Some(field) = key.field else { continue };
        let path = format!("{}.{}", section.name, key.name);
        // A code per sample is the least for a slew limit.
        let (first, second) = match key.name {
            "slew_limit_codes_per_s" => ("1e5".to_owned(), "2e5".to_owned()),
            _ => samples(key),
        };
        let [first, second] = [first, second].map(|value| {
            let all = fields(&[&beside(&path)[..], &[&format!("{path}={value}")]].concat());
            let within = all.into_iter().filter(|(path, _)| is_within(path, field));
            within.collect::<Vec<_>>()
        });
        assert!(!second.is_empty(), "{path}: there is no field {field}");
        assert_ne!(first, second, "{path} does not decide on {field}");
    }
}

/// Keys with which every field is there.
const EVERYTHING: &str = include_str!("everything.txt");

/// Fields that follow from several keys or from others.
const DERIVED: &str = include_str!("derived.txt");

#[test]
fn a_field_that_no_key_names_is_derived() {
    let everything: Vec<&str> = EVERYTHING.lines().collect();
    let fields = fields(&everything);
    let named = |path: &str| {
        let mut named = all_keys().filter_map(|(_, key)| key.field);
        named.any(|field| is_within(path, field))
    };
    for path in fields.keys() {
        let derived = DERIVED.lines().any(|field| is_within(path, field));
        assert_ne!(named(path), derived, "{path}");
    }
    for field in DERIVED.lines() {
        assert!(fields.keys().any(|path| is_within(path, field)), "{field}");
    }
}
