//! Rules for every key of the table, one after the other.

use hil_core::case::{Case, Law};
use hil_core::runfile::{Key, Kind, Need, Range, Section, Value};

use super::document::{Document, all_keys, samples};
use super::{messages, parse};

#[test]
fn every_key_is_read() {
    for (section, key) in all_keys() {
        let (first, second) = samples(key);
        let before = Document::full().with(section, key, &first).case();
        let after = Document::full().with(section, key, &second).case();
        assert_ne!(
            before, after,
            "{}.{} is a dead knob",
            section.name, key.name
        );
    }
}

/// The way back: a case has every key as the file says it.
#[test]
fn every_key_can_be_read_from_the_case() {
    for (section, key) in all_keys().filter(|(section, _)| section.name != "budget") {
        let (first, second) = samples(key);
        for sample in [first, second] {
            let case = Document::full().with(section, key, &sample).case();
            let told = match key.get(&case) {
                // The motion as a whole, and the name.
                None => matches!(key.kind, Kind::Text | Kind::Intervals),
                Some(Value::Choice(choice)) => format!("\"{choice}\"") == sample,
                Some(Value::Flag(flag)) => flag.to_string() == sample,
                Some(value) => {
                    let given: f64 = sample.parse().unwrap();
                    (value.number().unwrap() - given).abs() <= 1e-14 * given.abs()
                }
            };
            assert!(told, "{} = {sample}: {:?}", key.name, key.get(&case));
        }
    }
}

/// Both ends of a whole number's range fit the type that takes it.
#[test]
fn whole_numbers_are_held_up_to_their_bounds() {
    for (section, key) in all_keys() {
        let Kind::Whole(low, high) = key.kind else {
            continue;
        };
        let case = |value: i64| {
            let document = Document::full().with(section, key, &value.to_string());
            // What a jump may be depends on the counter's width.
            if key.name == "count_jump_counts" {
                let (encoder, width) = section_and_key("encoder", "counter_bits");
                document.with(encoder, width, "32").case()
            } else {
                document.case()
            }
        };
        assert_ne!(case(low), case(high), "{}", key.name);
        assert_ne!(case(high), case(high - 1), "{}", key.name);
    }
}

fn section_and_key(section: &str, key: &str) -> (&'static Section, &'static Key) {
    let is_it = |(s, k): &(&Section, &Key)| s.name == section && k.name == key;
    all_keys().find(is_it).unwrap()
}

#[test]
fn every_choice_is_another_case() {
    let mut choices_seen = 0;
    for (section, key) in all_keys() {
        let mut cases: Vec<Case> = Vec::new();
        let choices: &[&str] = match (&key.kind, &key.word) {
            (Kind::Choice(choices), _) => choices,
            (_, Some(word)) => {
                cases.push(Document::full().with(section, key, "0").case());
                std::slice::from_ref(word)
            }
            _ => continue,
        };
        // "exact" does not go with the quadratic resistance of the document.
        let choices = choices.iter().filter(|choice| **choice != "exact");
        cases.extend(choices.map(|choice| {
            let value = format!("\"{choice}\"");
            Document::full().with(section, key, &value).case()
        }));
        for (index, case) in cases.iter().enumerate() {
            assert!(!cases[..index].contains(case), "{}: {index}", key.name);
        }
        choices_seen += cases.len();
    }
    assert!(choices_seen > 25, "{choices_seen}");
}

#[test]
fn a_key_that_is_left_out_is_missing_or_has_its_default() {
    for (section, key) in all_keys() {
        let text = Document::full().without(section, key).text();
        let printed = messages(&text, &[]);
        match key.need {
            Need::Always | Need::ElasticJoint | Need::SampledLaw | Need::VoltageAtLimit => {
                let header = text
                    .lines()
                    .position(|l| l == format!("[{}]", section.name));
                let line = header.unwrap() + 1;
                let start = format!("cases/x.toml: [{}] (line {line}) lacks ", section.name);
                let named = printed.len() == 1
                    && printed[0].starts_with(&start)
                    && printed[0].contains(key.name);
                assert!(named, "{}: {printed:?}", key.name);
            }
            Need::Optional
            | Need::CurrentDrive
            | Need::OnlyWith(_)
            | Need::Limit
            | Need::FileStem => {
                assert_eq!(printed, [""; 0]);
            }
            Need::Default(default) => {
                let given = Document::full().with(section, key, &default.to_toml());
                // The template's values are a matter of what the file writes.
                let case = |text: &str| Case {
                    template_values: Vec::new(),
                    ..parse(text, &[]).unwrap()
                };
                assert_eq!(case(&text), case(&given.text()), "{}", key.name);
            }
        }
    }
}

