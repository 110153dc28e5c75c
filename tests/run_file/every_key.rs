//! What must hold for every key of the table, one after the other.

use hil_runner::case::{Case, Law};
use hil_runner::runfile::{DefaultValue, Key, Kind, Need, Range, SECTIONS, Section};

use super::{messages, parse};

/// A run file that gives every key, one a line.
pub(crate) struct Document(Vec<(&'static str, &'static Key, String)>);

impl Document {
    /// Every key with the first of its samples; of a pair the first only.
    pub(crate) fn full() -> Self {
        let mut entries = Vec::new();
        for (section, key) in all_keys() {
            if let Need::OneOf(partner) = key.need
                && entries
                    .iter()
                    .any(|(_, k, _): &(_, &Key, _)| k.name == partner)
            {
                continue;
            }
            entries.push((section.name, key, samples(key).0));
        }
        Self(entries)
    }

    /// With another value for a key, which takes the place of its partner.
    pub(crate) fn with(mut self, section: &Section, key: &'static Key, value: &str) -> Self {
        for (s, k, v) in &mut self.0 {
            let is_partner = matches!(k.need, Need::OneOf(partner) if partner == key.name);
            if *s == section.name && (k.name == key.name || is_partner) {
                *k = key;
                *v = value.to_owned();
            }
        }
        self
    }

    /// Without a key and its partner.
    pub(crate) fn without(mut self, section: &Section, key: &Key) -> Self {
        self.0.retain(|(s, k, _)| {
            let is_partner = matches!(k.need, Need::OneOf(partner) if partner == key.name);
            !(*s == section.name && (k.name == key.name || is_partner))
        });
        self
    }

    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        for section in SECTIONS {
            if !section.name.is_empty() {
                text.push_str(&format!("[{}]\n", section.name));
            }
            for (_, key, value) in self.0.iter().filter(|(s, _, _)| *s == section.name) {
                text.push_str(&format!("{} = {value}\n", key.name));
            }
        }
        text
    }

    /// Line of a key in [`Document::text`].
    fn line(&self, section: &Section, key: &Key) -> usize {
        let text = self.text();
        let header = format!("[{}]", section.name);
        let mut inside = section.name.is_empty();
        let start = format!("{} = ", key.name);
        let at = text.lines().position(|line| {
            inside |= line == header;
            inside && line.starts_with(&start)
        });
        at.unwrap() + 1
    }

    fn case(&self) -> Case {
        parse(&self.text(), &[]).unwrap_or_else(|errors| panic!("{errors}"))
    }
}

pub(crate) fn all_keys() -> impl Iterator<Item = (&'static Section, &'static Key)> {
    SECTIONS
        .iter()
        .flat_map(|section| section.keys.iter().map(move |key| (section, key)))
}

/// Two allowed values of a key that go with the first values of the others.
pub(crate) fn samples(key: &Key) -> (String, String) {
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    match key.kind {
        Kind::Text => pair("\"one\"", "\"two\""),
        Kind::Flag => pair("true", "false"),
        Kind::Choice(choices) => {
            // "continuous" needs no sample time.
            let first = if key.name == "law" {
                choices[1]
            } else {
                choices[0]
            };
            (
                format!("\"{first}\""),
                format!("\"{}\"", choices[choices.len() - 1]),
            )
        }
        Kind::Number(Range::Between(low, high)) => {
            (format!("{low:e}"), format!("{:e}", (low + high) / 2.0))
        }
        Kind::Number(_) => pair("2", "3.5"),
        Kind::Whole(..) => pair("12", "14"),
        Kind::Time(Range::NotNegative) => pair("0", "0.001"),
        Kind::Time(_) => pair("0.002", "0.001"),
        Kind::Intervals => pair("[1, 0, 1, 0, 1, 0, 1]", "[1, 0.5, 1, 0, 1, 0, 1]"),
    }
}

#[test]
fn every_key_is_read() {
    for (section, key) in all_keys() {
        let (first, second) = samples(key);
        let before = Document::full().with(section, key, &first).case();
        let after = Document::full().with(section, key, &second).case();
        if matches!(key.kind, Kind::Choice([_])) {
            assert_eq!(first, second, "only one choice is no knob");
        } else {
            assert_ne!(
                before, after,
                "{}.{} is a dead knob",
                section.name, key.name
            );
        }
    }
}

#[test]
fn a_key_that_is_left_out_is_missing_or_has_its_default() {
    for (section, key) in all_keys() {
        let text = Document::full().without(section, key).text();
        let printed = messages(&text, &[]);
        match key.need {
            Need::Always | Need::ElasticJoint | Need::SampledLaw | Need::OneOf(_) => {
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
            Need::Optional | Need::Limit | Need::FileStem => assert_eq!(printed, [""; 0]),
            Need::Default(default) => {
                let given = Document::full()
                    .with(section, key, &default.to_toml())
                    .case();
                assert_eq!(parse(&text, &[]).unwrap(), given, "{}", key.name);
            }
        }
    }
}

#[test]
fn a_misspelt_key_is_refused_with_the_right_one() {
    for (section, key) in all_keys() {
        let mut last = key.name.to_owned();
        last.extend(key.name.chars().last());
        let text = Document::full().text();
        let document = Document::full().with(section, key, &samples(key).0);
        let line = document.line(section, key);
        let right = format!("{} = ", key.name);
        let text = if text.contains(&format!("\n{right}")) || text.starts_with(&right) {
            document.text().replacen(&right, &format!("{last} = "), 1)
        } else {
            continue;
        };
        let printed = messages(&text, &[]);
        let path = if section.name.is_empty() {
            last
        } else {
            format!("{}.{last}", section.name)
        };
        let expected = format!(
            "cases/x.toml:{line}: unknown key {path}; did you mean {}?",
            key.name
        );
        assert!(
            printed.contains(&expected) || section.name.is_empty(),
            "{expected}\n{printed:?}"
        );
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
                (true, key.name == "travel_mm" || key.name.contains("linear"))
            }
            Kind::Number(Range::NotNegative) | Kind::Time(Range::NotNegative) => (true, false),
            Kind::Number(_) | Kind::Time(_) | Kind::Whole(..) => (false, false),
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
                (Kind::Flag, DefaultValue::Flag(_))
                    | (Kind::Choice(_), DefaultValue::Choice(_))
                    | (Kind::Number(_), DefaultValue::Number(_))
                    | (Kind::Whole(..), DefaultValue::Whole(_))
                    | (Kind::Time(_), DefaultValue::Nanoseconds(_))
            );
            assert!(fits, "{}", key.name);
        }
    }
}
