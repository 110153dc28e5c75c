//! A run file with every key of the table, to change one of them at a time.

use hil_core::case::Case;
use hil_core::runfile::{Key, Kind, Need, Range, SECTIONS, Section};

use super::parse;

/// A run file that gives every key, one a line.
pub(crate) struct Document(Vec<(&'static str, &'static Key, String)>);

impl Document {
    /// Every key with the first of its samples; of a pair the first only.
    pub(crate) fn full() -> Self {
        let mut entries = Vec::new();
        for (section, key) in all_keys() {
            if entries
                .iter()
                .any(|(s, k, _): &(_, &Key, _)| *s == section.name && excludes(k, key))
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
            if *s == section.name && (k.name == key.name || excludes(k, key)) {
                *k = key;
                *v = value.to_owned();
            }
        }
        self
    }

    /// Without a key, its partner and what may stand only with it.
    pub(crate) fn without(mut self, section: &Section, key: &Key) -> Self {
        self.0.retain(|(s, k, _)| {
            let follows = k.need == Need::OnlyWith(key.name);
            !(*s == section.name && (k.name == key.name || excludes(k, key) || follows))
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
    pub(crate) fn line(&self, section: &Section, key: &Key) -> usize {
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

    /// The case that it makes, without the list of what its rung leaves out: a
    /// key that does no more than stand there is dead.
    pub(crate) fn case(&self) -> Case {
        let case = parse(&self.text(), &[]).unwrap_or_else(|errors| panic!("{errors}"));
        Case {
            keys_without_effect: Vec::new(),
            ..case
        }
    }
}

/// True of a key that leaves no room for the other one of its section.
fn excludes(key: &Key, other: &Key) -> bool {
    matches!(key.need, Need::OneOf(partner) | Need::NotWith(partner) if partner == other.name)
}

pub(crate) fn all_keys() -> impl Iterator<Item = (&'static Section, &'static Key)> {
    SECTIONS
        .iter()
        .flat_map(|section| section.keys.iter().map(move |key| (section, key)))
}

/// Further keys without which a key cannot stand or acts on nothing, as sets.
pub(crate) fn beside(path: &str) -> Vec<&'static str> {
    let mut lines = include_str!("beside.txt").lines();
    let sets = lines.find_map(|line| line.strip_prefix(path)?.strip_prefix(": "));
    sets.unwrap_or_default().split_whitespace().collect()
}

/// Two allowed values of a key that go with the first values of the others.
pub(crate) fn samples(key: &Key) -> (String, String) {
    let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    match key.kind {
        Kind::Text => pair("\"one\"", "\"two\""),
        Kind::Flag => pair("true", "false"),
        Kind::Choice(choices) => {
            let last = choices[choices.len() - 1];
            let (first, second) = match key.name {
                // "continuous" needs no sample time.
                "law" => (choices[1], last),
                // Only a queue goes with feed-forward and can run dry.
                "setpoints" => (last, choices[0]),
                _ => (choices[0], last),
            };
            (format!("\"{first}\""), format!("\"{second}\""))
        }
        Kind::Number(Range::Between(low, high)) => {
            (format!("{low:e}"), format!("{:e}", (low + high) / 2.0))
        }
        Kind::Number(_) => pair("2", "3.5"),
        Kind::Whole(..) => pair("12", "14"),
        Kind::Time(Range::NotNegative) | Kind::TimeOrWord(..) => pair("0", "0.001"),
        Kind::Time(_) => match key.name {
            // Long enough for a rest, and a window within it.
            "duration_s" => pair("1000", "999"),
            "rest_window_s" => pair("200", "300"),
            _ => pair("0.002", "0.001"),
        },
        Kind::Intervals => pair("[1, 0, 1, 0, 1, 0, 1]", "[1, 0.5, 1, 0, 1, 0, 1]"),
    }
}