#[test]
fn a_misspelt_key_is_refused_with_the_right_one() {
    for (section, key) in all_keys().filter(|(section, _)| !section.name.is_empty()) {
        let mut wrong = key.name.to_owned();
        wrong.extend(key.name.chars().last());
        let document = Document::full().with(section, key, &samples(key).0);
        let line = document.line(section, key);
        let mut text = String::new();
        for (index, original) in document.text().lines().enumerate() {
            let misspelt = original.replacen(key.name, &wrong, 1);
            let is_it = index + 1 == line;
            text.push_str(if is_it { &misspelt } else { original });
            text.push('\n');
        }
        let expected = format!(
            "cases/x.toml:{line}: unknown key {}.{wrong}; did you mean {}?",
            section.name, key.name
        );
        let printed = messages(&text, &[]);
        assert!(printed.contains(&expected), "{expected}\n{printed:?}");
    }
}

/// The one message for a value of a key names file, line, key and value.
fn assert_refused(section: &Section, key: &'static Key, value: &str) {
    let document = Document::full().with(section, key, value);
    let line = document.line(section, key);
    let path = if section.name.is_empty() {
        key.name.to_owned()
    } else {
        format!("{}.{}", section.name, key.name)
    };
    let printed = messages(&document.text(), &[]);
    let start = format!("cases/x.toml:{line}: {path} = {value} is not allowed: ");
    assert_eq!(printed.len(), 1, "{printed:?}");
    assert!(printed[0].starts_with(&start), "{start}\n{printed:?}");
}

fn is_allowed(section: &Section, key: &'static Key, value: &str) -> bool {
    messages(&Document::full().with(section, key, value).text(), &[]).is_empty()
}

#[test]
fn values_of_the_wrong_type_are_refused() {
    for (section, key) in all_keys() {
        let wrong: &[&str] = match key.kind {
            Kind::Text => &["3", "true", "[]", "{}", "\"\"", "2020-01-01"],
            Kind::Flag => &["0", "1.5", "\"true\"", "[true]", "{}"],
            Kind::Choice(_) => &["0", "true", "\"\"", "\"other\"", "[]", "{}"],
            Kind::Number(_) | Kind::Time(_) => &["\"3\"", "true", "[3]", "{}", "12:00:00"],
            Kind::Whole(..) => &["12.5", "\"12\"", "true", "[12]", "1e99"],
            Kind::Strings => &["3", "true", "\"one\"", "{}"],
            Kind::Table => &["3", "true", "\"one\"", "[]"],
            Kind::Intervals => &[
                "1",
                "[]",
                "[1, 0, 1, 0, 1, 0]",
                "[1, 0, 1, 0, 1, 0, 1, 0]",
                "{}",
            ],
        };
        for value in wrong {
            assert_refused(section, key, value);
        }
    }
}

#[test]
fn what_is_not_finite_or_extreme_is_refused() {
    for (section, key) in all_keys() {
        let values: &[&str] = match key.kind {
            Kind::Number(_) | Kind::Time(_) | Kind::Whole(..) => {
                &["nan", "-nan", "inf", "-inf", "+inf", "1e999", "1e51"]
            }
            Kind::Intervals => &["[nan, 0, 1, 0, 1, 0, 1]", "[1, 0, 1, 0, 1, inf, 1]"],
            _ => &[],
        };
        for value in values {
            assert_refused(section, key, value);
        }
        if matches!(key.kind, Kind::Number(Range::Positive) | Kind::Time(_)) {
            assert_refused(section, key, "1e-51");
        }
    }
}

#[test]
fn zero_and_negative_are_refused_where_the_range_says_so() {
    for (section, key) in all_keys() {
        let (zero, negative) = match key.kind {
            Kind::Number(Range::Any) => {
                let any = ["travel_mm", "load_force_n"].contains(&key.name);
                (true, any || key.name.contains("linear"))
            }
            Kind::Number(Range::NotNegative) | Kind::Time(Range::NotNegative) => (true, false),
            Kind::Whole(low, _) => (low <= 0, low < 0),
            Kind::Number(_) | Kind::Time(_) => (false, false),
            _ => continue,
        };
        assert_eq!(is_allowed(section, key, "0"), zero, "{} = 0", key.name);
        // a0 and a2 oppose the motion in the full document.
        assert_eq!(
            is_allowed(section, key, "-1"),
            negative,
            "{} = -1",
            key.name
        );
        for value in ["0", "-1"] {
            if !is_allowed(section, key, value) {
                assert_refused(section, key, value);
            }
        }
    }
}

#[test]
fn the_table_agrees_with_the_types_that_it_fills() {
    let laws = all_keys()
        .find(|(_, key)| key.name == "law")
        .unwrap()
        .1
        .kind;
    let names: Vec<&str> = Law::ALL.into_iter().map(Law::name).collect();
    assert_eq!(laws, Kind::Choice(names.leak()));
    for (_, key) in all_keys() {
        if let Need::Default(default) = key.need {
            let fits = matches!(
                (key.kind, default),
                (Kind::Flag, Value::Flag(_))
                    | (Kind::Choice(_), Value::Choice(_))
                    | (Kind::Number(_), Value::Number(_))
                    | (Kind::Whole(..), Value::Whole(_))
                    | (Kind::Time(_), Value::Nanoseconds(_))
            );
            assert!(fits, "{}", key.name);
        }
    }
}
